"""What variables and members hold, with a trail of writes by which alternatives are undone and joined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from enclave_addons.inference.cpp.engine.values import BOTTOM, Value, join

Cell = tuple[object, str]
Changes = dict[Cell, Value]


@dataclass
class Footprint:
    """What some code read before it wrote it, and what it wrote."""

    reads: dict[Cell, Value] = field(default_factory=dict)
    writes: set[Cell] = field(default_factory=set)


class AbstractStore:
    """Values by their cell: who has it (an object, a call, a class) and its name."""

    def __init__(self) -> None:
        self._values: dict[Cell, Value] = {}
        self._trail: list[tuple[Cell, Value | None]] = []
        self._records: list[Footprint] = []
        self._by_name: dict[str, dict[Cell, None]] = {}

    def get(self, cell: Cell) -> Value:
        """Return what a cell holds: nothing, if it was never written."""
        value = self._values.get(cell, BOTTOM)
        if self._records:
            record = self._records[-1]
            if cell not in record.writes:
                record.reads.setdefault(cell, value)
        return value

    def __contains__(self, cell: Cell) -> bool:
        return cell in self._values

    def set(self, cell: Cell, value: Value) -> None:
        before = self._values.get(cell)
        if before is None:
            self._by_name.setdefault(cell[1], {})[cell] = None
        self._trail.append((cell, before))
        self._values[cell] = value
        if self._records:
            self._records[-1].writes.add(cell)

    def cells_named(self, names: frozenset[str]) -> list[Cell]:
        """Return the cells of these names, whoever has them."""
        return [
            cell for name in sorted(names) for cell in self._by_name.get(name, ()) if cell in self._values
        ]

    def initialise(self, cell: Cell, value: Value) -> None:
        """Set what a plain variable holds before anything runs, whenever it is first asked for."""
        self._values[cell] = value
        self._by_name.setdefault(cell[1], {})[cell] = None

    def mark(self) -> int:
        """Return the present end of the trail."""
        return len(self._trail)

    def changes(self, mark: int) -> Changes:
        """Return the cells that were written since ``mark``, with what they hold now."""
        return {cell: self._values[cell] for cell, _ in self._trail[mark:] if cell in self._values}

    def moved(self, mark: int) -> list[Cell]:
        """Return the cells that were there at ``mark`` and hold something else now."""
        before: dict[Cell, Value | None] = {}
        for cell, value in self._trail[mark:]:
            before.setdefault(cell, value)
        return [
            cell
            for cell, value in before.items()
            if value is not None and set(value) != set(self._values[cell])
        ]

    def blur(self, mark: int) -> None:
        """Let each cell hold anything that it held since ``mark``: code may have been left anywhere."""
        held: dict[Cell, Value] = {}
        for cell, before in self._trail[mark:]:
            held[cell] = join(held.get(cell, BOTTOM), before or BOTTOM)
        for cell, value in held.items():
            self.set(cell, join(value, self._values.get(cell, BOTTOM)))

    def undo(self, mark: int) -> None:
        """Go back to the state at ``mark``."""
        while len(self._trail) > mark:
            cell, before = self._trail.pop()
            if before is None:
                self._values.pop(cell, None)
            else:
                self._values[cell] = before

    def forget_locals(self, mark: int) -> None:
        """Forget the variables of calls that began and ended since ``mark``; their cells are numbered by the call."""
        made = {cell for cell, before in self._trail[mark:] if before is None and isinstance(cell[0], int)}
        if made:
            self._trail[mark:] = [each for each in self._trail[mark:] if each[0] not in made]
            for cell in made:
                self._values.pop(cell, None)

    def merge(self, alternatives: Sequence[Changes]) -> None:
        """Go on from the present state as any of the alternatives left it."""
        for cell in dict.fromkeys(cell for each in alternatives for cell in each):
            before = self._values.get(cell, BOTTOM)
            self.set(cell, join(*(each.get(cell, before) for each in alternatives)))

    def settle(self, mark: int, alternatives: Sequence[Changes], going: bool) -> None:
        """Join what left early with the present state, if that is reached."""
        if not alternatives:
            return
        every = [*alternatives, self.changes(mark)] if going else alternatives
        self.undo(mark)
        self.merge(every)

    def begin_record(self) -> None:
        self._records.append(Footprint())

    def end_record(self) -> Footprint:
        """Return what was read and written since the matching ``begin_record``; it counts for the one around it."""
        record = self._records.pop()
        if self._records:
            around = self._records[-1]
            for cell, value in record.reads.items():
                if cell not in around.writes:
                    around.reads.setdefault(cell, value)
            around.writes |= record.writes
        return record

    def holds(self, record: Footprint) -> bool:
        """Return whether everything that was read is as it was."""
        return all(self.get(cell) == value for cell, value in record.reads.items())
