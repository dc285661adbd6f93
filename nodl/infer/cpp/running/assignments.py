"""What is written where: to variables, members, elements of containers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodl.infer.cpp.running.contents import copied
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine, expression
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
    concatenated,
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
    from nodl.infer.cpp.running.operators import computed, has_text

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
        if has_text(before):
            value = concatenated(before, value)
        elif len(before) == 1 and len(value) == 1:
            value = computed("+", before[0], value[0])
        else:
            value = unknown("a computed value")
    else:
        value = unknown("a computed value")
    assign(run, left, value, frame)
    return value


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
