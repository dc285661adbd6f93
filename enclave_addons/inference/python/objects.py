"""What a Python program handles beside plain values: functions, classes, modules, methods, frames, arguments."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from enclave_addons.inference.kernel.machine import Jumps
from enclave_addons.inference.kernel.values import BOTTOM, Cells, External, Obj, Value
from enclave_addons.inference.python.program import SourceModule
from enclave_common.source_location import SourceLocation

FunctionNode = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
FUNCTION_NODES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)


class Module(Obj):
    """An analysed module. Its cells are its global variables; ``stars`` are libraries imported with ``*``."""

    __slots__ = ("source", "stars")

    def __init__(self, source: SourceModule) -> None:
        super().__init__("module")
        self.source = source
        self.stars: list[str] = []


class Class(Obj):
    """An analysed class. Its cells hold what its body and later assignments set."""

    __slots__ = ("bases", "is_dataclass", "module", "node", "order")

    def __init__(self, node: ast.ClassDef, module: Module) -> None:
        super().__init__("class")
        self.node = node
        self.module = module
        self.bases: list[object] = []
        self.order: list[object] = [self]  # method resolution order
        self.is_dataclass = False

    @property
    def name(self) -> str:
        return self.node.name

    def classes(self) -> list[Class]:
        return [each for each in self.order if isinstance(each, Class)]

    def foreign(self) -> list[str]:
        """Return the paths of its bases in libraries."""
        return [each.path for each in self.order if isinstance(each, External)]


@dataclass(eq=False)
class Function:
    """A function with what it closes over; ``owner`` is the class whose body defines it."""

    node: FunctionNode
    module: Module
    closure: Frame | None
    owner: Class | None
    defaults: dict[str, Value]
    decorated: frozenset[str] = frozenset()

    @property
    def name(self) -> str:
        return getattr(self.node, "name", "<lambda>")


class Bound(NamedTuple):
    """A function with the object or class that becomes its first argument."""

    function: Function
    receiver: object


class Method(NamedTuple):
    """Method ``name`` of a text, container or something unknown."""

    receiver: object
    name: str


class ForeignMethod(NamedTuple):
    """Method ``name`` that ``receiver`` has from the class ``path`` of a library."""

    path: str
    receiver: object
    name: str


class Partial(NamedTuple):
    """A callable with its first arguments given in advance."""

    function: Value
    positional: tuple[Value, ...]
    keywords: tuple[tuple[str, Value], ...]


class Super(NamedTuple):
    """``super()`` inside a method of ``owner``."""

    owner: Class
    receiver: object


class Property(NamedTuple):
    """A property, by what reads and what sets it."""

    getter: Value
    setter: Value = BOTTOM


class Wrapped(NamedTuple):
    """A function under ``@classmethod``, or under ``@staticmethod`` (``static``)."""

    function: Value
    static: bool


@dataclass(eq=False)
class Frame:
    """A running function, class body, comprehension or module."""

    module: Module
    cells: Cells
    closure: Frame | None
    jumps: Jumps
    function: Function | None = None
    cls: Class | None = None  # whose body this is
    loops: list[Jumps] = field(default_factory=list)
    returned: Value = BOTTOM
    yields: list[Value] | None = None
    yields_known: bool = True
    forks: int = 0
    elsewhere: set[str] = field(default_factory=set)  # names that ``global`` and ``nonlocal`` declare
    is_comprehension: bool = False


@dataclass
class Arguments:
    """Arguments of a call. ``more`` may stand for further ones whose number or names are not known."""

    positional: list[Value] = field(default_factory=list)
    keywords: dict[str, Value] = field(default_factory=dict)
    more: Value = BOTTOM
    more_keywords: Value = BOTTOM

    def at(self, position: int, keyword: str = "") -> Value | None:
        """Return the argument at ``position`` (none if negative) or under ``keyword``; ``None`` if it is not given."""
        if 0 <= position < len(self.positional):
            return self.positional[position]
        if keyword in self.keywords:
            return self.keywords[keyword]
        return (self.more if position >= 0 else BOTTOM) or self.more_keywords or None

    def preceded(self, *first: Value) -> Arguments:
        return Arguments([*first, *self.positional], self.keywords, self.more, self.more_keywords)

    def all_values(self) -> Iterator[Value]:
        yield from self.positional
        yield from self.keywords.values()
        yield from (self.more, self.more_keywords)


@dataclass
class Call:
    """A call with its place."""

    args: Arguments
    node: ast.AST
    frame: Frame

    @property
    def source(self) -> SourceLocation:
        return SourceLocation(self.frame.module.source.path, getattr(self.node, "lineno", 0))

    def at(self, position: int, keyword: str = "") -> Value | None:
        return self.args.at(position, keyword)
