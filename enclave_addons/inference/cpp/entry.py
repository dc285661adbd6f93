"""Programs as plain values: where one starts, under which name launch knows it, what it makes. Pure."""

from __future__ import annotations

import os
import traceback
from typing import Any, NamedTuple

from enclave_addons.inference.cpp.reading.built import UNBUILT, Definitions
from nodl.node_interface import Gap, NodeInterface


class Entry(NamedTuple):
    """Where a program starts: ``main`` of its files, or the constructor of a class. ``instance``: the name under which
    a host loads this class and gives it its node."""

    files: tuple[str, ...]
    cls: str = ""
    main: bool = True
    definitions: Definitions = UNBUILT
    place: str = ""  # the package's folder, for what has no file
    instance: str = ""


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
    """tree-sitter is not installed: ``pip install tree-sitter tree-sitter-cpp``."""


def failure(what: str, error: Exception) -> str:
    """Describe an exception inside ``what`` as the reason of a gap, with what to report."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{os.path.basename(place.filename)}:{place.lineno}"
    said = " ".join(str(error).split())[:120]
    return (
        f"{what} failed ({type(error).__name__} in {where}{f': {said}' if said else ''}); its interfaces are not "
        "known: write them in a manifest, and report this line with the source"
    )


class Answer:
    """The interfaces of one program by its sources, or why there are none.

    Attributes:
        consulted: Parameters of the launch decided what it makes.
        not_made: The build of its package makes no such program.
    """

    def __init__(
        self,
        interfaces: tuple[NodeInterface, ...],
        why: str = "",
        consulted: bool = False,
        *,
        not_made: bool = False,
    ):
        self.interfaces = interfaces
        self.why = why
        self.consulted = consulted
        self.not_made = not_made
