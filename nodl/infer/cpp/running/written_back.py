"""What a function writes to its reference parameters, in the variables and elements of its caller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from nodl.infer.cpp.reading.declarations import FunctionParameter
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.constructors import is_written_back
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.values import Value
from nodl.infer.cpp.syntax import Node, children, field_of, text, unwrapped

_WRITTEN_BACK = frozenset({
    "identifier", "field_expression", "subscript_expression", "call_expression", "pointer_expression",
})  # fmt: skip


def _is_element(call: Node) -> bool:
    """``x.at(i)``: an element that a call gives by reference, and whose evaluation changes nothing."""
    callee = field_of(call, "function")
    name = text(field_of(callee, "field"))
    return name in ("at", "front", "back", "begin", "rbegin", "data", "value")


def write_back(
    run: Machine,
    parameters: Sequence[FunctionParameter],
    left: Mapping[str, Value | None],
    node: Node,
    frame: Frame,
) -> None:
    """What a function does to its reference parameters shows in the caller's variables."""
    given = children(field_of(node, "arguments"))
    for parameter, argument in zip(parameters, given, strict=False):
        if not is_written_back(parameter):
            continue
        target = unwrapped(argument)
        if target is not None and target.type == "pointer_expression":
            inner = unwrapped(field_of(target, "argument"))
            target = target if inner is not None and inner.type == "call_expression" else inner
        if target is None or target.type not in _WRITTEN_BACK:
            continue
        if target.type == "call_expression" and not _is_element(target):
            continue
        value = left[parameter.name]
        if value is not None and value != run.evaluate(target, frame):
            assign(run, target, value, frame)
