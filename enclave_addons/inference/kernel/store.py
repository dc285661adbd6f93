"""The store: every variable, field and element is a cell, and each write leaves an entry in a trail.

By the trail both sides of a branch run on the same cells: what each side wrote is undone, and then joined. The values
of a side that ends in an error stay in the trail as well, for whoever catches the error.
"""

from __future__ import annotations

from collections.abc import Iterable

from enclave_addons.inference.kernel.values import (
    ABSENT,
    ANY,
    BOTTOM,
    Cells,
    LocalCells,
    Obj,
    Value,
    contains,
    join,
    widen,
)

CellId = tuple[int, object]
Written = dict[CellId, tuple[Cells, object, Value]]
"""What a piece of program wrote: the latest value of each cell."""


class CellStore:
    """The trail of one run. ``reads`` collects which cells are read, with what they held, while it is a mapping."""

    def __init__(self) -> None:
        self.trail: list[tuple[Cells, object, Value | None]] = []
        self.reads: Written | None = None
        self.work = 0  # entries of the trail that were looked at

    def read(self, cells: Cells, key: object, default: Value = BOTTOM) -> Value:
        """Return what a cell holds."""
        value = cells.get(key, default)
        if self.reads is not None and (id(cells), key) not in self.reads:
            self.note((cells, key, cells.get(key, BOTTOM)))
        return value

    def note(self, read: tuple[Cells, object, Value]) -> None:
        """Note that a cell was read, unless it is a variable of the call that reads."""
        cells, key, _ = read
        if self.reads is not None and not (type(cells) is LocalCells and cells.reads is self.reads):
            self.reads.setdefault((id(cells), key), read)

    def write(self, cells: Cells, key: object, value: Value) -> bool:
        """Replace what a cell holds; return whether that changed it."""
        old = cells.get(key)
        if self.reads is not None and (id(cells), key) not in self.reads:
            self.note((cells, key, BOTTOM if old is None else old))
        if old is not None and (old is value or same(old, value)):
            return False
        self.trail.append((cells, key, old))
        cells[key] = value
        return True

    def store(self, obj: Obj, key: object, value: Value) -> None:
        """Write to an object: replace if it is one object, else add."""
        if obj.summary:
            value = join(obj.cells.get(key, BOTTOM), value)
        self.write(obj.cells, key, value)

    def mark(self) -> int:
        """Return the present end of the trail, for ``written``, ``undo`` and ``seen``."""
        return len(self.trail)

    def written(self, mark: int) -> Written:
        """Return each cell that was written since ``mark``, as it is now."""
        self.work += len(self.trail) - mark
        return {
            (id(cells), key): (cells, key, cells[key])
            for cells, key, _ in self.trail[mark:]
            if key in cells and not (type(cells) is LocalCells and cells.dead)
        }

    def undo(self, mark: int) -> None:
        """Take back what was written since ``mark``."""
        for cells, key, old in reversed(self.trail[mark:]):
            if old is None:
                cells.pop(key, None)
            else:
                cells[key] = old
        del self.trail[mark:]

    def leave(self, mark: int) -> None:
        """Undo a side that ends in a jump. What it held stays in the trail for ``join_seen``."""
        held = self.seen(mark)
        self.undo(mark)
        self.keep(held)

    def keep(self, seen: Written) -> None:
        """Keep values in the trail that a side held which does not go on."""
        for cells, key, value in seen.values():
            self.trail += [(cells, key, cells.get(key)), (cells, key, value)]

    def seen(self, mark: int) -> Written:
        """Return every value that each cell held since ``mark``."""
        found: Written = {}
        self.work += len(self.trail) - mark
        for cells, key, old in self.trail[mark:]:
            if type(cells) is LocalCells and cells.dead:
                continue
            now = found[id(cells), key][2] if (id(cells), key) in found else cells.get(key, BOTTOM)
            found[id(cells), key] = cells, key, join(now, _absent(cells) if old is None else old)
        return found

    def join_seen(self, mark: int) -> None:
        """Let each cell hold any value that it held since ``mark``: an error may have come at any time."""
        for cells, key, value in self.seen(mark).values():
            self.write(cells, key, value)

    def merge(self, outcomes: Iterable[Written]) -> None:
        """Join what several sides left. A side that did not write a cell left it as it is."""
        several = list(outcomes)
        places = {place: each[:2] for found in several for place, each in found.items()}
        self.work += len(places) * len(several)
        for place, (cells, key) in places.items():
            before = cells.get(key, _absent(cells))
            value: Value = BOTTOM
            for found in several:
                value = join(value, found[place][2] if place in found else before)
            self.write(cells, key, value)

    def absorb(self, outcome: Written, texts_too: bool) -> list[CellId]:
        """Add what a step wrote that may happen at this point, and return the cells that this changed."""
        changed: list[CellId] = []
        for place, (cells, key, value) in outcome.items():
            before = cells.get(key)
            new = join(_absent(cells), value) if before is None else widen(before, value, texts_too)
            if self.write(cells, key, new):
                changed.append(place)
        return changed

    def join_head(self, mark: int, turn: int) -> bool:
        """End a turn of a loop: join with the state at ``mark``. Return whether nothing was new."""
        first: dict[CellId, tuple[Cells, object, Value | None]] = {}
        for cells, key, old in self.trail[mark:]:
            if not (type(cells) is LocalCells and cells.dead):
                first.setdefault((id(cells), key), (cells, key, old))
        self.work += len(first)
        stable = True
        for cells, key, old in first.values():
            before = _absent(cells) if old is None else old
            joined = widen(before, cells.get(key, BOTTOM), turn > 2)
            if turn > 6 and not all(contains(before, atom) for atom in joined):
                joined = join(before, ANY)  # widening must end
            if not same(before, joined):
                stable = False
            self.write(cells, key, joined)
        return stable


def _absent(cells: Cells) -> Value:
    """Return what a cell holds that was never written: for a field, what the class says."""
    return BOTTOM if type(cells) is LocalCells else ABSENT


def same(old: Value, new: Value) -> bool:
    """Return whether two values have the same atoms."""
    return old is new or (len(old) == len(new) and all(contains(old, atom) for atom in new))
