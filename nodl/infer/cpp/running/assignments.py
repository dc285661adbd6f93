"""What is written where: to variables, members, elements of containers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodl.infer.cpp.running.contents import copied
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine, expression
from nodl.infer.cpp.running.numbers import added, as_type
from nodl.infer.cpp.running.values import (
    BOTTOM,
    Map,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    as_one_map,
    join,
    open_sequence,
    plain,
    unknown,
)
from nodl.infer.cpp.running.variables import current_object, declared_type
from nodl.infer.cpp.syntax import children, text, unwrapped
from nodl.name_template import UnknownPart

if TYPE_CHECKING:
    from tree_sitter import Node


@expression("assignment_expression")
def assignment(run: Machine, node: Node, frame: Frame) -> Value:
    """Writes to the left side and gives what was written, before a number took the type of that side."""
    from nodl.infer.cpp.running.operators import has_text

    left, operator = node.child_by_field_name("left"), text(node.child_by_field_name("operator"))
    right = node.child_by_field_name("right")
    if left is None:
        return BOTTOM
    if operator == "=" and right is not None and right.type == "initializer_list":
        value = _braced(run, left, right, frame)
    else:
        value = run.evaluate(right, frame)
    if operator == "=":
        value = copied(run, value, node, frame)
    elif operator == "+=":
        before = run.evaluate(left, frame)
        if has_text(before) and any(isinstance(atom, int | float) for atom in value):
            value = unknown("a text and a letter, or a text from some letter on")
        elif has_text(before):
            value = added(before, value)
        else:
            value = _combined("+", before, value)
    else:
        value = _combined(operator[:-1], run.evaluate(left, frame), value)
    assign(run, left, _as_declared(run, left, value, frame), frame)
    return value


def _combined(operator: str, before: Value, value: Value) -> Value:
    from nodl.infer.cpp.running.operators import computed

    if len(before) == 1 and len(value) == 1:
        return computed(operator, before[0], value[0])
    return unknown("a computed value")


def _as_declared(run: Machine, left: Node, value: Value, frame: Frame) -> Value:
    """A number as the type of the variable holds it."""
    if not any(isinstance(atom, int | float) for atom in value):
        return value
    written = declared_type(run, left, frame)
    return value if written is None or written[1] else as_type(written[0].name, value)


def _braced(run: Machine, left: Node, right: Node, frame: Frame) -> Value:
    """``x = {...}``: of the type of x where that is known."""
    from nodl.infer.cpp.running.objects import made

    written = declared_type(run, left, frame)
    if written is not None and written[0].name:
        return made(run, right, written[0], children(right), frame)
    return run.evaluate(right, frame)


def assign(run: Machine, target: Node, value: Value, frame: Frame) -> None:
    """Write to a variable, a member, an element."""
    inner = unwrapped(target)
    if inner is None:
        return
    if inner.type in ("identifier", "field_identifier", "qualified_identifier"):
        _assign_name(run, text(inner), value, frame)
    elif inner.type == "field_expression":
        _assign_field(run, inner, value, frame)
    elif inner.type == "subscript_expression":
        _assign_element(run, inner, value, frame)
    elif inner.type == "pointer_expression":
        argument = inner.child_by_field_name("argument")
        if argument is not None:
            assign(run, argument, value, frame)
    elif inner.type == "conditional_expression":
        for side in ("consequence", "alternative"):
            target_side = inner.child_by_field_name(side)
            if target_side is not None:
                assign(run, target_side, join(run.evaluate(target_side, frame), value), frame)
    elif inner.type == "call_expression":
        _assign_result(run, inner, value, frame)


def _assign_result(run: Machine, call: Node, value: Value, frame: Frame) -> None:
    """``f() = x``: an option or element of a known library; else what is written is not known."""
    from nodl.infer.cpp.libraries import LIBRARY_METHODS, Call

    function = call.child_by_field_name("function")
    name = text(function.child_by_field_name("field")) if function is not None else ""
    owner = function.child_by_field_name("argument") if function is not None else None
    holders = run.evaluate(owner, frame) if owner is not None else BOTTOM
    models = [LIBRARY_METHODS.get((atom.type.name, name)) for atom in holders if isinstance(atom, Obj)]
    if models and all(models):
        for atom, model in zip(holders, models, strict=True):
            if model is not None:
                model(run, Call(call, frame, [value], (), (), atom))
    elif owner is not None and name in ("at", "front", "back") and holders:
        assign(run, owner, tuple(_one_of(atom, value) for atom in holders), frame)
    elif any(isinstance(atom, Text | Seq | Map | Param) for atom in value):
        run.gap(call, frame, f"what {text(call)[:60]} = ... writes to is not known")


def _one_of(atom: object, value: Value) -> object:
    """A container one of whose elements is written."""
    if isinstance(atom, Seq):
        return open_sequence((*atom.items, value))
    return atom._replace(open=True) if isinstance(atom, Map) else Unknown("a text whose letters are written")


def _assign_name(run: Machine, name: str, value: Value, frame: Frame) -> None:
    owner = frame.owner_of(name)
    if owner is not None:
        run.store.set((owner, name), value)
        return
    this_object = current_object(frame)
    if this_object is not None and "::" not in name:
        for each in run.names.ancestry(this_object.cls) if this_object.cls is not None else ():
            if name in each.fields:
                run.store.set((each if each.fields[name].static else this_object, name), value)
                return
    outside = run.names.find_global(name, frame.scope, frame.file)
    if outside is not None:
        run.store.set((outside, ""), value)
    elif this_object is not None:
        run.store.set((this_object, name), value)


def _assign_field(run: Machine, node: Node, value: Value, frame: Frame) -> None:
    owners = run.evaluate(node.child_by_field_name("argument"), frame)
    name = text(node.child_by_field_name("field"))
    objects = [atom for atom in owners if isinstance(atom, Obj)]
    if any(not isinstance(atom, Obj) or atom.cls is None for atom in owners) or not owners:
        for atom in value:  # a library keeps it and may call it
            run.later(atom, frame)
    for each in objects:
        strong = len(owners) == 1
        before = run.store.get((each, name)) or BOTTOM
        run.store.set((each, name), value if strong else join(before, value))


def _assign_element(run: Machine, node: Node, value: Value, frame: Frame) -> None:
    container = node.child_by_field_name("argument")
    keys = [run.evaluate(child, frame) for child in children(node.child_by_field_name("indices"))]
    if container is None:
        return
    found: list[Value] = []
    for atom in run.evaluate(container, frame):
        if isinstance(atom, Map) and keys:
            found.append((with_entry(atom, keys[0], value),))
        elif isinstance(atom, Seq):
            found.append((_with_item(atom, keys[0] if keys else BOTTOM, value),))
        else:
            found.append((atom,))
    if found:
        assign(run, container, join(*found), frame)


def with_entry(atom: Map, key: Value, value: Value) -> Map:
    """``map[key] = value``: of a key that is certainly the same the entry is replaced."""
    certain = len(key) == 1 and not isinstance(key[0], Unknown) and _is_one_text(key[0])
    kept = tuple(entry for entry in atom.entries if not (certain and entry[0] == key))
    definite = len(key) == 1 and plain(key[0]) is not None
    return as_one_map((*kept, (key, value)), atom.open or not definite)


def _is_one_text(atom: object) -> bool:
    """Whether it has the same value wherever it stands: a literal, a parameter, a text of those."""
    if isinstance(atom, Text):
        return not any(isinstance(part, UnknownPart) for part in atom.parts)
    return isinstance(atom, Param | bool | int | float)


def _with_item(atom: Seq, key: Value, value: Value) -> Seq:
    if len(key) == 1 and isinstance(key[0], int) and 0 <= key[0] < len(atom.items) and not atom.open:
        return Seq((*atom.items[: key[0]], value, *atom.items[key[0] + 1 :]))
    return open_sequence((*atom.items, value))
