"""Files are read and parsed once per version."""

from __future__ import annotations

import io
import os
from pathlib import Path

import pytest

from enclave_launch.frontend import launch_file


def test_an_unchanged_file_is_the_same_object(tmp_path: Path) -> None:
    path = tmp_path / "a.launch.xml"
    path.write_text("<launch/>")
    assert launch_file.read(str(path)) is launch_file.read(path)


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "a.launch.xml"
    path.write_text("<launch/>")
    first = launch_file.read(path)
    path.write_text("<launch></launch>")
    os.utime(path, ns=(0, 1))
    assert (first.text, launch_file.read(path).text) == ("<launch/>", "<launch></launch>")


def test_a_text_is_parsed_once_by_each_parser() -> None:
    calls: list[str] = []

    def parse(text: str) -> list[str]:
        calls.append(text)
        return [text]

    file = launch_file.LaunchFile("f", "text")
    assert file.parsed_by(parse) is file.parsed_by(parse)
    assert calls == ["text"]


def test_a_failed_parse_fails_again_without_work() -> None:
    calls: list[str] = []

    def parse(text: str) -> None:
        calls.append(text)
        raise ValueError("bad")

    file = launch_file.LaunchFile("f", "text")
    for _ in range(2):
        with pytest.raises(ValueError, match="bad"):
            file.parsed_by(parse)
    assert calls == ["text"]


def test_an_open_file_is_read_from_where_it_stands() -> None:
    stream = io.StringIO("xx<launch/>")
    stream.seek(2)
    assert launch_file.read(stream).text == "<launch/>"


def test_newlines_are_universal_and_a_mark_stays(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    path.write_bytes(b"\xef\xbb\xbf<launch>\r\n</launch>")
    assert launch_file.read(path).text == "\ufeff<launch>\n</launch>"


def test_bytes_that_are_no_text_are_an_error(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    path.write_bytes(b'<launch a="\xff"/>')
    with pytest.raises(UnicodeDecodeError):
        launch_file.read(path)


def test_a_huge_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launch_file, "MAX_CHARACTERS", 10)
    path = tmp_path / "a.xml"
    path.write_text("<launch/><!-- -->")
    with pytest.raises(launch_file.LaunchFileTooLarge, match="more than 10 characters"):
        launch_file.read(path)
