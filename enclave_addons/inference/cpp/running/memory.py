"""What a run holds and remembers: cells with a trail of what was written, so that branches are run, undone and joined;
calls that were run before, whose outcome is the same where all that they read is as it was. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple, TypeVar

from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Noted,
    NoteLog,
    Obj,
    Value,
    add_note,
    bounded,
    hold,
    holds_callable,
    join,
    join_in_doubt,
    lost,
    notes_read,
)

MEMORY_DEPTH = 20
"""Paths of calls are whole up to this depth (``Frame.path``): then the same path means the same callers."""
Cell = tuple[object, str]
Changes = dict[Cell, Value]
Held = TypeVar("Held")
_ABSENT: Value = (("absent",),)
_LOOKED_AT_IN_A_STEP = 64


class Reads(NamedTuple):
    """What some code read: cells with the values that they had before, and notes."""

    cells: Changes
    noted: Noted


class AbstractStore:
    """What every cell holds now; writes can be undone and joined, reads watched."""

    def __init__(self, spend: Callable[[int], None] = lambda steps: None) -> None:
        """``spend`` gets the steps that long searches of the trail count for; what it raises ends the run."""
        self._spend = spend
        self._cells: dict[Cell, Value] = {}
        self._by_name: dict[str, dict[Cell, None]] = {}
        # Variables that ever held a function or closure, by their names.
        self.callables: dict[str, dict[Cell, None]] = {}
        self._trail: list[tuple[Cell, Value, int]] = []  # what was there before, and since when
        self._since: dict[Cell, int] = {}  # the place in the trail where a cell was written last
        self._reads: set[Cell] | None = None
        self._watched_from = 0
        self._history: Changes | None = None
        self._held: dict[Cell, Value | None] | None = None
        # Variables that others may write to at any time: what is left of a value that is written to them.
        self._shared: dict[Cell, Callable[[Value], Value]] = {}
        self.log = NoteLog()

    def get(self, cell: Cell) -> Value | None:
        self._read(cell, self._since.get(cell, -1))
        return self._cells.get(cell)

    def _read(self, cell: Cell, since: int) -> None:
        """Note that the value is read which the cell has since then, unless who watches wrote it."""
        if self._reads is not None and since < self._watched_from:
            self._reads.add(cell)

    def watched(self, action: Callable[[], None]) -> Reads:
        """Run ``action``; what it read and did not write itself before. Who watches the caller learns of it, too."""
        outer, outer_noted, outer_from = self._reads, self.log.noted, self._watched_from
        mark = len(self._trail)
        self._reads, self.log.noted, self._watched_from = set(), {}, mark
        try:
            action()
        finally:
            read, noted = self._reads, self.log.noted
            self._reads, self.log.noted, self._watched_from = outer, outer_noted, outer_from
            before = {cell: (old, since) for cell, old, since in reversed(self._trail[mark:])}
            kept = {}
            for cell in read:
                value, since = before.get(cell) or (self._cells.get(cell, _ABSENT), self._since.get(cell, -1))
                self._read(cell, since)
                if value is not _ABSENT or not _is_new(cell):
                    kept[cell] = value
            if self.log.noted is not None:
                for key, said in noted.items():
                    add_note(self.log.noted, key, said)
        return Reads(kept, notes_read(noted))

    def saw(self, reads: Reads) -> None:
        """Tell who watches that all this was read."""
        if self._reads is not None and self.log.noted is not None:
            for cell in reads.cells:
                self._read(cell, self._since.get(cell, -1))
            for key, said in reads.noted.items():
                add_note(self.log.noted, key, said)

    def holds(self, reads: Reads, *, in_any_order: bool = False) -> bool:
        """Return whether all this says what it said; ``in_any_order``: alternatives may have changed places."""
        get = self._cells.get
        for cell, value in reads.cells.items():
            present = get(cell, _ABSENT)
            if present is value or present == value:
                continue
            if not in_any_order or set(present) != set(value):
                return False
        return hold(reads.noted)

    def set(self, cell: Cell, value: Value) -> None:
        old = self._cells.get(cell, _ABSENT)
        if old is not value:
            value = bounded(value)
            if cell in self._shared:
                value = self._shared[cell](value)
            if old is _ABSENT and not _is_of_a_call(cell):
                self._by_name.setdefault(name_of(cell), {})[cell] = None
            if any(map(holds_callable, value)):
                self.callables.setdefault(name_of(cell), {})[cell] = None
            self._trail.append((cell, old, self._since.get(cell, -1)))
            self._since[cell] = len(self._trail) - 1
            self._cells[cell] = value
            if self._history is not None:
                self._remember(cell, value)
            if self._held is not None:
                self._hold(cell, None if old is _ABSENT else join(old, value))

    def share(self, action: Callable[[], None], left: Callable[[Value], Value]) -> None:
        """Run what writes to a variable; of whatever is written to it from then on, only ``left`` of it is known."""
        mark = len(self._trail)
        action()
        for cell in dict.fromkeys(cell for cell, _, _ in self._trail[mark:]):
            self.share_cell(cell, left)

    def share_cell(self, cell: Cell, left: Callable[[Value], Value]) -> None:
        """Know of the value of ``cell`` only what is ``left`` of it, from now on."""
        self._shared[cell] = left
        self.set(cell, left(self._cells.get(cell, BOTTOM)))

    def lose(self, cells: Iterable[Cell], why: str) -> None:
        """Know nothing of the texts and numbers that these variables hold now."""
        for cell in cells:
            self.set(cell, lost(self.get(cell) or BOTTOM, why))

    def everything(self) -> list[Cell]:
        """Return all variables that hold something."""
        return [cell for cell in self._cells if not _is_over(cell)]

    def named(self, name: str) -> list[Cell]:
        """Return the members, globals and static members of that name that were ever set."""
        return list(self._by_name.get(name, ()))

    def held_during(self, action: Callable[[], Held]) -> tuple[Held, Changes]:
        """Run ``action``; what it gives, and every value that cells held meanwhile which were there before."""
        outer, self._held = self._held, {}
        try:
            given = action()
        finally:
            held, self._held = self._held, outer
            for cell, value in held.items() if outer is not None else ():
                self._hold(cell, value)
        return given, {cell: value for cell, value in held.items() if value is not None}

    def _hold(self, cell: Cell, value: Value | None) -> None:
        """``None``: the cell is new, and so nothing that an exception leaves behind."""
        assert self._held is not None
        before = self._held.setdefault(cell, value)
        if before is not None and value is not None and before is not value:
            self._held[cell] = join(before, value)

    def others_run(self) -> None:
        """Expect from now on that others run at any time: they find all values that cells have from here on."""
        if self._history is None:
            self._history = dict(self._cells)

    def _remember(self, cell: Cell, value: Value) -> None:
        assert self._history is not None
        before = self._history.get(cell, value)
        self._history[cell] = before if before is value else join(before, value)

    def as_others_find_it(self) -> None:
        """Continue with what a callback may find that ran while the program still changed its variables."""
        history, self._history = self._history or {}, None
        for cell, value in history.items():
            present = self._cells.get(cell)
            if present is not None and not _is_over(cell) and set(value) - set(present):
                self.set(cell, join(present, value))

    def mark(self) -> int:
        return len(self._trail)

    def changes(self, mark: int) -> Changes:
        """Return what was written since ``mark``, as it is now."""
        self._spend((len(self._trail) - mark) // _LOOKED_AT_IN_A_STEP)
        cells = self._cells
        return {
            cell: cells[cell] for cell, _, _ in self._trail[mark:] if cell in cells and not _is_over(cell)
        }

    def before(self, mark: int) -> Changes:
        """Return the values at ``mark`` of all cells that were written since."""
        found: Changes = {}
        for cell, old, _ in self._trail[mark:]:
            found.setdefault(cell, BOTTOM if old is _ABSENT else old)
        return found

    def undo(self, mark: int) -> None:
        undone = dict.fromkeys(cell for cell, _, _ in self._trail[mark:]) if self._history is not None else ()
        while len(self._trail) > mark:
            cell, old, self._since[cell] = self._trail.pop()
            if old is _ABSENT:
                self._cells.pop(cell, None)
            else:
                self._cells[cell] = old
        for cell in undone:
            if cell in self._cells:
                self._remember(cell, self._cells[cell])

    def merge(self, alternatives: Sequence[Changes], doubt: str = "") -> None:
        """Continue with any of ``alternatives``, each made from the present state.

        ``doubt``: why it is not known which of them it is, where C++ decides it.
        """
        for cell in dict.fromkeys(cell for changes in alternatives for cell in changes):
            present = self._cells.get(cell, BOTTOM)
            if any(cell not in changes for changes in alternatives):
                self._read(cell, self._since.get(cell, -1))
            values = [changes.get(cell, present) for changes in alternatives]
            self.set(cell, join_in_doubt(values, doubt) if doubt else join(*values))


def name_of(cell: Cell) -> str:
    """Return the name of a variable; that of a global stands in its owner."""
    return cell[1] or str(getattr(cell[0], "name", ""))


def _is_over(cell: Cell) -> bool:
    """Return whether it is a variable of a call that nobody can see any more."""
    return bool(getattr(cell[0], "finished", False))


def _is_of_a_call(cell: Cell) -> bool:
    """Return whether it is a variable of a call, which is gone after it: not one that is ``static``."""
    return not getattr(cell[0], "lasts", True)


def _is_new(cell: Cell) -> bool:
    """Return whether nobody sees a cell before it is set: a variable of a call, a member of an object.

    Who reads a member of an object that was not there before has read before who holds it.
    """
    return isinstance(cell[0], Obj) or _is_of_a_call(cell)


class CallOutcome(NamedTuple):
    """``parameters``: what the function leaves in them, ``meanwhile`` what they held before, which an exception may
    leave; ``ends``: it never comes back."""

    returned: Value
    parameters: dict[str, Value | None]
    meanwhile: dict[str, Value]
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
        """Return the outcome of the last run, if ``given`` and all that it read is as it was; and its steps."""
        kept = self._kept.get(key)
        if kept is not None and kept.given == given and self._store.holds(kept.reads):
            self._store.saw(kept.reads)
            for cell, value in kept.changes.items():
                self._store.set(cell, value)
            return kept.outcome, kept.steps
        return None

    def keep(self, key: object, given: object, action: Callable[[], tuple[CallOutcome, int]]) -> CallOutcome:
        """Remember the outcome of ``action``, which takes so many steps."""
        found: list[tuple[CallOutcome, int]] = []
        mark = self._store.mark()
        reads = self._store.watched(lambda: found.append(action()))
        ((outcome, steps),) = found
        self._kept[key] = _Kept(given, steps, reads, self._store.changes(mark), outcome)
        return outcome
