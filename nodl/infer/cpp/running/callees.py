"""What the text of a callee says: its name, its template arguments."""

from __future__ import annotations

from nodl.infer.cpp.reading.declarations import Class
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.syntax import Node, field_of, text


def callee_name(callee: Node) -> str:
    """The name of a callee without its template arguments."""
    whole = "".join(text(callee).split())
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
    return [run.type_of(text(each), frame) for each in _template_arguments(callee)]


def _template_arguments(node: Node | None) -> list[Node]:
    """Those of ``f<A, B>`` and ``x.f<A>`` and ``a::f<A>``."""
    while node is not None and node.type in ("field_expression", "qualified_identifier", "dependent_name"):
        inner = field_of(node, "field") or field_of(node, "name")
        node = inner if inner is not None else (node.named_children[0] if node.named_children else None)
    listed = field_of(node, "arguments") if node is not None and node.type.startswith("template_") else None
    return [child for child in listed.named_children if child.type != "comment"] if listed is not None else []


def is_only_declared(run: Machine, cls: Class, name: str) -> bool:
    """Whether ``cls`` or a base declares the method without a body; ask after no body was found."""
    return bool(run.names.declarations(cls, name))
