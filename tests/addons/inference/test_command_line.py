"""``secure-nodl infer`` as a user meets it: exit status, messages, and files that are not what they seem."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from nodl.verb import main

NODE = 'import rclpy\nnode = rclpy.create_node("fine")\nnode.create_publisher(object, "topic", 10)\n'


@pytest.fixture(autouse=True)
def nothing_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


def infer(*words: object) -> int:
    return main(["infer", *map(str, words)])


def test_what_does_not_exist_is_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert infer(tmp_path / "missing.py") == 2
    assert (
        capsys.readouterr().err
        == f"secure-nodl infer: error: no such file or folder: {tmp_path}/missing.py\n"
    )
    assert infer("no_such_package") == 2
    assert "neither a file or folder nor an installed package" in capsys.readouterr().err


def test_a_folder_without_nodes_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "tool.py").write_text("print('no node here')\n")
    assert infer(tmp_path) == 1
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", "secure-nodl infer: error: no node was found in 1 source file\n")
    assert infer(tmp_path, "--format", "json") == 1
    assert json.loads(capsys.readouterr().out) == {"nodes": [], "unresolved": []}


NOT_PROGRAMS = {
    "python2.py": (b'print "hello"\n', "is not valid Python 3"),
    "broken.py": (b"def f(:\n", "is not valid Python 3"),
    "encoding.py": (b'# coding: no-such-codec\nprint("x")\n', "is not valid Python 3"),
    "latin.py": (b'name = "\xe9"\n', "is not valid Python 3"),
    "null.py": (b"x = 1\0\n", "null bytes"),
    "nested.py": (b"x = " + b"-" * 20_000 + b"1\n", "cannot be parsed"),
    "huge.py": (b"x = [" + b"1, " * 400_000 + b"]\n", "too large"),
}


@pytest.mark.parametrize("name", NOT_PROGRAMS)
def test_a_file_that_cannot_be_analysed_is_a_gap(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content, why = NOT_PROGRAMS[name]
    (tmp_path / name).write_bytes(content)
    (tmp_path / "fine.py").write_text(NODE)
    assert infer(tmp_path, "--format", "json") == 0
    document = json.loads(capsys.readouterr().out)
    assert [node["name"] for node in document["nodes"]] == ["fine"]
    (question,) = document["unresolved"]
    assert question["file"] == str(tmp_path / name)
    assert why in question["why"]


def test_what_is_no_regular_file_is_a_gap(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "pipe.py")
    (tmp_path / "dangling.py").symlink_to("nowhere.py")
    (tmp_path / "folder.py").mkdir()
    (tmp_path / "folder.py/self").symlink_to(tmp_path)
    (tmp_path / "fine.py").write_text(NODE)
    assert infer(tmp_path) == 0
    shown = capsys.readouterr().out
    assert "pipe.py: the file is not a regular file" in shown
    assert "dangling.py: the file cannot be read: No such file or directory" in shown


@pytest.mark.skipif(os.geteuid() == 0, reason="root reads everything")
def test_an_unreadable_file_is_a_gap(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "secret.py").write_text(NODE)
    (tmp_path / "secret.py").chmod(0)
    assert infer(tmp_path) == 1
    assert "the file cannot be read: Permission denied" in capsys.readouterr().out


def test_declared_encodings_marks_and_line_ends_are_read_as_python_reads_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.py").write_bytes(b"# coding: latin-1\n# \xe9\n" + NODE.replace("fine", "latin").encode())
    (tmp_path / "b.py").write_bytes(b"\xef\xbb\xbf" + NODE.replace("fine", "marked").encode())
    (tmp_path / "c.py").write_bytes(NODE.replace("fine", "windows").replace("\n", "\r\n").encode())
    assert infer(tmp_path, "--format", "json") == 0
    nodes = json.loads(capsys.readouterr().out)["nodes"]
    assert [(node["name"], node["line"]) for node in nodes] == [("latin", 4), ("marked", 2), ("windows", 2)]


@pytest.mark.parametrize("kind", ["text", "json", "v2"])
def test_file_names_that_are_not_utf8(kind: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    Path(os.fsdecode(os.fsencode(tmp_path) + b"/\xff.py")).write_text(NODE)
    assert infer(tmp_path, "--format", kind) == 0
    assert infer(tmp_path, "--format", kind, "--all", "-o", tmp_path / "out") == 0
    assert "fine" in capfd.readouterr().out
