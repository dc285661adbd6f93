"""The type that an expression has at compile time, and the class in which a member or method is looked up.

A member that a derived class hides shares its cell with the hidden one; where a text could be mistaken that is a gap.
"""

from __future__ import annotations

import re

from nodl.infer.cpp.reading.declarations import Class, type_text
from nodl.infer.cpp.reading.names import hidden
from nodl.infer.cpp.reading.type_names import NO_TYPE, Type
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.values import Obj
from nodl.infer.cpp.running.variables import declared_type
from nodl.infer.cpp.syntax import Node, callee_name, field_of, template_arguments, text, unwrapped


def check_hidden(run: Machine, cls: Class, node: Node, frame: Frame) -> None:
    """Add a gap if ``cls`` has two members of one name that hold plain values: which is meant is not followed."""
    for name in hidden(run.names, cls):
        fields = [each.fields[name].type for each in run.names.ancestry(cls) if name in each.fields]
        if any(_PLAIN.search(kind) for kind in fields):
            run.gap(node, frame, f"{cls.name} hides {name} of a base: which of them is meant is not followed")


def class_around(run: Machine, frame: Frame) -> Class | None:
    """Return the class whose method the code is, by what it says; ``None`` for any other code."""
    owner = frame.function.owner if frame.function is not None else ""
    return run.names.find_class(owner, frame.scope, frame.file) if owner else None


def class_of_member(run: Machine, atom: Obj, name: str, access: Node, frame: Frame) -> Class | None:
    """Return the class in which ``x.name``, ``x->name`` or ``x.Base::name`` is looked up where ``x`` is ``atom``.

    A method that is not virtual is that of the class which ``x`` has at compile time; a gap if that is not known.
    """
    head = text(field_of(access, "field")).rpartition("::")[0]
    ancestry = run.names.ancestry(atom.cls)
    if head:
        named = run.class_of(run.type_of(head, frame), frame)
        return next((c for c in ancestry if c is named or c.name == head), atom.cls)
    hidden_ones = [m for each in ancestry for m in run.names.methods[each].get(name, ())]
    if name not in run.hidden_names(atom) or not hidden_ones:
        return atom.cls
    seen = seen_class(run, field_of(access, "argument"), frame)
    matters = any("string" in type_text(m.node) for m in hidden_ones) or any(
        map(run.makes_interfaces, hidden_ones)
    )
    if seen is None and matters:
        run.gap(access, frame, f"which {name}() is called here is not known: a derived class hides it")
    return seen if seen in ancestry else atom.cls


def seen_class(run: Machine, node: Node | None, frame: Frame) -> Class | None:
    """Return the class that an expression has, or points to, at compile time; ``None`` if that is not known."""
    kind = seen_type(run, node, frame)
    return run.class_of(kind, frame) if kind.name else None


def seen_type(run: Machine, node: Node | None, frame: Frame) -> Type:
    """Return the type of a variable, a member, an element or a call; ``NO_TYPE`` for all else."""
    node = unwrapped(node)
    if node is None:
        return NO_TYPE
    if node.type == "pointer_expression":
        return seen_type(run, field_of(node, "argument"), frame)
    if node.type == "subscript_expression":
        return element_type(seen_type(run, field_of(node, "argument"), frame))
    if node.type == "call_expression":
        return _of_call(run, node, frame)
    owner = field_of(node, "argument") if node.type == "field_expression" else None
    if owner is None or owner.type == "this":
        kind, holder = declared_type(run, node, frame)[0], frame.owner_of(text(node))
        initial = holder.initial.get(text(node)) if holder is not None and kind.name == "auto" else None
        return kind if initial is None or holder is None else seen_type(run, initial, holder)
    name = text(field_of(node, "field"))
    for each in run.names.ancestry(seen_class(run, owner, frame)):
        if name in each.fields:
            kind = run.names.resolve(each.fields[name].type, each.scope, each.file)
            return kind._replace(pointer=kind.pointer or each.fields[name].pointer)
    return NO_TYPE


def _of_call(run: Machine, node: Node, frame: Frame) -> Type:
    """Return the type of what is made, of an element, or of what the only function of that name gives."""
    callee = unwrapped(field_of(node, "function")) or node
    owner, name = field_of(callee, "argument"), callee_name(field_of(callee, "field") or callee)
    made = template_arguments(callee) if _MAKES.search(name) else []
    if made:
        return run.type_of(text(made[0]), frame)
    if owner is None:
        found = run.names.find_functions(name, frame.scope, frame.file)
        found = found or run.names.find_methods(class_around(run, frame), name)
    else:
        kind = seen_type(run, owner, frame)
        if name in GIVES_INNER | _GIVES_ELEMENT:
            return kind if name in GIVES_INNER else element_type(kind)
        found = run.names.find_methods(run.class_of(kind, frame) if kind.name else None, name)
    if len(found) != 1:
        return NO_TYPE
    return run.names.resolve(type_text(found[0].node), found[0].scope, found[0].file)


def element_type(kind: Type) -> Type:
    """Return the type of a container's elements, of a map that of its values."""
    return kind.arguments[-1] if kind.arguments and kind.last != "array" else (*kind.arguments, NO_TYPE)[0]


GIVES_INNER = frozenset({"get", "lock", "value", "release"})
_MAKES = re.compile(r"(?:^|::)(?:make_(?:shared|unique)|\w+_cast)$")
_PLAIN = re.compile(
    r"\b(?:string\w*|char|u?int(?:\d+_t)?|bool|double|float|size_t|long|vector|map|array|list|set)\b"
)
_GIVES_ELEMENT = frozenset({"at", "front", "back", "top"})
