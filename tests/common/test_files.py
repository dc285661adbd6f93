"""Reading what others wrote: regular files of bounded size, and nothing that makes us wait or fill the memory."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from enclave_common.files import read_bytes, read_text


def test_a_regular_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x" * 100_000)
    assert read_bytes(tmp_path / "a") == b"x" * 100_000


def test_a_link_to_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("text")
    (tmp_path / "b").symlink_to("a")
    assert read_text(tmp_path / "b") == "text"


def test_line_ends_are_those_of_text_files(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"one\r\ntwo\rthree\n")
    assert read_text(tmp_path / "a") == (tmp_path / "a").read_text() == "one\ntwo\nthree\n"


def test_the_limit_itself_is_allowed_one_byte_more_is_not(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"1234")
    assert read_bytes(tmp_path / "a", limit=4) == b"1234"
    with pytest.raises(OSError, match="larger than the allowed 3 bytes") as refused:
        read_bytes(tmp_path / "a", limit=3)
    assert refused.value.errno == errno.EFBIG


def test_a_file_that_has_more_than_its_size_says_is_read_and_bounded() -> None:
    assert read_bytes("/proc/self/status").startswith(b"Name:")
    with pytest.raises(OSError, match="larger than the allowed 10 bytes"):
        read_bytes("/proc/self/status", limit=10)


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/tty", "/dev/stdin", "/dev/urandom"])
def test_devices_are_refused(path: str) -> None:
    with pytest.raises(OSError):  # without a terminal /dev/tty cannot even be opened
        read_bytes(path)


def test_a_pipe_that_nobody_writes_to_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="A pipe, not a file"):
        read_bytes(tmp_path / "pipe")


def test_folders_and_missing_files_fail_as_open_does(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        read_bytes(tmp_path)
    with pytest.raises(FileNotFoundError):
        read_bytes(tmp_path / "none")


def test_a_sparse_file_of_a_terabyte_is_refused_unread(tmp_path: Path) -> None:
    with open(tmp_path / "huge", "wb") as file:
        file.truncate(2**40)
    with pytest.raises(OSError, match="larger than"):
        read_bytes(tmp_path / "huge")
