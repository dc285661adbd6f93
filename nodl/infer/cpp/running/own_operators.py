"""Operators of the program's own classes, as methods or functions; conversion operators where an object is converted.

A condition converts to ``bool`` ([conv.general]/4). Elsewhere it takes overload resolution to say whether one runs: it
may run or not, and one that changes something is a gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from nodl.infer.cpp.reading.declarations import Class, Function
from nodl.infer.cpp.running.assignments import object_class
from nodl.infer.cpp.running.invocation import call_functions, call_methods
from nodl.infer.cpp.running.machine import NEXT, Frame, Machine
from nodl.infer.cpp.running.overloads import chosen
from nodl.infer.cpp.running.values import Obj, Value, join, unknown
from nodl.infer.cpp.syntax import Node, field_of, text


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
    name, this = f"operator{sign}", left[0] if len(left) == 1 else None
    if isinstance(this, Obj) and (own := run.methods_of(this, name)):
        return call_methods(run, own, this, right, node, frame, ())
    free = run.names.find_functions(name, frame.scope, frame.file)
    if not chosen(free, [left, *right]):
        return None
    return call_functions(run, free, [left, *right], node, frame, ())


_BRACKETS = ("parenthesized_expression", "condition_clause")
_CONDITIONS = ("if_statement", "while_statement", "do_statement", "for_statement", "conditional_expression")
_KEEPS_OBJECT = ("expression_statement", "call_expression", "for_range_loop", "comma_expression")


def converted_where_it_stands(run: Machine, node: Node, value: Value, frame: Frame) -> Value:
    """What becomes of an object at ``node``: in a condition what its ``operator bool`` gives, else the object."""
    objects = [a for a in value if isinstance(a, Obj) and a.cls is not None and _operators(run, a.cls)]
    inner = node
    while inner.parent is not None and inner.parent.type in _BRACKETS:
        inner = inner.parent
    place = inner.parent
    if not objects or place is None or node.type in _BRACKETS:
        return value
    if not _is_condition(place, inner):
        for each in objects:
            _may_be_converted(run, each, place, inner, node, frame)
        return value
    if object_class(run, node, frame) is None:  # a pointer, or perhaps one, is not converted
        for each in objects:
            _may_be_converted(run, each, place, inner, node, frame)
        return unknown("a condition")
    found: list[Value] = []
    for atom in value:
        own = _operators(run, atom.cls) if isinstance(atom, Obj) and atom.cls is not None else {}
        methods = own.get("operator bool") or next(iter(own.values()), None)
        found.append(
            call_methods(run, methods, atom, [], node, frame, ())
            if isinstance(atom, Obj) and methods is not None
            else (atom,)
        )
    return join(*found)


def _operators(run: Machine, cls: Class) -> dict[str, list[Function]]:
    """The conversion operators of a class, those of its bases included."""
    return {
        name: methods
        for each in reversed(run.names.ancestry(cls))
        for name, methods in run.names.methods.get(each, {}).items()
        if name.startswith("operator ")
    }


def _is_condition(place: Node, inner: Node) -> bool:
    if place.type in _CONDITIONS:
        return field_of(place, "condition") == inner
    if place.type == "declaration":  # if (auto x = ...)
        return place.parent is not None and place.parent.type == "condition_clause"
    sign = text(field_of(place, "operator"))
    return sign in (("!", "not") if place.type == "unary_expression" else ("&&", "||", "and", "or"))


def _may_be_converted(run: Machine, each: Obj, place: Node, inner: Node, node: Node, frame: Frame) -> None:
    """The conversion runs, or does not; a gap if that makes a difference."""
    if each.cls is None or _stays(run, each.cls, place, inner, frame):
        return
    mark = run.store.mark()

    def once(methods: list[Function]) -> int:
        call_methods(run, methods, each, [], node, frame, ())
        return NEXT

    run.branches([*(partial(once, found) for found in _operators(run, each.cls).values()), lambda: NEXT])
    before = run.store.before(mark)
    if any(
        set(before.get(cell) or ()) != set(value)
        for cell, value in run.store.changes(mark).items()
        if before.get(cell) or not isinstance(cell[0], Frame)
    ):
        which = f"{text(node)[:40]} is converted here by an operator of {each.cls.name}, which writes,"
        run.gap(node, frame, f"whether {which} is not known")


def _stays(run: Machine, cls: Class, place: Node, inner: Node, frame: Frame) -> bool:
    """Whether an object is certainly taken as it is where it stands."""
    if place.type == "field_expression":
        return "operator" not in text(place)
    if place.type == "pointer_expression":
        return text(place).startswith("&")
    if place.type == "assignment_expression":
        return field_of(place, "left") == inner
    if place.type == "init_declarator":
        written = text(field_of(place.parent, "type")) if place.parent is not None else ""
        kind = run.type_of(written, frame)
        return "auto" in written.split() or run.class_of(kind, frame) is cls
    if place.type == "binary_expression":
        name = f"operator{text(place.child_by_field_name('operator'))}"
        return bool(
            run.names.find_methods(cls, name) or run.names.find_functions(name, frame.scope, frame.file)
        )
    if place.type == "argument_list" and place.parent is not None:
        return _as_parameter(run, cls, place, inner)
    return place.type in _KEEPS_OBJECT


def _as_parameter(run: Machine, cls: Class, place: Node, inner: Node) -> bool:
    """Whether every function of that name in reach takes an object of the class there."""
    callee = field_of(place.parent, "function") if place.parent is not None else None
    listed = run.names.functions_by_name.get(text(callee).rpartition("::")[2], ())
    position = place.named_children.index(inner)
    kinds = [each.parameters[position].type for each in listed if position < len(each.parameters)]
    return bool(kinds) and all(
        cls.name in kind.replace("&", " ").replace("::", " ").split() for kind in kinds
    )
