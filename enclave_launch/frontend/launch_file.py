"""Read a launch file once per version (path, modification time, size); only text and immutable trees are cached."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from functools import lru_cache
from typing import Any, TextIO, TypeVar

from enclave_common.files import check_regular, read_text

MAX_CHARACTERS = 64 * 2**20  # of one launch file; a generated file with 100,000 nodes has about a third

Tree = TypeVar("Tree")


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
        """Return ``parse(text)``, computed once; a failure is raised again each time."""
        if parse not in self._parsed:
            try:
                self._parsed[parse] = (parse(self.text), None)
            except Exception as error:  # cached as a value and raised below, whatever it is
                self._parsed[parse] = (None, error)
        tree, failure = self._parsed[parse]
        if failure is not None:
            raise failure.with_traceback(None)
        result: Tree = tree
        return result

    def open(self) -> TextIO:
        """Return the text as a file, for front ends that want one."""
        file = io.StringIO(self.text)
        file.name = self.name  # as a file from open() has it; front ends look at it
        return file


def read(file: str | bytes | os.PathLike[str] | TextIO) -> LaunchFile:
    """Read the file at a path, cached while it is unchanged; raises OSError, UnicodeDecodeError, LaunchFileTooLarge."""
    if not isinstance(file, str | bytes | os.PathLike):
        return LaunchFile(str(getattr(file, "name", "")), _limited(file.read()))
    path = os.fsdecode(file)
    status = check_regular(path)
    return _version(path, status.st_ino, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=256)
def _version(path: str, *_state: int) -> LaunchFile:
    return LaunchFile(path, _limited(read_text(path, limit=4 * MAX_CHARACTERS)))


def _limited(text: str) -> str:
    if len(text) > MAX_CHARACTERS:
        raise LaunchFileTooLarge(f"the file has more than {MAX_CHARACTERS} characters")
    return text
