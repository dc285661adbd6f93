"""A run of one program: order, branches, loops, contexts, callbacks, conditions, and the count of steps.

A front end derives from ``Machine`` and gives ``call_back``. Statements return the ways on which they are left
(``NEXT``, ``RETURN`` ...), none at all where an error or an endless loop ends the path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

from enclave_addons.inference.kernel.findings import Findings, FoundEndpoint, FoundNode
from enclave_addons.inference.kernel.store import CellId, CellStore, Written, same
from enclave_addons.inference.kernel.texts import Input, Text, pieces_of, text_of
from enclave_addons.inference.kernel.values import LocalCells, Obj, Value
from enclave_common.source_location import SourceLocation
from nodl.node_interface import EndpointKind, QosPolicies

NEXT, RETURN, BREAK, CONTINUE = 1, 2, 4, 8

MAX_STEPS = 400_000
MAX_DEPTH = 60
MAX_CONTEXTS = 60  # of one function; then its calls are told apart by their object alone
MAX_ROUNDS = 10
MAX_REPLAYED = 200  # cells written by a call that is not run again
MAX_TURNS = 9
WIDEN_FROM = 3

Side = Callable[[], int]


class StepLimitExceeded(Exception):
    """The program needs more steps than are counted out to it."""


@dataclass
class Jumps:
    """Where early ways out of a call or loop meet: what each had written since ``mark``."""

    mark: int
    exits: list[Written] = field(default_factory=list)
    turn: int = 0  # the mark of the present turn of a loop
    next_turns: list[Written] = field(default_factory=list)


class Guard(NamedTuple):
    """A condition on an input that holds here: the edit that keeps a name where it holds."""

    asked: Input
    edit: str
    given: tuple[str, ...]

    @property
    def piece(self) -> Input:
        return self.asked._replace(edits=(*self.asked.edits, (self.edit, self.given)))


@dataclass
class Callback:
    """Something that may be called at any time, and what it read when it was called last."""

    call: Callable[[], object]
    guards: tuple[Guard, ...]
    reads: Written | None = None


class Result(NamedTuple):
    """What a call read, wrote, made and gave."""

    value: Value
    reads: Written
    written: Written
    made: list[Obj]
    ended: bool


class Machine:
    """The state of one run."""

    def __init__(self) -> None:
        self.store = CellStore()
        self.findings = Findings()
        self.steps = 0
        self.turns = 1  # of known loops inside each other, at the present point
        self.forks = 0  # how many undecided branches and loops surround the present point
        self.guards: tuple[Guard, ...] = ()
        self.context: object = None
        self.ended = False  # what was evaluated last never comes back
        self.settling = False
        self.widening = False  # callbacks did not come to an end in some rounds
        self.has_inputs = False  # something of a parameter, option or variable was asked for
        self.asks_launch = False  # what it holds may decide more than names
        self.callbacks: dict[object, Callback] = {}
        self.cost: dict[object, int] = {}  # steps that all runs of some code took
        self.makers: set[object] = set()  # code that made an interface, itself or by a call
        self._contexts: dict[object, dict[object, int]] = {}
        self._objects: dict[tuple[object, object, str], Obj] = {}
        self._active: list[tuple[object, object]] = []
        self._made: list[Obj] = []  # in the order in which they were made or made again
        self._results: dict[object, Result] = {}

    def step(self, count: int = 1) -> None:
        """Count steps. Raises ``StepLimitExceeded``."""
        self.steps += count
        if self.steps + self.store.work // 16 > MAX_STEPS:
            raise StepLimitExceeded

    # --- branches and loops ---------------------------------------------------------------------------------

    def branch(self, sides: Sequence[Side]) -> int:
        """Run each side from the present state and join what those leave that go on."""
        outcomes: list[Written] = []
        ways = 0
        self.asks_launch = self.asks_launch or self.has_inputs
        self.forks += 1
        for side in sides:
            mark = self.store.mark()
            taken = side()
            ways |= taken
            if taken & NEXT:
                outcomes.append(self.store.written(mark))
                self.store.undo(mark)
            else:
                self.store.leave(mark)
        self.forks -= 1
        self.store.merge(outcomes)
        self.step()
        return ways

    def jump(self, jumps: Jumps) -> None:
        """Leave the call or loop of ``jumps`` from here."""
        jumps.exits.append(self.store.written(jumps.mark))

    def next_turn(self, jumps: Jumps) -> None:
        """Go on with the next turn of the loop of ``jumps``."""
        jumps.next_turns.append(self.store.written(jumps.turn))

    def land(self, mark: int, exits: list[Written], goes_on: bool) -> None:
        """Join the ways that meet here: early ones, and the present state if control ``goes_on``."""
        if not exits:
            return
        if goes_on:
            exits = [*exits, self.store.written(mark)]
            self.store.undo(mark)
        else:
            self.store.leave(mark)
        self.store.merge(exits)

    def turn(self, jumps: Jumps, body: Side) -> int:
        """Run one turn of a loop."""
        self.step()
        jumps.turn = self.store.mark()
        jumps.next_turns = []
        guards = self.guards
        ways = body()
        self.guards = guards
        self.land(jumps.turn, jumps.next_turns, bool(ways & NEXT))
        if jumps.next_turns:
            ways |= NEXT
        return ways & ~CONTINUE

    def each_element(self, count: int, jumps: Jumps, body: Callable[[int], int]) -> int:
        """Run ``body`` once for each of ``count`` known elements, each in a context of its own."""
        ways = 0
        outer, turns = self.context, self.turns
        self.turns *= max(count, 1)
        for index in range(count):
            self.context = self._context_of(outer, index)
            taken = self.turn(jumps, partial(body, index))
            self.context = outer
            ways |= taken & ~NEXT
            if not taken & NEXT:
                break
        else:
            ways |= NEXT
        self.turns = turns
        return ways

    def repeat(self, jumps: Jumps, body: Side) -> int:
        """Run ``body`` any number of times, until one more turn adds nothing."""
        ways = 0
        self.asks_launch = self.asks_launch or self.has_inputs
        self.forks += 1
        for number in range(MAX_TURNS):
            mark = self.store.mark()
            taken = self.turn(jumps, body)
            ways |= taken
            if not taken & NEXT:
                self.store.leave(mark)
                break
            if self.store.join_head(mark, number):
                break
        self.forks -= 1
        return ways | NEXT

    # --- calls and objects ----------------------------------------------------------------------------------

    def in_context(
        self,
        code: object,
        receiver: object,
        key: object,
        arguments: object,
        body: Callable[[], Value],
        nested: int = 4,
    ) -> Value | None:
        """Run ``body`` in the context ``key``; ``None`` if ``code`` runs ``nested`` times already.

        Args:
            receiver: Tells contexts apart where there are too many keys.
            arguments: All that ``body`` gets. A call with equal ones is not run again while what it read is as it was.
        """
        known = self._contexts.setdefault(code, {})
        if key not in known and len(known) >= MAX_CONTEXTS:
            key = ("receiver", receiver)
        if len(self._active) >= MAX_DEPTH or (code, key) in self._active:
            return None
        if sum(running is code for running, _ in self._active) >= nested:
            return None
        self.step()
        call = (code, key, arguments, self.guards)
        known_result = self._results.get(call)
        if known_result is not None and self.as_it_was(known_result.reads):
            return self._again(known_result)
        outer, self.context = self.context, self._context_of(code, key)
        self._active.append((code, key))
        reads, self.store.reads = self.store.reads, {}
        mark, made, steps = self.store.mark(), len(self._made), self.steps
        try:
            value = body()
            own, written = self.store.reads, self.store.written(mark)
            if len(written) <= MAX_REPLAYED:
                self._results[call] = Result(value, own, written, self._made[made:], self.ended)
            return value
        finally:
            self.cost[code] = self.cost.get(code, 0) + self.steps - steps
            inner, self.store.reads = self.store.reads or {}, reads
            self.store.work += len(inner)
            for read in inner.values():
                self.store.note(read)
            self._active.pop()
            self.context = outer

    def is_new(self, code: object, key: object) -> bool:
        """Return whether ``code`` did not run in the context ``key`` yet."""
        return key not in self._contexts.get(code, {})

    def as_it_was(self, reads: Written) -> bool:
        """Return whether all that was read holds what it held then."""
        self.store.work += len(reads)
        return all(same(cells.get(key, ()), value) for cells, key, value in reads.values())

    def _again(self, known: Result) -> Value:
        """Repeat a call whose inputs are as they were: its writes, and what it makes, which now stands for several."""
        for cells, key, value in known.written.values():
            if isinstance(cells, LocalCells) and cells.reads is known.reads:
                cells.reads = self.store.reads  # its own variables, which a closure keeps
            self.store.write(cells, key, value)
        for obj in known.made:
            obj.summary = True
        for read in known.reads.values():
            self.store.note(read)
        self.store.work += len(known.reads) + len(known.written)
        self.ended = known.ended
        return known.value

    def _context_of(self, code: object, key: object) -> tuple[object, int]:
        known = self._contexts.setdefault(code, {})
        return code, known.setdefault(key, len(known))

    def allocate(self, place: object, kind: str, cls: object = None, tag: str = "") -> Obj:
        """Return the object made at ``place`` in this context; made again, it stands for all of them."""
        key = (self.context, place, tag or kind)
        found = self._objects.get(key)
        if found is None:
            found = self._objects[key] = Obj(kind, cls)
            found.place = place
            found.guards = self.guards
            self._made.append(found)
        else:
            self._made.append(found)
            found.summary = True
            if found.guards != self.guards:
                found.guards = ()
        return found

    # --- callbacks ------------------------------------------------------------------------------------------

    def later(self, identity: object, call: Callable[[], object]) -> None:
        """Note that ``call`` may be made at any time from now on."""
        self.callbacks.setdefault(identity, Callback(call, self.guards))

    def settle(self, at_end: bool = True) -> None:
        """Make all calls of ``later``, in any order, until nothing changes; where a program waits, once."""
        if self.settling:
            return
        self.settling = True
        kept, self.guards = self.guards, ()
        for number in range(MAX_ROUNDS if at_end else 2):
            changed: list[CellId] = []
            known = len(self.callbacks)
            for callback in list(self.callbacks.values()):
                if callback.reads is None or not self.as_it_was(callback.reads):
                    self.widening = number >= WIDEN_FROM
                    changed += self._called(callback)
            if not changed and len(self.callbacks) == known:
                break
        else:
            if at_end:
                self.unsettled()
        self.guards = kept
        self.settling = self.widening = False

    def unsettled(self) -> None:
        """Say that the callbacks do not come to an end."""

    def _called(self, callback: Callback) -> list[CellId]:
        outer_reads, self.store.reads = self.store.reads, {}
        self.guards = callback.guards
        mark = self.store.mark()
        self.forks += 1
        callback.call()
        self.forks -= 1
        outcome = self.store.written(mark)
        self.store.undo(mark)
        callback.reads, self.store.reads = self.store.reads, None
        changed = self.store.absorb(outcome, self.widening)
        self.store.reads = outer_reads
        for read in callback.reads.values():
            self.store.note(read)
        return changed

    # --- findings -------------------------------------------------------------------------------------------

    @contextmanager
    def under(self, *guards: Guard | None) -> Iterator[None]:
        """Let conditions hold meanwhile."""
        kept = self.guards
        self.guards = (*kept, *(each for each in guards if each is not None and each not in kept))
        yield
        self.guards = kept

    def endpoint(
        self,
        node: FoundNode,
        kind: EndpointKind,
        name: object,
        type_name: str,
        source: SourceLocation,
        qos: QosPolicies = (),
    ) -> FoundEndpoint:
        """Add an interface to ``node``, under the conditions that hold here."""
        conditions = [each.piece for each in self.guards if each.asked.owner in (node, self.findings.options)]
        if conditions and isinstance(name, (str, Text)):
            pieces = pieces_of(name) if name else ()
            name = text_of((*(each for each in dict.fromkeys(conditions) if each not in pieces), *pieces))
        found = FoundEndpoint(kind, name, type_name, source, qos)
        self.makers.update(code for code, _ in self._active)
        node.endpoints.setdefault(found)
        return found

    def gap(self, source: SourceLocation, why: str) -> None:
        """Note what stays unknown, by its cause."""
        self.findings.gaps.add(source, why)
