"""Findings over time → those that stand, each reported once. Performs no I/O; the time is handed in.

What was announced is a fact at once. What discovery could still take back has to stand for ``settle`` seconds. What is
missing may still come: it is reported after ``absence`` seconds. As long as findings of one kind go by themselves the
system is still starting, and the time of those that are left begins again.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from enclave_launch.drift.finding import DriftFinding, FindingCertainty

Key = tuple[str, str, str, str]


class SettlingTimes(NamedTuple):
    """Seconds; ``longest``: reported then, whatever others of its kind do.

    50 secured processes that started at once on two cores with a load of 140 took more than two minutes to authenticate
    each other, one after another."""

    settle: float = 30.0
    absence: float = 120.0
    longest: float = 600.0

    def of(self, certainty: FindingCertainty) -> float:
        return {
            FindingCertainty.FACT: 0.0,
            FindingCertainty.WHEN_SETTLED: self.settle,
            FindingCertainty.ABSENCE: self.absence,
        }[certainty]


class Change(NamedTuple):
    """``over``: what was reported and is no longer so."""

    new: tuple[DriftFinding, ...] = ()
    over: tuple[DriftFinding, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.new or self.over)


class Steady:
    """Takes all findings of each point in time, in order."""

    def __init__(self, patience: SettlingTimes | None = None) -> None:
        self._patience = patience or SettlingTimes()
        self._since: dict[Key, float] = {}
        self._reported: dict[Key, DriftFinding] = {}
        self._went: dict[str, float] = {}
        """Kind → when one of it was last over."""

    def at(self, now: float, findings: Iterable[DriftFinding]) -> Change:
        """Return what is to be reported at ``now``."""
        found = {each.key: each for each in findings}
        self._went.update({key[0]: now for key in self._since if key not in found})
        self._since = {key: self._since.get(key, now) for key in found}
        new = {
            key: each for key, each in found.items() if key not in self._reported and self._stands(now, each)
        }
        over = [self._reported.pop(key) for key in list(self._reported) if key not in found]
        self._reported.update(new)
        return Change(tuple(new.values()), tuple(over))

    def _stands(self, now: float, finding: DriftFinding) -> bool:
        wait, since = self._patience.of(finding.certainty), self._since[finding.key]
        begins = max(since, self._went.get(finding.kind.value, since))
        return now - begins >= wait or now - since >= max(wait, self._patience.longest)
