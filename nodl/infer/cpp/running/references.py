"""References and pointers to texts, numbers and lists: who reads or writes through one means the variable behind it.

Objects are the same ones wherever they are seen; plain values lie in the cells of their variables. A local reference
stands for the expression that it was made of, what is written through any other is a gap. What a member refers
to is not known.
"""

from __future__ import annotations

import re

from nodl.infer.cpp.reading.writes import writes_of
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.values import BOTTOM, Group, Map, Param, ReferredTo, Seq, Text, Unknown, Value
from nodl.infer.cpp.syntax import Node, children, field_of, text, unwrapped


def is_plain(value: Value) -> bool:
    """Return whether a text, number or container is among the alternatives."""
    return any(isinstance(atom, Text | Seq | Map | Group | Param | int | float) for atom in value)


REFERRED_TO = ReferredTo("what a reference or pointer stands for")


def as_referred_to(value: Value) -> Value:
    """Return what a member or element that is a reference or pointer holds: objects; a plain value may change."""
    return tuple(REFERRED_TO if is_plain((atom,)) else atom for atom in value)


def bind_reference(run: Machine, name: str, kind: str, initial: Node | None, frame: Frame) -> None:
    """Bind ``T & name = initial`` or ``T * name = &initial``, which was declared and has its value."""
    target = unwrapped(initial)
    if _VIEW.search(kind) and target is not None and target.type in ("identifier", "field_expression"):
        last = field_of(target, "field") or target
        if frame.function is not None and text(last) in writes_of(frame.function.node):
            run.store.set((frame, name), (Unknown(f"what a view of {text(target)} shows later"),))
    if (
        target is None
        or not kind.endswith(("&", "*"))
        or not is_plain(run.store.get((frame, name)) or BOTTOM)
    ):
        return
    if kind.endswith("*"):
        target = unwrapped(field_of(target, "argument")) if target.type == "pointer_expression" else None
    if target is not None and _is_fixed(target):
        frame.aliases[name] = target
    elif (
        "const"
        not in text(initial.parent.parent if initial is not None and initial.parent else None).split("=")[0]
    ):
        frame.aliases[name] = None


_VIEW = re.compile(r"\b(?:string_view|span)\b")


def _is_fixed(target: Node) -> bool:
    """Return whether an expression means the same variable wherever it stands."""
    if target.type == "subscript_expression":
        listed = children(field_of(target, "indices"))
        inner = field_of(target, "argument")
        return (
            all(each.type.endswith("_literal") for each in listed) and inner is not None and _is_fixed(inner)
        )
    if target.type == "field_expression":
        inner = field_of(target, "argument")
        return inner is not None and (inner.type == "this" or _is_fixed(inner))
    return target.type in ("identifier", "qualified_identifier")


def through(run: Machine, what: Node, frame: Frame) -> None:
    """Add a gap: somebody writes to a plain value through ``what``, and it is not known to which."""
    run.gap(what, frame, f"what {text(what)[:40]} refers to is written: which variable that is is not known")
