"""What the text of a callee says: its name, its template arguments."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine, template_arguments
from nodl.infer.cpp.syntax import text

if TYPE_CHECKING:
    from tree_sitter import Node

    from nodl.infer.cpp.reading.declarations import Class
    from nodl.infer.cpp.reading.type_names import Type


def callee_name(callee: Node) -> str:
    """The name of a callee without its template arguments."""
    whole = re.sub(r"\s+", "", text(callee))
    if not whole.endswith(">"):
        return whole.lstrip(":")
    depth = 0
    for position in range(len(whole) - 1, -1, -1):
        depth += (whole[position] == ">") - (whole[position] == "<")
        if depth == 0:
            return whole[:position].lstrip(":")
    return whole


def types_of(run: Machine, callee: Node, frame: Frame) -> list[Type]:
    """The template arguments that a call writes out; empty when it leaves them to deduction."""
    return [run.type_of(text(each), frame) for each in template_arguments(callee)]


def is_only_declared(run: Machine, cls: Class, name: str) -> bool:
    """Whether ``cls`` or a base declares the method without a body; ask after no body was found."""
    return bool(run.names.declarations(cls, name))
