"""What models remember of objects, nodes and the program beside variables: branches do not undo it. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

Noted = dict[tuple["Notes", str], object]  # what was asked for, and the answer at the first time
_ABSENT = object()


class NoteLog:
    """The notes that were read since somebody wanted to know; ``None`` while nobody does."""

    def __init__(self) -> None:
        self.noted: Noted | None = None


class Notes:
    """Values by name, equal to themselves alone. What is read is told to the log."""

    def __init__(self, log: NoteLog | None = None) -> None:
        self._log = log
        self._values: dict[str, Any] = {}

    def get(self, name: str, default: Any = None) -> Any:
        if self._log is not None and self._log.noted is not None:
            self._log.noted.setdefault((self, name), self._values.get(name, _ABSENT))
        return self._values.get(name, default)

    def __getitem__(self, name: str) -> Any:
        return self.get(name)

    def __setitem__(self, name: str, value: Any) -> None:
        self._values[name] = value

    def update(self, **values: Any) -> None:
        self._values.update(values)

    def __contains__(self, name: str) -> bool:
        return self.get(name, _ABSENT) is not _ABSENT

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)


def hold(noted: Noted) -> bool:
    """Whether all these notes say what they said."""
    for (notes, name), said in noted.items():
        says = notes._values.get(name, _ABSENT)
        if says is not said and says != said:
            return False
    return True
