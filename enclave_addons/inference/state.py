"""The abstract store: every variable, field and element is a cell; writes leave a trail.

The trail makes branches cheap: both sides run on the same cells, what each wrote is undone and then
joined. Undone entries stay in the trail on purpose, so that ``join_seen`` can tell every value that a cell
held since a mark; that is the state an exception handler, or the end of a function with early returns,
may meet. ``stamp`` names the state: equal stamps, equal contents.
"""

from __future__ import annotations

import ast
import itertools
import sys
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from enclave_addons.inference.values import (
    ABSENT,
    ANY,
    BOTTOM,
    BUILTINS,
    ITEMS,
    OTHER,
    OTHER_KEYS,
    Cells,
    ContentCells,
    Dictionary,
    FieldCells,
    FixedCells,
    HeapObject,
    Items,
    Key,
    LocalCells,
    ModuleCells,
    Sequence,
    Value,
    contains,
    external,
    join,
    mixed_with_unknown,
    unsettled,
    widen,
)

Alternative = Callable[[], bool]  # runs one branch; tells whether its end can be reached
Written = dict[tuple[int, object], tuple[Cells, object, Value]]  # by cell: its value at the end of a branch


class ProgramState:
    """The trail of all writes of one run, by which branches are undone and joined."""

    def __init__(self) -> None:
        self._trail: list[tuple[Cells, object, Value | None]] = []
        self.stamp = 0  # of the latest write; a branch that is undone takes it back
        self._stamps = itertools.count(1)
        self.learned = 0  # containers opened to foreign code, which no branch takes back
        # Stamps of the latest writes that stay, and of those taken back, the last one at the end: by name of a global
        # or field, and by ``id`` of the cells of a container or of a function whose variables inner functions share.
        self.changed: dict[str | int, int] = {}
        # What code that runs at any time changes, too: variables by name, containers by where they are made.
        self.changed_meanwhile: set[str | int] = set()
        self.base = sys.maxsize  # how many undecided branches surround a write that stays
        # Cells of objects made by the running callback: no other one has read them.
        self.fresh: set[int] = set()
        self.work = 0  # trail entries looked at
        self.depth = 0  # how many branches or loops surround the current point
        self.forks = 0  # how many of them are undecided: what happens there may not happen

    def write(self, cells: Cells, key: object, value: Value, local: bool = False) -> None:
        """Update strongly. ``local``: only the running function can see the cell (no new stamp)."""
        own = type(cells) is FixedCells or (type(cells) is LocalCells and not cells.shared)
        if key in self.changed_meanwhile and not own:
            value = unsettled(value)
        old = cells.get(key)
        if old is value or (old is not None and _same(old, value)):
            return
        self._trail.append((cells, key, old))
        cells[key] = value
        if not local:
            self.stamp = next(self._stamps)
            if self.forks <= self.base:
                self._note_write(cells, key)

    def store(self, obj: HeapObject, key: object, value: Value) -> None:
        """Write to an object: strong if it is one concrete object, else weak."""
        if obj.summary:
            value = join(obj.cells.get(key, BOTTOM), value)
        self.write(obj.cells, key, value)

    def touch(self, obj: HeapObject, key: object) -> None:
        """Note a write to an object that may leave what is known of the cell as it is."""
        self._trail.append((obj.cells, key, obj.cells[key]))

    def open(self, obj: HeapObject) -> None:
        """Note that code which is not analysed got a container; no branch takes that back."""
        obj.escaped = True
        self.learned += 1
        if id(obj.cells) not in self.fresh:
            self._note_change(id(obj.cells))

    def _note_write(self, cells: Cells, key: object) -> None:
        if id(cells) not in self.fresh:
            by_name = isinstance(key, str) and key != ITEMS and type(cells) not in (ContentCells, LocalCells)
            self._note_change(str(key) if by_name else id(cells))

    def _note_change(self, key: str | int) -> None:
        self.changed.pop(key, None)
        self.changed[key] = next(self._stamps)

    def forget(self) -> None:
        """Drop the trail; only between top-level steps, when nobody holds a mark."""
        self._trail.clear()

    def version(self) -> tuple[int, int]:
        """Return the version: equal versions, equal state."""
        return self.stamp, self.learned

    def now(self) -> int:
        """Return a stamp for ``changes``: unlike ``stamp``, no branch takes it back."""
        return next(self._stamps)

    def changes(self, since: int) -> set[str | int]:
        """Return what was written or undone after ``since``, as in ``changed``."""
        later = itertools.takewhile(lambda each: each[1] > since, reversed(self.changed.items()))
        return {key for key, _ in later}

    def mark(self) -> int:
        return len(self._trail)

    def branches(
        self, alternatives: Iterable[Alternative], joined: Callable[[Value, Value], Value] | None = None
    ) -> bool:
        """Run each alternative from the present state and join what they leave. False: none falls through.

        ``joined``: what a cell holds where both of two alternatives fall through.
        """
        outcomes = self._run_each(alternatives)
        if joined and len(outcomes) == 2:
            first, second = outcomes
            for place, (cells, key, _) in {**first, **second}.items():
                before = (cells, key, cells.get(key, _absent(cells, key)))
                value = joined(first.get(place, before)[2], second.get(place, before)[2])
                first[place] = second[place] = cells, key, value
        if outcomes:
            self._merge(outcomes)
        return bool(outcomes)

    def maybe(self, action: Alternative) -> None:
        """Run ``action`` as something that may happen or not."""
        self.branches((action, lambda: True))

    def each(self, alternatives: Iterable[Callable[[], Value]]) -> list[Value]:
        """Return what each of ``alternatives`` gives, run as ``branches`` of which every one falls through."""
        given: list[Value] = []

        def noted(make: Callable[[], Value]) -> Alternative:
            def run() -> bool:
                given.append(make())
                return True

            return run

        self.branches([noted(make) for make in alternatives])
        return given

    def perhaps(self, make: Callable[[], Value]) -> Value:
        """Return what ``make`` gives, run as something that may happen or not."""
        given: list[Value] = []

        def run() -> bool:
            given.append(make())
            return True

        self.maybe(run)
        return given[0]

    def repeatedly(self, action: Alternative, widen_texts: bool) -> list[Written]:
        """Run ``maybe`` as one step towards a fixpoint: what keeps growing is widened. Return what it wrote."""
        outcomes = self._run_each((action,))
        self.written_again(outcomes, widen_texts)
        return outcomes

    def written_again(self, outcomes: list[Written], widen_texts: bool) -> None:
        """Join with the state what a step wrote that may happen at this point, too."""
        for outcome in outcomes:
            self.work += len(outcome)
            for cells, key, value in outcome.values():
                before = cells.get(key)
                if before is None:
                    self.write(cells, key, join(_absent(cells, key), value))
                else:
                    self.write(cells, key, widen(before, value, widen_texts))

    def _run_each(self, alternatives: Iterable[Alternative]) -> list[Written]:
        stamp = self.stamp
        outcomes: list[Written] = []
        self.depth += 1
        self.forks += 1
        for alternative in alternatives:
            mark = len(self._trail)
            if alternative():
                outcomes.append(self.written(mark))
                self._undo(mark)
            else:
                self._leave(mark)
            self.stamp = stamp
        self.depth -= 1
        self.forks -= 1
        return outcomes

    def aside(self, prepare: Callable[[], object], action: Alternative) -> None:
        """Run ``action`` in the state that ``prepare`` makes of the present one.

        Afterwards each cell holds what it held before, or what ``action`` wrote there.
        """
        stamp, start = self.stamp, self.mark()
        prepare()
        inner = self.mark()
        self.depth += 1
        self.forks += 1
        action()
        outcome = self.written(inner)
        self._undo(start)
        self.depth -= 1
        self.forks -= 1
        self.stamp = stamp
        self._merge([outcome, {}])

    def join_seen(self, mark: int, own: Cells | None = None, mixed: bool = False) -> None:
        """Give each cell written since ``mark`` (except in ``own``) every value it held since then.

        ``mixed``: which of them is meant depends on when other code runs, see ``mixed_with_unknown``.
        """
        for cells, key, value in self.seen(mark, own).values():
            if mixed:
                value = mixed_with_unknown(value)
            if value:
                self.write(cells, key, value)

    def seen(self, mark: int, own: Cells | None = None) -> Written:
        """Return every value that each cell written since ``mark`` (except in ``own``) held since then."""
        seen: Written = {}
        self.work += len(self._trail) - mark
        for cells, key, old in self._trail[mark:]:
            if cells is own or (type(cells) is LocalCells and cells.dead):
                continue
            place = (id(cells), key)
            entry = seen.get(place)
            if entry is None:
                entry = (cells, key, cells.get(key, BOTTOM))
            entry = (cells, key, join(entry[2], _absent(cells, key) if old is None else old))
            seen[place] = entry
        return seen

    def changed_since(self, mark: int) -> bool:
        """Return True if a cell held something since ``mark`` that it does not hold now; None does not count."""
        return any(
            not contains(cells.get(key, BOTTOM), atom)
            for cells, key, old in self._trail[mark:]
            if type(cells) is not LocalCells or not cells.dead
            for atom in old or ()
            if atom is not None and atom is not ABSENT[0]
        )

    def join_head(self, mark: int, widen_texts: bool) -> bool:
        """End of one turn of a loop: join with the state at ``mark``. True: nothing new, a fixpoint."""
        stable = True
        first: dict[tuple[int, object], tuple[Cells, object, Value | None]] = {}
        for cells, key, old in self._trail[mark:]:
            if type(cells) is not LocalCells or not cells.dead:
                first.setdefault((id(cells), key), (cells, key, old))
        for cells, key, old in first.values():
            current = cells.get(key)
            if current is None:
                current = BOTTOM
            if old is None:
                stable = stable and not current
                self.write(cells, key, join(current, _absent(cells, key)))
                continue
            joined = widen(old, current, widen_texts)
            if joined is not old and joined != old:
                stable = False
            self.write(cells, key, joined)
        return stable

    def unsettle(self, mark: int) -> None:
        """Forget the texts, numbers and truths that cells got since ``mark``; containers may hold anything else."""
        for cells, key, value in self.written(mark).values():
            self.write(cells, key, unsettled(value))
            if isinstance(key, Key):
                self.write(cells, OTHER, join(cells.get(OTHER, BOTTOM), ANY))
                self.write(cells, OTHER_KEYS, join(cells.get(OTHER_KEYS, BOTTOM), ANY))

    def written(self, mark: int) -> Written:
        """Return each cell written since ``mark`` as it is now."""
        self.work += len(self._trail) - mark
        return {
            (id(cells), key): (cells, key, cells[key])
            for cells, key, _ in self._trail[mark:]
            if key in cells and (type(cells) is not LocalCells or not cells.dead)
        }

    def _undo(self, mark: int) -> None:
        """Take back what was written since ``mark``: a callback that ran meanwhile found something else."""
        stays = self.forks <= self.base
        for cells, key, old in reversed(self._trail[mark:]):
            if old is None:
                cells.pop(key, None)
            else:
                cells[key] = old
            if stays and (type(cells) is not LocalCells or cells.shared):
                self._note_write(cells, key)

    def _leave(self, mark: int) -> None:
        """Undo a branch that ends in a jump. Its values stay on the trail for ``join_seen`` where the jump leads."""
        left = {(id(cells), key): (cells, key) for cells, key, _ in self._trail[mark:]}
        held = [(cells, key, cells[key]) for cells, key in left.values() if key in cells]
        self._undo(mark)
        self._trail += held

    def _merge(self, outcomes: list[Written]) -> None:
        places = outcomes[0] if len(outcomes) == 1 else {k: v for found in outcomes for k, v in found.items()}
        for place, (cells, key, _) in places.items():
            before = cells.get(key)
            if before is None:
                before = _absent(cells, key)
            partial = any(place not in outcome for outcome in outcomes)
            value: Value = before if partial else BOTTOM
            for outcome in outcomes:
                if place in outcome:
                    value = join(value, outcome[place][2])
            self.write(cells, key, value, type(cells) is LocalCells and not cells.shared)


def _same(old: Value, new: Value) -> bool:
    """Return whether they are equal as sets of atoms."""
    if len(old) != len(new):
        return False
    if len(new) == 1:
        return type(old[0]) is type(new[0]) and old[0] == new[0]
    return all(contains(old, atom) for atom in new)


def _absent(cells: Cells, key: object) -> Value:
    """Return what a cell that was never written holds: a field may then be found in the class."""
    if type(cells) is ModuleCells and key in BUILTINS:
        return external(f"builtins.{key}")
    return ABSENT if isinstance(cells, FieldCells) else BOTTOM


Made = TypeVar("Made", bound=HeapObject)


class Allocations:
    """What stands for the objects of a run, by where they are made; ``context`` tells calls of one function apart."""

    def __init__(self, state: ProgramState) -> None:
        self.state = state
        self.context = 0
        self._contexts: dict[tuple[int, object], int] = {}
        self._context_ids = itertools.count(1)
        self._tuples: dict[object, Value] = {}
        self.captured_cells: dict[tuple[object, ...], LocalCells] = {}
        self._allocated: dict[tuple[int, int, str], Any] = {}
        self.born: list[HeapObject] = []  # since the running callback began

    def enter(self, key: object) -> int:
        """Go into the calling context ``key``; returns the context to go back to."""
        previous = self.context
        place = (previous, key)
        inner = self._contexts.get(place)
        if inner is None:
            inner = self._contexts[place] = next(self._context_ids)
        self.context = inner
        return previous

    def allocate(self, node: ast.AST, kind: str, make: Callable[[], Made]) -> Made:
        """Return the object made at ``node`` in this calling context; made twice it stands for all of them."""
        key = (self.context, id(node), kind)
        found: Made | None = self._allocated.get(key)
        if found is None:
            found = self._allocated[key] = make()
            self.born.append(found)
            self.state.fresh.add(id(found.cells))
            if id(node) in self.state.changed_meanwhile and isinstance(found, (Sequence, Dictionary)):
                self.state.open(found)
        else:
            found.summary = True  # what was stored before is still there: weak updates only add to it
        return found

    def made_at(self, cells: Cells) -> set[int]:
        """Return where the object with these cells is made."""
        return {place for (_, place, _), made in self._allocated.items() if made.cells is cells}

    def tuple_of(self, parts: tuple[Value, ...]) -> Value:
        """Return a tuple; it never changes, so equal ones are one object and need no allocation site."""
        key = (parts, tuple(type(part[0]) if part else None for part in parts))
        found = self._tuples.get(key)
        if found is None:
            found = self._tuples[key] = (Sequence("tuple", Items(parts)),)
        return found

    def sequence(self, node: ast.AST, kind: str, items: Items, key: str = "") -> Value:
        """Return a sequence made at ``node``; ``key`` tells several of a kind apart."""
        if kind == "tuple" and items.exact is not None:
            return self.tuple_of(items.exact)
        obj = self.allocate(node, key or kind, lambda: Sequence(kind, items))
        if obj.summary:
            self.state.store(obj, "[items]", (items,))
        return (obj,)
