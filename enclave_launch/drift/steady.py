"""Findings over time → those that stand, each told once. Pure: moments are handed in.

What was announced is a fact at once. What discovery could still take back has to stand for ``settle`` seconds. What is
missing may still come: it is told after ``absence`` seconds.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from enclave_launch.drift.finding import DriftFinding, FindingCertainty

Key = tuple[str, str, str, str]


class SettlingTimes(NamedTuple):
    """Seconds. Where 50 processes started at once on two busy cores, some nodes had no names 5 s after their
    participants were there."""

    settle: float = 30.0
    absence: float = 120.0

    def of(self, certainty: FindingCertainty) -> float:
        return {
            FindingCertainty.FACT: 0.0,
            FindingCertainty.WHEN_SETTLED: self.settle,
            FindingCertainty.ABSENCE: self.absence,
        }[certainty]


class Change(NamedTuple):
    """``over``: what was told before and is no longer so."""

    new: tuple[DriftFinding, ...] = ()
    over: tuple[DriftFinding, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.new or self.over)


class Steady:
    """Told of all findings of each moment, in order."""

    def __init__(self, patience: SettlingTimes | None = None) -> None:
        self._patience = patience or SettlingTimes()
        self._since: dict[Key, float] = {}
        self._told: dict[Key, DriftFinding] = {}

    @property
    def standing(self) -> tuple[DriftFinding, ...]:
        """What was told and is so."""
        return tuple(self._told.values())

    def at(self, now: float, findings: Iterable[DriftFinding]) -> Change:
        """What is to be told at ``now``."""
        found = {each.key: each for each in findings}
        self._since = {key: self._since.get(key, now) for key in found}
        new = {
            key: each
            for key, each in found.items()
            if key not in self._told and now - self._since[key] >= self._patience.of(each.certainty)
        }
        over = [self._told.pop(key) for key in list(self._told) if key not in found]
        self._told.update(new)
        return Change(tuple(new.values()), tuple(over))
