"""Operators of the program's own classes, as methods or functions.

Where an object is converted takes overload resolution to say; a class whose conversion does more than give a value is a
gap where one is made (``constructors``).
"""

from __future__ import annotations

from collections.abc import Sequence

from nodl.infer.cpp.running.invocation import call_functions, call_methods
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.overloads import chosen
from nodl.infer.cpp.running.values import Obj, Value, join
from nodl.infer.cpp.syntax import Node


def pointed_to(run: Machine, value: Value, operator: str, node: Node, frame: Frame) -> Value:
    """``x->`` and ``*x``: what the operator of its class gives for an object that has one, else ``x`` itself."""
    found: list[Value] = []
    for atom in value:
        own = run.methods_of(atom, operator)
        found.append(
            call_methods(run, own, atom, [], node, frame, ()) if own and isinstance(atom, Obj) else (atom,)
        )
    return join(*found)


def by_operator(
    run: Machine, sign: str, left: Value, right: Sequence[Value], node: Node, frame: Frame
) -> Value | None:
    """What an operator that the program defines gives; ``None`` if it defines none for these operands."""
    objects = [a for value in (left, *right) for a in value if isinstance(a, Obj) and a.cls is not None]
    if not objects:
        return None
    return _by_own(run, f"operator{sign}", left, right, node, frame)


def _by_own(
    run: Machine, name: str, left: Value, right: Sequence[Value], node: Node, frame: Frame
) -> Value | None:
    this = left[0] if len(left) == 1 else None
    if isinstance(this, Obj) and (own := chosen(run.methods_of(this, name), right)):
        return call_methods(run, [own], this, right, node, frame, ())
    free = run.names.find_functions(name, frame.scope, frame.file)
    if not chosen(free, [left, *right]):
        return None
    return call_functions(run, free, [left, *right], node, frame, ())
