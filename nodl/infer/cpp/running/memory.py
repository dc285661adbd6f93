"""Calls that were run before: one that finds all that it read as it was has the same outcome, and is not run again."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from nodl.infer.cpp.running.store import AbstractStore, Changes, Reads
from nodl.infer.cpp.running.values import Value

MEMORY_DEPTH = 20
"""Paths of calls are whole up to this depth (``Frame.path``): then the same path means the same callers."""


class CallOutcome(NamedTuple):
    """``parameters``: what the function leaves in them; ``ends``: it never comes back."""

    returned: Value
    parameters: dict[str, Value | None]
    ends: bool = False


class _Kept(NamedTuple):
    given: object
    steps: int
    reads: Reads
    changes: Changes
    outcome: CallOutcome


class Memory:
    """The last run of each call, by its function, object and path."""

    def __init__(self, store: AbstractStore) -> None:
        self._store = store
        self._kept: dict[object, _Kept] = {}

    def find(self, key: object, given: object) -> tuple[CallOutcome, int] | None:
        """The outcome of the last run, if that depended on ``given`` and all that it read is as it was; its steps."""
        kept = self._kept.get(key)
        if kept is not None and kept.given == given and self._store.holds(kept.reads):
            self._store.saw(kept.reads)
            for cell, value in kept.changes.items():
                self._store.set(cell, value)
            return kept.outcome, kept.steps
        return None

    def keep(self, key: object, given: object, action: Callable[[], tuple[CallOutcome, int]]) -> CallOutcome:
        """The outcome of ``action``, which takes so many steps."""
        found: list[tuple[CallOutcome, int]] = []
        mark = self._store.mark()
        reads = self._store.watched(lambda: found.append(action()))
        ((outcome, steps),) = found
        self._kept[key] = _Kept(given, steps, reads, self._store.changes(mark), outcome)
        return outcome
