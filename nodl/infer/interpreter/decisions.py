"""The undecided tests on one path through a program, each of them with an outcome."""

from __future__ import annotations

MAX_FORKS = 4  # undecided tests of which each outcome is followed by itself


class TooManyPaths(Exception):
    """The program has more undecided tests in a row than are followed one by one."""


class Decisions:
    """Outcomes of the undecided tests on one path through the program, in their order."""

    def __init__(self, outcomes: list[bool]) -> None:
        self.outcomes = outcomes
        self.conditions: list[object] = []  # what the test asks of a parameter, or None
        self.taken = 0

    def next(self, condition: object) -> bool:
        """The outcome of the next test. Raises ``TooManyPaths``."""
        if self.taken == MAX_FORKS:
            raise TooManyPaths
        if self.taken == len(self.outcomes):
            self.outcomes.append(True)
        outcome = self.outcomes[self.taken]
        self.conditions.append(condition)
        self.taken += 1
        return outcome
