"""Names that a derived class hides: a base, or who sees the object as the base, means its own ([class.member.lookup]).

Members that are hidden have cells of their own; which one is meant, and which method that is not virtual, says the
class that an expression has at compile time.
"""

from __future__ import annotations

import re

from nodl.infer.cpp.reading.collect import declared_names
from nodl.infer.cpp.reading.declarations import Class, type_text
from nodl.infer.cpp.reading.names import hidden
from nodl.infer.cpp.reading.type_names import NO_TYPE, Type
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.values import Obj
from nodl.infer.cpp.syntax import (
    Node,
    callee_name,
    children,
    field_of,
    template_arguments,
    text,
    unwrapped,
    walk,
)


def cell_of(run: Machine, owner: Obj, name: str, seen: Class | None) -> str:
    """Under which name the store has a member of ``owner``, for who sees it as an object of ``seen``."""
    if owner.cls is None or name not in hidden(run.names, owner.cls):
        return name
    ancestry = run.names.ancestry(owner.cls)
    nearest = next(
        (c for c in run.names.ancestry(seen or owner.cls) if name in c.fields and c in ancestry), None
    )
    first = next((c for c in ancestry if name in c.fields), None)
    return name if nearest is None or nearest is first else f"{nearest.qualified}::{name}"


def lexical_class(run: Machine, this: Obj, frame: Frame) -> Class | None:
    """The class whose code runs on ``this``: its own, a base, or that of a function around it."""
    if this.cls is None:
        return None
    return next((c for c in run.names.ancestry(this.cls) if c.scope == frame.scope), this.cls)


def class_around(run: Machine, frame: Frame) -> Class | None:
    """The class whose method the code is, by what it says; ``None`` for any other code."""
    owner = frame.function.owner if frame.function is not None else ""
    return run.names.find_class(owner, frame.scope, frame.file) if owner else None


def seen_class(run: Machine, node: Node | None, frame: Frame) -> Class | None:
    """The class that an expression has, or points to, at compile time; ``None`` where that is not known."""
    kind = seen_type(run, node, frame)
    return run.class_of(kind, frame) if kind.name else None


def class_of_member(run: Machine, atom: Obj, name: str, access: Node, frame: Frame) -> Class | None:
    """The class in which ``x.name``, ``x->name`` or ``x.Base::name`` is looked up where ``x`` is ``atom``.

    A gap where a class hides ``name`` from another, and which of them ``x`` is at compile time is not known.
    """
    if atom.cls is None:
        return None
    head = text(field_of(access, "field")).rpartition("::")[0]
    if head:
        named = run.class_of(run.type_of(head, frame), frame)
        return next((c for c in run.names.ancestry(atom.cls) if c is named or c.name == head), atom.cls)
    if name not in hidden(run.names, atom.cls):
        return atom.cls
    argument = field_of(access, "argument")
    seen = seen_class(run, argument, frame)
    if seen is None:
        what = f"which {name} of {text(argument)[:40]} is meant is not known: a derived class hides it"
        run.gap(access, frame, what)
    return seen if seen in run.names.ancestry(atom.cls) else atom.cls


def seen_type(run: Machine, node: Node | None, frame: Frame) -> Type:
    """The type that an expression has at compile time; ``NO_TYPE`` where that is not known."""
    node = unwrapped(node)
    if node is None:
        return NO_TYPE
    if node.type == "pointer_expression":
        return seen_type(run, field_of(node, "argument"), frame)
    if node.type in ("compound_literal_expression", "new_expression", "cast_expression"):
        return run.type_of(text(field_of(node, "type")), frame)
    if node.type == "subscript_expression":
        return element_type(seen_type(run, field_of(node, "argument"), frame))
    if node.type == "this":
        return _of_this(run, frame)
    if node.type == "field_expression":
        return _of_member(run, node, frame)
    if node.type == "call_expression":
        return _of_call(run, node, frame)
    return _of_variable(run, node, frame)


def element_type(kind: Type) -> Type:
    """Of a container the type of its elements, of a map that of its values."""
    return kind.arguments[-1] if kind.arguments and kind.last != "array" else (*kind.arguments, NO_TYPE)[0]


def _of_this(run: Machine, frame: Frame) -> Type:
    outer: Frame | None = frame
    while outer is not None and outer.this is None:
        outer = outer.outer
    cls = lexical_class(run, outer.this, outer) if outer is not None and outer.this is not None else None
    return Type(cls.qualified) if cls is not None else NO_TYPE


def _of_member(run: Machine, node: Node, frame: Frame) -> Type:
    owner = seen_class(run, field_of(node, "argument"), frame)
    name = text(field_of(node, "field"))
    for each in run.names.ancestry(owner):
        if name in each.fields:
            kind = run.names.resolve(each.fields[name].type, each.scope, each.file)
            return kind._replace(pointer=kind.pointer or each.fields[name].pointer)
    return NO_TYPE


_KEEPS = frozenset(
    {"std::move", "std::ref", "std::cref", "std::as_const", "std::forward", "std::addressof", "move"}
)
GIVES_INNER = frozenset({"get", "lock", "value", "release"})
_GIVES_ELEMENT = frozenset({"at", "front", "back", "top"})


def _of_call(run: Machine, node: Node, frame: Frame) -> Type:
    callee = unwrapped(field_of(node, "function"))
    if callee is None:
        return NO_TYPE
    if callee.type == "field_expression":
        inner = seen_type(run, field_of(callee, "argument"), frame)
        name = callee_name(field_of(callee, "field") or callee)
        if name in GIVES_INNER | _GIVES_ELEMENT:
            return inner if name in GIVES_INNER else element_type(inner)
        return _returned(run, inner, name, frame)
    name, given = callee_name(callee), children(field_of(node, "arguments"))
    if name in _KEEPS and given:
        return seen_type(run, given[0], frame)
    if re.search(r"_cast$|(?:^|::)make_(?:shared|unique)$", name):
        return next((run.type_of(text(each), frame) for each in template_arguments(callee)), NO_TYPE)
    made = run.type_of(text(callee), frame)
    if run.class_of(made, frame) is not None:
        return made
    found = run.names.find_functions(name, frame.scope, frame.file)
    if len(found) == 1:
        return run.names.resolve(type_text(found[0].node), found[0].scope, found[0].file)
    return _returned(run, _of_this(run, frame), name, frame)


def _returned(run: Machine, kind: Type, name: str, frame: Frame) -> Type:
    cls = run.class_of(kind, frame) if kind.name else None
    methods = run.names.find_methods(cls, name)
    if len(methods) != 1:
        return NO_TYPE
    return run.names.resolve(type_text(methods[0].node), methods[0].scope, methods[0].file)


def _of_variable(run: Machine, node: Node, frame: Frame) -> Type:
    from nodl.infer.cpp.running.variables import declared_type

    kind, _ = declared_type(run, node, frame)
    if "auto" not in kind.name.split():
        return kind
    owner = frame.owner_of(text(node))
    around = owner.function.body if owner is not None and owner.function is not None else None
    return _initialised(run, text(node), around, frame) if around is not None else NO_TYPE


def _initialised(run: Machine, name: str, around: Node, frame: Frame) -> Type:
    """The type of an ``auto`` variable: that of its initial value, or of an element that a loop goes over."""
    found: set[Type] = set()
    for each in walk(around):
        if each.type == "declaration":
            values = [value for declared, value, *_ in declared_names(each) if declared == name]
            found |= {seen_type(run, value, frame) for value in values}
        elif each.type == "for_range_loop" and text(field_of(each, "declarator")).lstrip("& *") == name:
            found.add(element_type(seen_type(run, field_of(each, "right"), frame)))
    return found.pop() if len(found) == 1 else NO_TYPE
