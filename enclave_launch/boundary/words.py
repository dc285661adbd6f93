"""Numbers and lists in sentences. Pure."""

from __future__ import annotations

from collections.abc import Iterable


def counted(number: int, what: str) -> str:
    """``1 node``, ``2 nodes``."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def some_of(names: Iterable[object], most: int, between: str = ", ") -> str:
    """The first ``most`` of them, and how many more there are."""
    texts = [str(name) for name in names]
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return between.join(texts[:most]) + more
