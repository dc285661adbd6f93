"""The objects that a run makes: one for each place in the program and calling context."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Callable
from typing import Any, TypeVar

from nodl.infer.state import ProgramState
from nodl.infer.values import HeapObject, Items, LocalCells, Sequence, Value

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
        self._allocated: dict[tuple[object, ...], Any] = {}
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
        """The object made at ``node`` in this calling context; made twice it stands for all of them."""
        key = (self.context, id(node), kind)
        found: Made | None = self._allocated.get(key)
        if found is None:
            found = self._allocated[key] = make()
            self.born.append(found)
        else:
            found.summary = True  # what was stored before is still there: weak updates only add to it
        return found

    def tuple_of(self, parts: tuple[Value, ...]) -> Value:
        """A tuple; it never changes, so equal ones are one object and need no allocation site."""
        key = (parts, tuple(type(part[0]) if part else None for part in parts))
        found = self._tuples.get(key)
        if found is None:
            found = self._tuples[key] = (Sequence("tuple", Items(parts)),)
        return found

    def sequence(self, node: ast.AST, kind: str, items: Items) -> Value:
        if kind == "tuple" and items.exact is not None:
            return self.tuple_of(items.exact)
        obj = self.allocate(node, kind, lambda: Sequence(kind, items))
        if obj.summary:
            self.state.store(obj, "[items]", (items,))
        return (obj,)
