"""The place of an action in its launch file, and the includes that lead there."""

from __future__ import annotations

from typing import NamedTuple


class SourceLocation(NamedTuple):
    """A place in a launch file. ``line`` counts from 1, 0 when unknown. ``element`` is the launch element (``node``)
    or class."""

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
