"""Python launch files run as foreign code, without leaving anything behind."""

from __future__ import annotations

import os
import py_compile
import sys
from pathlib import Path

import pytest

from enclave_launch.frontend import python_file


def write(path: Path, text: str) -> str:
    path.write_text(text)
    return str(path)


def test_the_module_is_new_and_unknown_to_sys_modules(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.py", "name = __name__\nplace = __file__\n")
    module = python_file.run(path, allowed=True)
    assert (module.name, module.place) == ("python_launch_file", path)
    assert "python_launch_file" not in sys.modules
    assert str(tmp_path) not in sys.path


def test_no_bytecode_is_written(tmp_path: Path) -> None:
    python_file.run(write(tmp_path / "a.launch.py", "x = 1\n"), allowed=True)
    assert os.listdir(tmp_path) == ["a.launch.py"]


def test_bytecode_that_upstream_left_is_used_while_the_file_is_unchanged(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.py", "x = 'source'\n")
    compiled = Path(py_compile.compile(path) or "")
    code = compiled.read_bytes()
    compiled.write_bytes(code.replace(b"source", b"SOURCE"))  # to tell them apart
    assert python_file.run(path, allowed=True).x == "SOURCE"
    write(tmp_path / "a.launch.py", "x = 'a change'\n")
    assert python_file.run(path, allowed=True).x == "a change"
    assert compiled.read_bytes() == code.replace(b"source", b"SOURCE")


def test_the_file_runs_each_time_and_a_changed_file_anew(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.py", "x = []\n")
    first, second = (python_file.run(path, allowed=True) for _ in range(2))
    assert first.x is not second.x
    write(tmp_path / "a.launch.py", "x = 'changed'\n")
    assert python_file.run(path, allowed=True).x == "changed"


def test_no_python_refuses_before_anything_runs(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.py", f"open({str(tmp_path / 'proof')!r}, 'w')\n")
    with pytest.raises(python_file.PythonRefused, match=r"a\.launch\.py.*--no-python"):
        python_file.run(path, allowed=False)
    assert not (tmp_path / "proof").exists()


def test_a_missing_file_is_missing_even_where_python_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        python_file.run(str(tmp_path / "none.py"), allowed=False)


def test_an_exception_is_placed_in_the_users_own_frame(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.py", "import json\n\ndef f():\n    json.loads('{')\n\nf()\n")
    with pytest.raises(ValueError, match="Expecting") as caught:
        python_file.run(path, allowed=True)
    place = python_file.user_frame(caught.value, path)
    assert str(place) == f"{path}:4"


def test_a_syntax_error_is_placed_at_its_line(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.py", "x = 1\ny = = 2\n")
    with pytest.raises(SyntaxError) as caught:
        python_file.run(path, allowed=True)
    assert str(python_file.user_frame(caught.value, path)) == f"{path}:2"


def test_a_foreign_exception_has_no_place_in_the_file(tmp_path: Path) -> None:
    assert python_file.user_frame(ValueError("elsewhere"), str(tmp_path / "a.launch.py")) is None
