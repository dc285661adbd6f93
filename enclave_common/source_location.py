"""A place in a file: of a launch action with the includes that lead there, of a name in a manifest or a source."""

from __future__ import annotations

from typing import NamedTuple


class SourceLocation(NamedTuple):
    """A place in a file.

    Args:
        line: Counts from 1. 0 is the whole file, or an unknown line.
        element: The launch element (``node``) or class, empty elsewhere.
    """

    file: str
    line: int = 0
    element: str = ""
    includes: tuple[str, ...] = ()  # "file:line" of each include on the way, outermost first

    @classmethod
    def read(cls, text: str) -> SourceLocation:
        """Read ``file:line`` or ``file``, as ``str`` writes it."""
        file, colon, line = text.rpartition(":")
        return cls(file, int(line)) if colon and line.isdecimal() else cls(text)

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else self.file
