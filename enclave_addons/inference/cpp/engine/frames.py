"""A call that runs: its variables, what it was called on, how it may end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from enclave_addons.inference.cpp.engine.store import Changes
from enclave_addons.inference.cpp.engine.values import BOTTOM, Obj, Place, Value
from enclave_addons.inference.cpp.reading.declarations import FileIndex, Function, Scope
from enclave_addons.inference.cpp.reading.type_names import Type

NEXT, RETURN, BREAK, CONTINUE = 1, 2, 4, 8
"""How a statement may end: it is left at its end, or by one of these words."""


class Variable(NamedTuple):
    """A name in a function. ``type`` is as written."""

    place: Place
    type: str = ""


@dataclass
class Loop:
    """A loop or ``switch`` that runs, with the states in which it was left or begun again."""

    mark: int
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
    path: int = 0
    conditional: bool = False  # the preprocessor decides elsewhere whether this runs
    variables: dict[str, Variable] = field(default_factory=dict)
    returned: Value = BOTTOM
    exits: list[Changes] = field(default_factory=list)
    mark: int = 0
    loops: list[Loop] = field(default_factory=list)
