"""Where a program stands: the variables of what is running, and a call as it is made."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from nodl.infer.state import Written
from nodl.infer.values import BOTTOM, FunctionValue, LocalCells, ModuleValue, Value, join
from nodl.source_ref import SourceRef


class Frame:
    """The variables of a running function, class body or module."""

    __slots__ = (
        "again", "cells", "closure", "depth", "early", "entry", "exits", "forks", "function", "globals", "is_class",
        "is_comprehension", "jump", "loop_forks", "mark", "module", "nonlocals", "returned", "unsettled", "yielded",
    )  # fmt: skip

    def __init__(self, module: ModuleValue, cells: dict[object, Value], closure: Frame | None, depth: int):
        self.module = module
        self.cells = cells
        self.closure = closure
        self.depth = depth  # of branches when the frame was entered
        self.function: FunctionValue | None = None
        self.entry: ast.AST | None = None  # the call that runs the function
        self.returned: Value = BOTTOM
        self.yielded: Value | None = None
        self.early = False  # some path left before the end
        self.mark = 0  # of the state, when the frame was entered
        self.exits: list[Written] = []  # what was written since, at each return that leaves early
        self.unsettled = False  # a break or continue that may have happened, since the loop asked last
        self.jump = ""  # the break or continue that certainly ended the latest statement
        self.forks = 0  # undecided branches when the frame was entered, and when its innermost loop was
        self.loop_forks = 0
        self.again = False  # the cells also hold an earlier call, whose inner functions live on
        self.is_class = False
        self.is_comprehension = False
        self.globals: set[str] = set()
        self.nonlocals: set[str] = set()

    @property
    def captured(self) -> bool:
        return type(self.cells) is LocalCells and self.cells.shared

    def capture(self) -> None:
        """Let inner functions see the cells, and those around them, from now on."""
        frame: Frame | None = self
        while frame is not None and not frame.captured:
            if type(frame.cells) is LocalCells:
                frame.cells.shared = True
            frame = frame.closure


class Arguments:
    """The arguments of a call. ``more``: further positional ones of unknown number."""

    __slots__ = ("keywords", "more", "more_keywords", "positional")

    def __init__(
        self,
        positional: list[Value] | None = None,
        keywords: dict[str, Value] | None = None,
        more: Value = BOTTOM,
        more_keywords: Value = BOTTOM,
    ) -> None:
        self.positional = [] if positional is None else positional
        self.keywords = {} if keywords is None else keywords
        self.more = more
        self.more_keywords = more_keywords

    def at(self, index: int, name: str | None = None) -> Value | None:
        """Return the argument at ``index`` or called ``name``; ``None`` when it is not given."""
        if 0 <= index < len(self.positional):
            return self.positional[index]
        if name is not None and name in self.keywords:
            return self.keywords[name]
        found = join(self.more if index >= 0 else BOTTOM, self.more_keywords)
        return found or None

    def shifted(self) -> Arguments:
        return Arguments(self.positional[1:], self.keywords, self.more, self.more_keywords)

    def preceded(self, *first: Value) -> Arguments:
        return Arguments([*first, *self.positional], self.keywords, self.more, self.more_keywords)

    def all_values(self) -> Iterable[Value]:
        return (*self.positional, *self.keywords.values(), self.more, self.more_keywords)


class Call:  # its fields are read so often that those of a named tuple would cost a launch of 50 nodes half a percent
    """A call as the models of libraries see it."""

    __slots__ = ("args", "frame", "node")

    def __init__(self, args: Arguments, node: ast.AST, frame: Frame) -> None:
        self.args = args
        self.node = node
        self.frame = frame

    @property
    def source(self) -> SourceRef:
        return SourceRef(self.frame.module.source.path, getattr(self.node, "lineno", 0))
