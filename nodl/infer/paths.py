"""Programs that test parameters, followed once per outcome: what only one outcome makes is kept for launch to decide.

More tests than ``MAX_FORKS`` in a row leave the joined run as it is, which grants what any outcome makes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from nodl.infer.findings import Findings, FoundEndpoint, NodeRecord
from nodl.infer.interpreter.conditions import OPPOSITE, Condition
from nodl.infer.interpreter.run import Run
from nodl.infer.text import Input, Piece, Text, make_text, pieces_of

MAX_FORKS = 4  # tests of which each outcome is followed by itself
MAX_STEPS = 40_000  # of all paths together; a larger program is not followed path by path
Guards = frozenset[tuple[str, str, tuple[str, ...]]]
Follow = Callable[["Decisions"], Run]


class TooManyPaths(Exception):
    """The program has more such tests in a row than are followed one by one."""


class Decisions:
    """Outcomes of the tests on one path through the program, in their order."""

    def __init__(self, outcomes: list[bool]) -> None:
        self.outcomes = outcomes
        self.conditions: list[Condition] = []
        self.taken = 0

    def next(self, condition: Condition) -> bool:
        """Return the outcome of the next test. Raises ``TooManyPaths``."""
        if self.taken == MAX_FORKS:
            raise TooManyPaths
        if self.taken == len(self.outcomes):
            self.outcomes.append(True)
        outcome = self.outcomes[self.taken]
        self.conditions.append(condition)
        self.taken += 1
        return outcome


class Path(NamedTuple):
    """A run that followed one path through the program, with the outcomes that led it there."""

    run: Run
    decisions: Decisions


def refine(run: Run, follow: Follow) -> None:
    """Replace the findings of the joined ``run`` by those of its single paths, where that can tell more."""
    if not run.conditional or 2 * run.steps > MAX_STEPS:
        return
    try:
        paths = list(_paths(follow))
    except TooManyPaths:
        return
    if len(paths) < 2 or any(path.run.gave_up for path in paths):
        return
    run.findings = _merged(paths)


def _paths(follow: Follow) -> Iterator[Path]:
    """Follow every path, by flipping the last outcome that was not flipped yet."""
    outcomes: list[bool] = []
    steps = 0
    while True:
        decisions = Decisions(list(outcomes))
        path = Path(follow(decisions), decisions)
        steps += path.run.steps
        if steps > MAX_STEPS:
            raise TooManyPaths
        yield path
        outcomes = decisions.outcomes[: decisions.taken]
        while outcomes and not outcomes[-1]:
            outcomes.pop()
        if not outcomes:
            return
        outcomes[-1] = False


def _merged(paths: list[Path]) -> Findings:
    """Return all that some path found; endpoints that not every path makes carry the conditions of theirs."""
    merged = Findings()
    merged.by_path = True
    found: dict[object, set[Guards]] = {}
    for path in paths:
        made_there = ((record, each) for record in path.run.findings.nodes for each in record.endpoints)
        for record, endpoint in made_there:
            found.setdefault(_identity(record, endpoint), set()).add(_guards(path.decisions))
    conditions = {identity: _simplified(guards) for identity, guards in found.items()}
    for path in paths:
        for record in path.run.findings.nodes:
            made: dict[FoundEndpoint, None] = {}
            for endpoint in record.endpoints:
                for guards in conditions.pop(_identity(record, endpoint), ()):
                    made[_guarded(endpoint, guards, record)] = None
            record.endpoints = made
            merged.add_node(record)
        merged.gaps.update(path.run.findings.gaps)
        merged.global_arguments = path.run.findings.global_arguments
    return merged


def _identity(record: NodeRecord, endpoint: FoundEndpoint) -> object:
    """Return a key that is the same on all paths, though each has node records of its own."""
    name = endpoint.name
    if isinstance(name, Text):
        name = tuple((p.name, p.item, p.edits) if isinstance(p, Input) else p for p in name.pieces)
    return record.source, tuple(map(str, record.names)), endpoint._replace(name=str(name))


def _guards(decisions: Decisions) -> Guards:
    guards = []
    for outcome, condition in zip(decisions.outcomes, decisions.conditions, strict=False):
        asked, edit, given = condition
        guards.append((asked.name, edit if outcome else OPPOSITE[edit], given))
    return frozenset(guards)


def _simplified(alternatives: set[Guards]) -> list[Guards]:
    """Return the same alternatives without a condition that may hold or not: (a and b) or (a and not b) is a."""
    left = set(alternatives)
    for one in sorted(alternatives, key=sorted):
        for guard in sorted(one):
            name, edit, given = guard
            other = (one - {guard}) | {(name, OPPOSITE[edit], given)}
            if one in left and other in left:
                return _simplified((left - {one, other}) | {one - {guard}})
    shortest = [guards for guards in left if not any(other < guards for other in left)]
    return sorted(shortest, key=sorted)


def _guarded(endpoint: FoundEndpoint, guards: Guards, record: NodeRecord) -> FoundEndpoint:
    own = [guard for guard in sorted(guards) if guard[0] in record.parameters]
    if not own or len(own) < len(guards) or not isinstance(endpoint.name, str | Text):
        return endpoint
    conditions: list[Piece] = [Input(name, record, None, ((edit, given),)) for name, edit, given in own]
    return endpoint._replace(name=make_text((*conditions, *pieces_of(endpoint.name))))
