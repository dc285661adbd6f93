"""What is written where: to variables, members, elements of containers."""

from __future__ import annotations

import re
from collections.abc import Sequence

from nodl.infer.cpp.libraries import LIBRARY_METHODS, Call
from nodl.infer.cpp.reading.declarations import Class, Field
from nodl.infer.cpp.running.arithmetic import added, as_type, computed
from nodl.infer.cpp.running.constructors import in_braces
from nodl.infer.cpp.running.contents import copied, elements_copied, overwrite
from nodl.infer.cpp.running.machine import Frame, Machine, expression
from nodl.infer.cpp.running.references import REFERRED_TO, is_plain, through
from nodl.infer.cpp.running.static_types import (
    TEXTS,
    WHOLE_NUMBERS,
    current_object,
    declared_type,
    is_pointer,
    points_to_plain,
    seen_class,
    seen_type,
    static_by_name,
)
from nodl.infer.cpp.running.values import (
    BOTTOM,
    Group,
    Map,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    as_one_map,
    has_text,
    join,
    open_sequence,
    plain,
    unknown,
)
from nodl.infer.cpp.running.variables import static_member
from nodl.infer.cpp.syntax import Node, children, field_of, text, unwrapped, walk
from nodl.name_template import UnknownPart


@expression("assignment_expression")
def assignment(run: Machine, node: Node, frame: Frame) -> Value:
    """Writes to the left side and gives what was written, before a number took the type of that side."""
    left, operator = field_of(node, "left"), text(field_of(node, "operator"))
    right = field_of(node, "right")
    if left is None:
        return BOTTOM
    if any(child.is_error for child in node.children):
        assign(run, left, unknown("what the parser did not understand"), frame)
        return run.evaluate(right, frame)
    if operator == "=" and right is not None and right.type == "initializer_list":
        value = in_braces(run, right, declared_type(run, left, frame)[0], frame)
    else:
        value = run.evaluate(right, frame)
    if operator == "=":
        cls = object_class(run, left, frame)
        before = run.evaluate(left, frame) if cls is not None else BOTTOM
        objects = bool(before) and all(isinstance(atom, Obj) and atom.cls is not None for atom in before)
        if objects and _assigned(run, before, value, node, frame):
            return before
        value = copied(run, value, node, frame, cls)
        if any(isinstance(atom, Seq | Map) for atom in value):
            value = elements_copied(run, seen_type(run, left, frame), value, node, frame)
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
    value_held = as_declared(run, left, value, frame)
    if operator == "=" and left.type == "identifier" and is_pointer(run, left, frame):
        _points_elsewhere(run, left, value_held, frame)
    else:
        assign(run, left, value_held, frame)
    return value


def _points_elsewhere(run: Machine, name: Node, value: Value, frame: Frame) -> None:
    """Run ``p = &x``: what a pointer to a plain value shows from now on is not known."""
    owner = frame.owner_of(text(name))
    if owner is not None and text(name) in owner.aliases:
        owner.aliases[text(name)] = None
        value = unknown(f"what {text(name)} points to")
    _assign_name(run, name, value, frame)


def _assigned(run: Machine, targets: Sequence[Obj], value: Value, node: Node, frame: Frame) -> bool:
    """Run ``object = value``, by the operator of its class, else member by member; return whether that
    could be done.
    """
    for target in targets:
        own = run.names.find_methods(target.cls, "operator=")
        if own:
            run.calls.call_methods(run, own, target, [value], node, frame, ())
        elif all(isinstance(atom, Obj) and atom.cls is not None for atom in value):
            overwrite(run, targets, value)
            break
        else:
            return False
    return True


def object_class(run: Machine, left: Node, frame: Frame) -> Class | None:
    """Return the class of what an object is assigned to; ``None`` if a pointer is assigned, or that is not known."""
    inner = unwrapped(left)
    if inner is None:
        return None
    if inner.type == "pointer_expression":
        return seen_class(run, inner, frame)
    if inner.type in ("subscript_expression", "field_expression"):
        return run.held_class(seen_type(run, inner, frame), frame)
    return None if is_pointer(run, inner, frame) else run.class_of(declared_type(run, inner, frame)[0], frame)


def _combined(operator: str, before: Value, value: Value) -> Value:
    if len(before) == 1 and len(value) == 1:
        return computed(operator, before[0], value[0])
    return unknown("a computed value")


def as_declared(run: Machine, left: Node, value: Value, frame: Frame) -> Value:
    """Return a number as the type of the variable holds it."""
    if not any(isinstance(atom, int | float | Text | Unknown) for atom in value):
        return value
    kind, pointer = declared_type(run, left, frame)
    return value if pointer else as_type(kind.name, value)


def assign(run: Machine, target: Node, value: Value, frame: Frame) -> None:
    """Write to a variable, a member, an element."""
    inner = unwrapped(target)
    if inner is None:
        return
    if inner.type in ("identifier", "field_identifier", "qualified_identifier"):
        _assign_name(run, inner, value, frame)
    elif inner.type == "field_expression":
        _assign_field(run, inner, value, frame)
    elif inner.type == "subscript_expression":
        _assign_element(run, inner, value, frame)
    elif inner.type == "pointer_expression":
        argument = field_of(inner, "argument")
        if argument is not None:
            _through_pointer(run, argument, value, frame)
            assign(run, argument, value, frame)
    elif inner.type == "call_expression":
        _assign_result(run, inner, value, frame)
    elif not inner.type.endswith("literal"):
        through(run, inner, frame)


def _assign_result(run: Machine, call: Node, value: Value, frame: Frame) -> None:
    """Run ``f() = x``: an option or element of a known library; else what is written is not known."""
    function = field_of(call, "function")
    if text(function) in ("std::tie", "tie"):
        for each in children(field_of(call, "arguments")):
            assign(run, each, unknown("what is taken apart"), frame)
        return
    if _TEMPORARY.match(text(call)):
        return
    name = text(field_of(function, "field"))
    owner = field_of(function, "argument")
    holders = run.evaluate(owner, frame) if owner is not None else BOTTOM
    models = [LIBRARY_METHODS.get((atom.type.name, name)) for atom in holders if isinstance(atom, Obj)]
    if models and all(models):
        for atom, model in zip(holders, models, strict=True):
            if model is not None:
                model(run, Call(call, frame, [value], receiver=atom))
    elif (
        owner is not None
        and name == "at"
        and holders
        and all(isinstance(atom, Seq | Map) for atom in holders)
    ):
        _write_element(run, call, owner, field_of(call, "arguments"), value, frame)
    elif _is_of_numbers(run, owner or function, frame):
        return
    elif any(isinstance(atom, Text | Seq | Map | Param) for atom in value) or _gives_reference(run, function):
        run.gap(call, frame, f"what {text(call)[:60]} = ... writes to is not known")


_TEMPORARY = re.compile(r"std::(?:string|vector<[^()]*>)\(")


def _is_of_numbers(run: Machine, target: Node | None, frame: Frame) -> bool:
    """Return whether it is an array of numbers, whose elements are never known: ``matrix(0, 0) = x``."""
    return target is not None and declared_type(run, target, frame)[0].name.startswith(_ARRAYS)


_ARRAYS = ("Eigen::", "cv::Mat", "casadi::", "xt::")


def _gives_reference(run: Machine, callee: Node | None) -> bool:
    """Return whether a function of the program gives a reference."""
    listed = run.names.functions_by_name.get(text(callee).partition("<")[0].rpartition("::")[2], ())
    declarators = [field_of(each.node, "declarator") for each in listed]
    return any(each is not None and each.type == "reference_declarator" for each in declarators)


def _through_pointer(run: Machine, pointer: Node, value: Value, frame: Frame) -> None:
    """Run ``*p = x`` where ``p`` is an iterator, or a pointer of which nobody knows to what."""
    kind, owner = declared_type(run, pointer, frame)[0], frame.owner_of(text(pointer))
    before = run.evaluate(pointer, frame)
    shared = "shared_ptr" in owner.types.get(text(pointer), "") if owner is not None else False
    by_operator = any(run.methods_of(atom, "operator*") for atom in before)
    if by_operator or REFERRED_TO in before or (shared and is_plain(value)):
        through(run, pointer, frame)
    if points_to_plain(run, pointer, frame, TEXTS) or (
        is_plain(value) and points_to_plain(run, pointer, frame, WHOLE_NUMBERS)
    ):
        through(run, pointer, frame)
    elif (
        owner is None
        and is_plain(value)
        and kind.name
        and not kind.pointer
        and is_pointer(run, pointer, frame)
    ):
        through(run, pointer, frame)  # a member
    if owner is None or text(pointer) in owner.aliases:
        return
    if owner.function is not None and any(p.name == text(pointer) for p in owner.function.parameters):
        return
    if is_plain(before) and is_plain(value) and set(before) != set(value):
        through(run, pointer, frame)
    elif not kind.pointer and not all(isinstance(atom, Obj) for atom in (*before, *value)):
        _element_written(run, pointer, frame)


def _element_written(run: Machine, iterator: Node, frame: Frame) -> None:
    """Forget what the containers hold that an iterator was made of: one of their elements is written."""
    owner = frame.owner_of(text(iterator))
    initial = owner.initial.get(text(iterator)) if owner is not None else None
    if owner is None or initial is None:
        return
    for each in walk(initial):
        held = run.evaluate(each, owner) if each.type == "identifier" else BOTTOM
        if is_plain(held):
            assign(run, each, join(held, unknown("what is written to an element")), owner)


def _assign_name(run: Machine, target: Node, value: Value, frame: Frame) -> None:
    name = text(target)
    owner = frame.owner_of(name)
    if owner is not None and name in owner.aliases:
        alias = owner.aliases[name]
        if alias is None:
            through(run, target, frame)
        else:
            assign(run, alias, value, owner)
            return
    if owner is not None:
        run.store.set((owner, name), value)
        return
    this_object = current_object(frame)
    around = this_object.cls if this_object is not None and "::" not in name else None
    declaring = next((each for each in run.names.ancestry(around) if name in each.fields), None)
    if this_object is not None and declaring is not None and not declaring.fields[name].static:
        if _writes_through(declaring.fields[name], value):
            through(run, target, frame)
        cell = (this_object, name)
        run.store.set(cell, join(run.store.get(cell) or BOTTOM, value) if this_object.several else value)
        return
    static = (declaring, name) if declaring is not None else static_by_name(run, name, frame)
    if static is not None:
        several = bool(static[0].templates)  # a variable of each specialisation
        run.store.set(static, join(static_member(run, *static), value) if several else value)
        return
    outside = run.names.find_global(name, frame.scope, frame.file)
    if outside is not None:
        run.store.set((outside, ""), value)
    elif this_object is not None:
        run.store.set((this_object, name), value)


def _writes_through(field: Field, value: Value) -> bool:
    """Return whether a plain value is written to what a member refers to."""
    refers = any(each.type == "reference_declarator" for each in field.node.named_children)
    return refers and any(not isinstance(atom, Obj) for atom in value)


def _assign_field(run: Machine, node: Node, value: Value, frame: Frame) -> None:
    owners = run.evaluate(field_of(node, "argument"), frame)
    operator = text(field_of(node, "operator"))
    if "*" in operator or node.has_error:
        through(run, node, frame)
    if operator == "->" and any(run.methods_of(atom, "operator->") for atom in owners):
        owners = run.calls.pointed_to(run, owners, "operator->", node, frame)
    name = text(field_of(node, "field")).rpartition("::")[2]
    objects = [atom for atom in owners if isinstance(atom, Obj)]
    if is_plain(value) and re.search(r"->second\.", text(node)) and not objects:
        through(run, node, frame)
    if any(isinstance(atom, Group) for atom in owners) and name in ("first", "second") and is_plain(value):
        through(run, node, frame)
    if any(not isinstance(atom, Obj) or atom.cls is None for atom in owners) or not owners:
        run.later([value], frame)  # a library keeps it and may call it
    for each in objects:
        declaring = next((cls for cls in run.names.ancestry(each.cls) if name in cls.fields), None)
        if declaring is not None and _writes_through(declaring.fields[name], value):
            through(run, node, frame)
        if each.cls is None and is_plain(value) and name not in (known := each.data.get("written", ())):
            each.data["written"] = (*known, name)
        strong = len(owners) == 1 and not each.several
        cell = (each, name)
        before = run.store.get(cell) or BOTTOM
        run.store.set(cell, value if strong else join(before, value))


def _assign_element(run: Machine, node: Node, value: Value, frame: Frame) -> None:
    container = field_of(node, "argument")
    if container is not None:
        _write_element(run, node, container, field_of(node, "indices"), value, frame)


def _write_element(
    run: Machine, node: Node, container: Node, indices: Node | None, value: Value, frame: Frame
) -> None:
    keys = [run.evaluate(child, frame) for child in children(indices)]
    found: list[Value] = []
    held = run.evaluate(container, frame)
    refers = is_plain(held) or REFERRED_TO in held
    if refers and is_plain(value) and points_to_plain(run, container, frame, _ANYTHING):
        through(run, node, frame)  # p[0] = x is *p = x
    for atom in held:
        if run.methods_of(atom, "operator[]"):
            through(run, node, frame)
        if isinstance(atom, Map) and keys:
            found.append((with_entry(atom, keys[0], value),))
        elif isinstance(atom, Seq):
            found.append((_with_item(atom, keys[0] if keys else BOTTOM, value),))
        elif isinstance(atom, Text | Param):
            found.append(unknown("a text of which a letter is written"))
        else:
            found.append((atom,))
    if found:
        assign(run, container, join(*found), frame)


_ANYTHING = re.compile("")


def with_entry(atom: Map, key: Value, value: Value) -> Map:
    """Run ``map[key] = value``: of a key that is certainly the same the entry is replaced."""
    certain = len(key) == 1 and not isinstance(key[0], Unknown) and _is_one_text(key[0])
    kept = tuple(entry for entry in atom.entries if not (certain and entry[0] == key))
    definite = len(key) == 1 and plain(key[0]) is not None
    return as_one_map((*kept, (key, value)), atom.open or not definite)


def _is_one_text(atom: object) -> bool:
    """Return whether it has the same value wherever it stands: a literal, a parameter, a text of those."""
    if isinstance(atom, Text):
        return not any(isinstance(part, UnknownPart) for part in atom.parts)
    return isinstance(atom, Param | bool | int | float)


def _with_item(atom: Seq, key: Value, value: Value) -> Seq:
    if len(key) == 1 and isinstance(key[0], int) and 0 <= key[0] < len(atom.items) and not atom.open:
        return Seq((*atom.items[: key[0]], value, *atom.items[key[0] + 1 :]))
    return open_sequence((*atom.items, value))
