"""The place where a statement about a node was read: the evidence behind every permission."""

from __future__ import annotations

from typing import NamedTuple


class SourceRef(NamedTuple):
    """A place in a file. ``line`` counts from 1; 0 when the whole file (or no line) is meant."""

    file: str
    line: int = 0

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else self.file
