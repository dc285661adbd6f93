"""Calls and loops that run: their variables, what left them early."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from nodl.infer.cpp.findings import Condition
from nodl.infer.cpp.reading.declarations import FileIndex, Function, Scope
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.store import Changes
from nodl.infer.cpp.running.values import BOTTOM, Obj, Value

if TYPE_CHECKING:
    from tree_sitter import Node


@dataclass(eq=False)
class Loop:
    """``continue`` ends an iteration, begun at ``mark``; ``break`` the loop, begun at ``start``."""

    mark: int
    start: int
    breaks: list[Changes] = field(default_factory=list)
    continues: list[Changes] = field(default_factory=list)


@dataclass(eq=False)
class Frame:
    """A call that runs. ``path`` tells apart what is made at one place through different calls."""

    file: FileIndex
    scope: Scope
    function: Function | None = None
    this: Obj | None = None
    bindings: Mapping[str, Type] = field(default_factory=dict)
    outer: Frame | None = None  # of a lambda: where its captures live
    path: tuple[object, ...] = ()
    conditions: tuple[Condition, ...] = ()
    types: dict[str, str] = field(default_factory=dict)
    names: set[str] = field(default_factory=set)
    returned: Value = BOTTOM
    exits: list[Changes] = field(default_factory=list)
    exit_values: list[Value] = field(default_factory=list)
    mark: int = 0
    loops: list[Loop] = field(default_factory=list)
    blocks: list[dict[str, tuple[bool, Value, str | None, Node | None]]] = field(default_factory=list)
    """For each block that runs: what names that it declares stood for before."""
    kept: dict[str, Frame] = field(
        default_factory=dict
    )  # of a lambda: what it captured of blocks that may have ended
    aliases: dict[str, Node | None] = field(default_factory=dict)
    """References and pointers to plain values: the expression that each stands for, ``None`` if not known."""
    depth: int = 0
    finished: bool = False  # nobody can see its variables any more
    captured: bool = False  # a lambda can
    active: bool = False  # runs now

    def owner_of(self, name: str) -> Frame | None:
        """The frame whose variable ``name`` is."""
        frame: Frame | None = self
        while frame is not None:
            if name in frame.names:
                return frame
            if name in frame.kept:
                return frame.kept[name]
            frame = frame.outer
        return None
