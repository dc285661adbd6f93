"""Read a launch file once per version, and keep what was parsed from it. Touches the file system, read only.

A file is known by its real state (path, modification time, size): the argument scan, the include itself and
repeated includes then read and parse once. Only text and immutable trees are kept, never entities or actions.
"""

from __future__ import annotations

import io
import os
from collections import OrderedDict
from collections.abc import Callable

from enclave_launch.boundary.files import check_regular, read_text
from enclave_launch.boundary.light import Any, TextIO, TypeVar

MAX_CHARACTERS = 64 * 2**20  # of one launch file; a generated file with 100,000 nodes has about a third
_MAX_KEPT_CHARACTERS = 32 * 2**20  # text of all kept files; their trees take about ten times that

Tree = TypeVar("Tree")
Stamp = tuple[str, int, int, int]  # path, device and inode mixed in by ino, mtime in ns, size


class LaunchFileTooLarge(ValueError):
    """A file beyond ``MAX_CHARACTERS``."""


class LaunchFile:
    """Text of one file and what the front ends made of it."""

    __slots__ = ("_parsed", "name", "text")

    def __init__(self, name: str, text: str):
        self.name = name
        self.text = text
        self._parsed: dict[Callable[[str], Any], Any] = {}

    def parsed_by(self, parse: Callable[[str], Tree]) -> Tree:
        """``parse(text)``, computed once; a failure is raised again each time."""
        if parse not in self._parsed:
            try:
                self._parsed[parse] = (parse(self.text), None)
            except Exception as error:  # kept as a value and raised below, whatever it is
                self._parsed[parse] = (None, error)
        tree, failure = self._parsed[parse]
        if failure is not None:
            raise failure.with_traceback(None)
        result: Tree = tree
        return result

    def open(self) -> TextIO:
        """The text as a file, for front ends that want one."""
        file = io.StringIO(self.text)
        file.name = self.name  # as a file from open() has it; front ends look at it
        return file


_kept: OrderedDict[Stamp, LaunchFile] = OrderedDict()
_kept_characters = 0


def read(file: str | bytes | os.PathLike[str] | TextIO) -> LaunchFile:
    """The file at a path, from memory while it is unchanged, or the rest of an open file.

    Raises ``OSError``, ``UnicodeDecodeError``, ``LaunchFileTooLarge``.
    """
    if not isinstance(file, str | bytes | os.PathLike):
        return LaunchFile(str(getattr(file, "name", "")), _limited(file.read()))
    path = os.fsdecode(file)
    status = check_regular(path)
    stamp = (path, status.st_ino, status.st_mtime_ns, status.st_size)
    kept = _kept.get(stamp)
    if kept is not None:
        _kept.move_to_end(stamp)
        return kept
    return _keep(stamp, LaunchFile(path, _read_text(path)))


def forget() -> None:
    """Drop everything kept."""
    global _kept_characters
    _kept.clear()
    _kept_characters = 0


def _read_text(path: str) -> str:
    return _limited(read_text(path, limit=4 * MAX_CHARACTERS))


def _limited(text: str) -> str:
    if len(text) > MAX_CHARACTERS:
        raise LaunchFileTooLarge(f"the file has more than {MAX_CHARACTERS} characters")
    return text


def _keep(stamp: Stamp, file: LaunchFile) -> LaunchFile:
    global _kept_characters
    _kept[stamp] = file
    _kept_characters += len(file.text)
    while _kept_characters > _MAX_KEPT_CHARACTERS and len(_kept) > 1:
        _, dropped = _kept.popitem(last=False)
        _kept_characters -= len(dropped.text)
    return file
