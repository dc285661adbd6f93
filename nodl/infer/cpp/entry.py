"""Programs as plain values: where one starts, under which name launch knows it, what it makes. Pure."""

from __future__ import annotations

from enclave_launch.boundary.light import Any, NamedTuple
from nodl.node_interface import Gap, NodeInterface


class Entry(NamedTuple):
    """Where a program starts: ``main`` of its files, or the constructor of a class."""

    files: tuple[str, ...]
    cls: str = ""
    main: bool = True
    symbols: tuple[tuple[str, str], ...] = ()
    complete: bool = False
    place: str = ""  # the package's folder, for what has no file


class Solved(NamedTuple):
    """``gaps``: of the program, which its first node also has; ``dead``: places that make nothing, and why;
    ``classes``: of which it makes objects; ``consulted``: parameters of the launch decided what it makes."""

    nodes: tuple[NodeInterface, ...] = ()
    gaps: tuple[Gap, ...] = ()
    dead: tuple[Gap, ...] = ()
    classes: tuple[str, ...] = ()
    consulted: bool = False


class FixedMapping(dict[Any, Any]):
    """A mapping that nobody changes, so that what holds it has a hash."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))


class CppSupportMissing(Exception):
    """tree-sitter is not installed: ``pip install enclave-launch[cpp]``."""


class Answer:
    """What the sources say of one program. ``consulted``: parameters of the launch decided what it makes."""

    def __init__(self, interfaces: tuple[NodeInterface, ...], why: str = "", consulted: bool = False):
        self.interfaces = interfaces
        self.why = why
        self.consulted = consulted
