"""Answers about Python programs are kept, and hold only while everything that they were made from is the same."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_addons.inference import infer_executable, infer_paths, packages
from enclave_addons.inference.answers.python import own_sources
from enclave_addons.inference.python import analysis
from enclave_addons.inference.python.program import Program, ProgramTarget

PROGRAM = """\
#!/usr/bin/python3
import rclpy
from std_msgs.msg import String
import names, more, some_library
rclpy.init()
node = rclpy.create_node("n")
for topic in more.TOPICS:
    node.create_publisher(String, topic, 1)
node.create_publisher(String, names.FIRST, 1)
"""


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """A program with two modules beside it."""
    prefix = tmp_path / "install"
    _install(prefix, "demo")
    (prefix / "lib/demo").mkdir(parents=True)
    (prefix / "lib/demo/program").write_text(PROGRAM)
    (prefix / "lib/demo/program").chmod(0o755)
    (prefix / "lib/demo/names.py").write_text("FIRST = 'first'\n")
    (prefix / "lib/demo/more.py").write_text("TOPICS = ['second']\n")
    return prefix


def _install(prefix: Path, package: str) -> None:
    index = prefix / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True, exist_ok=True)
    (index / package).touch()
    (prefix / "share" / package).mkdir(exist_ok=True)


def _names(*prefixes: Path) -> list[str]:
    found = infer_executable("demo", "program", prefixes=[str(prefix) for prefix in prefixes])
    return sorted(str(endpoint.name) for node in found.interfaces for endpoint in node.endpoints)


@pytest.fixture
def analyses(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The programs that were analysed, rather than taken from what was kept."""
    seen: list[str] = []
    really = analysis.infer_program

    def infer_program(program: Program, target: ProgramTarget, path: str, *others: Any) -> object:
        seen.append(path)
        return really(program, target, path, *others)

    monkeypatch.setattr(analysis, "infer_program", infer_program)
    return seen


def test_the_second_launch_analyses_nothing(prefix: Path, analyses: list[str]) -> None:
    assert _names(prefix) == ["first", "second"]
    assert _names(prefix) == ["first", "second"]
    assert len(analyses) == 1


CHANGES: dict[str, tuple[Callable[[Path], object], list[str]]] = {
    "the program": (
        lambda prefix: (prefix / "lib/demo/program").write_text(
            PROGRAM + "node.create_publisher(String, 'third', 1)\n"
        ),
        ["first", "second", "third"],
    ),
    "a module that it imports": (
        lambda prefix: (prefix / "lib/demo/names.py").write_text("FIRST = 'other'\n"),
        ["other", "second"],
    ),
    "another module that it imports": (
        lambda prefix: (prefix / "lib/demo/more.py").write_text("TOPICS = ['fourth']\n"),
        ["first", "fourth"],
    ),
    "a library that was not there and now is": (
        lambda prefix: (prefix / "lib/demo/some_library.py").write_text(
            "import more\nmore.TOPICS.append('third')\n"
        ),
        ["first", "second", "third"],
    ),
}


@pytest.mark.parametrize("what", CHANGES)
def test_a_change_is_seen(what: str, prefix: Path) -> None:
    change, after = CHANGES[what]
    assert _names(prefix) == ["first", "second"]
    change(prefix)
    assert _names(prefix) == after


def test_what_was_changed_back_is_known_again(prefix: Path, analyses: list[str]) -> None:
    topics = prefix / "lib/demo/more.py"
    for content in ("second", "fourth", "second", "fourth"):
        topics.write_text(f"TOPICS = ['{content}']\n")
        _names(prefix)
    assert len(analyses) == 2


def test_an_answer_ends_with_any_change_of_our_own_code() -> None:
    script = (
        "import sys, enclave_addons.inference.python.analysis\n"
        "print(*(m.__file__ for n, m in sys.modules.items() if n.startswith(('nodl.', 'enclave_addons.inference.'))),"
        " sep='\\n')"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    ours = {str(path) for path in own_sources()}
    assert len(loaded) > 40
    assert [path for path in loaded if path not in ours] == []


def test_a_damaged_entry_is_not_believed(prefix: Path, kept_answers: Path, analyses: list[str]) -> None:
    _names(prefix)
    (entry,) = (
        each for each in kept_answers.rglob("*") if each.is_file() and b"more.py" in each.read_bytes()
        and str(prefix).encode() in each.read_bytes()
    )  # fmt: skip
    entry.write_bytes(entry.read_bytes().replace(b"second", b"stolen"))
    assert _names(prefix) == ["first", "second"]
    assert len(analyses) == 2


def test_without_a_folder_every_launch_analyses(
    prefix: Path, analyses: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    assert _names(prefix) == _names(prefix)
    assert len(analyses) == 2


def test_files_that_were_inferred_together_are_not_analysed_again(tmp_path: Path, kept_answers: Path) -> None:
    (tmp_path / "one.py").write_text("import rclpy\nrclpy.create_node('one')\n")
    (tmp_path / "two.py").write_text("import rclpy\nfrom names import NAME\nrclpy.create_node(NAME)\n")
    (tmp_path / "names.py").write_text("NAME = 'two'\n")
    first = infer_paths([tmp_path])
    assert {node.name for node in first.nodes} == {"one", "two"}
    written = _written(kept_answers)
    assert infer_paths([tmp_path]) == first
    assert _written(kept_answers) == written
    (tmp_path / "names.py").write_text("NAME = 'three'\n")
    assert {node.name for node in infer_paths([tmp_path]).nodes} == {"one", "three"}
    assert _written(kept_answers) != written


def _written(folder: Path) -> dict[Path, int]:
    """Return when each answer was written: an analysis writes its answer."""
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


ASKS_A_LIBRARY = """\
#!/usr/bin/python3
import rclpy, some_library
rclpy.create_node("n")
some_library.Robot()
"""


def test_what_package_xml_says_of_a_library_is_part_of_an_answer(tmp_path: Path) -> None:
    (tmp_path / "main.py").write_text(ASKS_A_LIBRARY)
    _depend(tmp_path, "rclpy")
    assert not any(node.gaps for node in infer_paths([tmp_path]).nodes)
    _depend(tmp_path, "some_library")
    found = infer_paths([tmp_path])
    assert "some_library" in str([found.gaps, *(node.gaps for node in found.nodes)])


def test_a_launch_sees_what_package_xml_says_of_a_library(prefix: Path) -> None:
    program = prefix / "lib/demo/program"
    program.write_text(ASKS_A_LIBRARY)
    _depend(program.parent, "rclpy")
    (known,) = infer_executable("demo", "program", prefixes=[str(prefix)]).interfaces
    assert not known.gaps
    _depend(program.parent, "some_library")
    (asked,) = infer_executable("demo", "program", prefixes=[str(prefix)]).interfaces
    assert "some_library" in str(asked.gaps)


def _depend(folder: Path, library: str) -> None:
    (folder / "package.xml").write_text(f"<package><name>demo</name><depend>{library}</depend></package>")
    packages.read_package.cache_clear()  # the next run of the tool
