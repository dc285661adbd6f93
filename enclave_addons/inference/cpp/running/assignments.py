"""What is written where: to variables, members, elements of containers."""

from __future__ import annotations

import re
from collections.abc import Sequence

from enclave_addons.inference.cpp.libraries import LIBRARY_METHODS, Call
from enclave_addons.inference.cpp.reading.declarations import Class, Field
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.running.arithmetic import added, as_type, computed
from enclave_addons.inference.cpp.running.constructors import gives_pointer, in_braces, made_of
from enclave_addons.inference.cpp.running.contents import copied, elements_copied, overwrite
from enclave_addons.inference.cpp.running.effects import referred_to
from enclave_addons.inference.cpp.running.implicit_calls import called_unseen
from enclave_addons.inference.cpp.running.machine import Frame, Machine, expression
from enclave_addons.inference.cpp.running.references import (
    REFERRED_TO,
    forget,
    forget_everything,
    is_plain,
    leads_into,
    set_through,
    through,
)
from enclave_addons.inference.cpp.running.static_types import (
    current_object,
    declared_type,
    is_address,
    is_pointer,
    points_to_plain,
    seen_class,
    seen_type,
    static_by_name,
)
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Lambda,
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
    lost,
    open_sequence,
    plain,
    unknown,
)
from enclave_addons.inference.cpp.running.variables import static_member
from enclave_addons.inference.cpp.syntax import Node, children, field_of, last_name, text, unwrapped
from nodl.name_template import UnknownPart


@expression("assignment_expression")
def assignment(run: Machine, node: Node, frame: Frame) -> Value:
    """Writes to the left side and gives what was written, before a number took the type of that side."""
    left, operator = field_of(node, "left"), text(field_of(node, "operator"))
    right = field_of(node, "right")
    if left is None:
        return BOTTOM
    if (
        left.type == "conditional_expression"
    ):  # ``a ? b : c = d``, which the parser takes for ``(a ? b : c) = d``
        for each in (left, right):
            run.evaluate(each, frame)
        forget(run, left, frame, told=False)
        return unknown("one of two values of which the second is assigned")
    if any(child.is_error for child in node.children):
        assign(run, left, unknown("what the parser did not understand"), frame)
        return run.evaluate(right, frame)
    if operator == "=" and right is not None and right.type == "initializer_list":
        value = in_braces(run, right, declared_type(run, left, frame)[0], frame)
    else:
        value = run.evaluate(right, frame)
    if operator == "=":
        is_shown = is_address(run, left, frame) or gives_pointer(run, right or left)
        cls = object_class(run, left, frame) if not is_shown else None
        # A function of the program may make the variable that it gives.
        is_ours = last_name(field_of(left, "function")) in run.names.functions_by_name
        before = run.evaluate(left, frame) if cls is not None or is_ours else BOTTOM
        if cls is not None and not run.names.find_methods(cls, "operator="):
            of_other = made_of(run, Type(cls.qualified), value, node, frame)
            value = value if of_other is None else of_other
        objects = bool(before) and all(isinstance(atom, Obj) and atom.cls is not None for atom in before)
        if cls is not None and objects and _assigned(run, before, value, node, frame):
            return before
        if not is_shown:
            value = copied(run, value, node, frame, cls)
        if any(isinstance(atom, Seq | Map) for atom in value):
            value = elements_copied(run, seen_type(run, left, frame), value, node, frame)
    elif operator == "+=":
        before = run.evaluate(left, frame)
        if has_text(before) and any(isinstance(atom, int) for atom in value):
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
    """Run ``p = &x``: what a pointer to a plain value shows from now on is not known.

    A reference to a pointer stays bound to it.
    """
    owner = frame.owner_of(text(name))
    is_bound = owner is not None and owner.types.get(text(name), "").endswith("&")
    if owner is not None and text(name) in owner.references and not is_bound:
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
            overwrite(run, targets, value, node, frame)
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
    holder = frame.owner_of(text(inner))
    by_auto = holder is not None and re.search(r"\bauto ?&+$", holder.types.get(text(inner), "")) is not None
    if by_auto or inner.type in ("subscript_expression", "field_expression", "call_expression"):
        return run.held_class(seen_type(run, inner, frame), frame)
    return None if is_address(run, inner, frame) else run.class_of(declared_type(run, inner, frame)[0], frame)


def _combined(operator: str, before: Value, value: Value) -> Value:
    if len(before) == 1 and len(value) == 1:
        return computed(operator, before[0], value[0])
    return unknown("a computed value")


def as_declared(run: Machine, left: Node, value: Value, frame: Frame) -> Value:
    """Return a number as the type of the variable holds it."""
    if not any(isinstance(atom, int | Text | Unknown) for atom in value):
        return value
    kind = seen_type(run, left, frame)
    return value if kind.pointer or is_pointer(run, left, frame) else as_type(kind.name, value)


def assign(run: Machine, target: Node, value: Value, frame: Frame) -> None:
    """Write to a variable, a member, an element; what is written to anything else makes unknown what it leads to."""
    inner = unwrapped(target)
    if inner is None or inner.type.endswith("literal"):
        return
    if inner.type in ("identifier", "field_identifier", "qualified_identifier"):
        _assign_name(run, inner, value, frame)
    elif inner.type == "field_expression":
        _assign_field(run, inner, value, frame)
    elif inner.type == "subscript_expression":
        _write_element(
            run, inner, field_of(inner, "argument") or inner, field_of(inner, "indices"), value, frame
        )
    elif inner.type == "pointer_expression":
        pointer = unwrapped(field_of(inner, "argument")) or inner
        if pointer.type == "pointer_expression" and is_plain(value):  # ``**p = x``
            through(run, inner, frame)
        else:
            _through_pointer(run, pointer, value, frame)
    elif inner.type == "call_expression":
        _assign_result(run, inner, value, frame)
    else:
        forget(run, inner, frame, written=value)


def _assign_result(run: Machine, call: Node, value: Value, frame: Frame) -> None:
    """Run ``f() = x``: an option or element of a known library; else what it gives a reference to is not known."""
    function = field_of(call, "function")
    name, owner = text(field_of(function, "field")), field_of(function, "argument")
    holders = run.evaluate(owner, frame) if owner is not None else BOTTOM
    models = [LIBRARY_METHODS.get((atom.type.name, name)) for atom in holders if isinstance(atom, Obj)]
    if models and all(models):
        for atom, model in zip(holders, models, strict=True):
            if model is not None:
                model(run, Call(call, frame, [value], receiver=atom))
    elif owner is not None and name == "at" and any(isinstance(atom, Seq | Map) for atom in holders):
        _write_element(run, call, owner, field_of(call, "arguments"), value, frame)
    elif text(function).startswith("const_cast"):
        through(run, call, frame)
    elif owner is None and any(isinstance(atom, Lambda) for atom in run.evaluate(function, frame)):
        forget_everything(run, f"what {text(call)[:40]} refers to")
    elif (
        not all(isinstance(atom, Obj) for atom in value)
        or _gives_reference(run, function)
        or text(function) in ("std::tie", "tie")
    ):
        forget(run, call, frame, written=value, told=owner is not None or _gives_reference(run, function))


def _gives_reference(run: Machine, callee: Node | None) -> bool:
    """Return whether a function of the program gives a reference."""
    listed = run.names.functions_by_name.get(text(callee).partition("<")[0].rpartition("::")[2], ())
    return any(map(referred_to, listed))


def _through_pointer(run: Machine, pointer: Node, value: Value, frame: Frame) -> None:
    """Run ``*p = x``: ``p`` is the variable that it stands for, an optional or an argument; else it may be any."""
    name = text(pointer)
    before, owner = run.evaluate(pointer, frame), frame.owner_of(name)
    by_operator = any(run.methods_of(atom, "operator*") for atom in before)
    iterates = owner is not None and name not in owner.references and leads_into(owner.initial.get(name))
    is_elsewhere = any(isinstance(atom, Seq) and atom.place for atom in before) or (
        owner is not None and "shared_ptr" in owner.types.get(name, "") and is_plain(value)
    )
    if by_operator or iterates:
        forget(run, pointer, frame, written=value)
    elif REFERRED_TO in before or is_elsewhere or points_to_plain(run, pointer, frame, _ANYTHING):
        through(run, pointer, frame)
    elif not all(isinstance(atom, Obj) for atom in (*before, *value)) or not before:
        shared = _may_be_shared(run, pointer, frame)
        assign(run, pointer, lost(value, f"what {name} points to") if shared else value, frame)


def _may_be_shared(run: Machine, pointer: Node, frame: Frame) -> bool:
    """Return whether it is a smart pointer or of type ``auto``: others may point to the same text, too."""
    kind, _ = declared_type(run, pointer, frame)
    holder = frame.owner_of(text(pointer))
    written = holder.types.get(text(pointer), "") if holder is not None else ""
    return kind.name == "auto" or (kind.pointer and not written.endswith("*")) or "_ptr" in written


def _assign_name(run: Machine, target: Node, value: Value, frame: Frame) -> None:
    name = text(target)
    owner = frame.owner_of(name)
    if owner is not None and name in owner.references:
        set_through(run, target, value, frame)
    if owner is not None and owner.types.get(name, "").endswith("&"):
        called_unseen(run, [value])  # by the variable behind the reference
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
        why = f"the value of {name} in one of several classes"
        run.store.set(static, lost(join(static_member(run, *static), value), why) if several else value)
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
    """Write to a member of each object that it may be; of an unknown one to that of every object."""
    argument, operator = field_of(node, "argument"), text(field_of(node, "operator"))
    owners = run.evaluate(argument, frame)
    if "*" in operator or node.has_error:
        through(run, node, frame)
    if operator == "->":
        owners = run.calls.pointed_to(run, owners, "operator->", node, frame)
    name = text(field_of(node, "field")).rpartition("::")[2]
    objects = [atom for atom in owners if isinstance(atom, Obj)]
    for each in objects:
        declaring = next((cls for cls in run.names.ancestry(each.cls) if name in cls.fields), None)
        if declaring is not None and _writes_through(declaring.fields[name], value):
            through(run, node, frame)
        if each.cls is None and each.data.get("copied"):
            value = lost(value, "a member that a copy has, too")
        if each.cls is None and is_plain(value) and name not in (known := each.data.get("written", ())):
            each.data["written"] = (*known, name)
        if declaring is None and each.cls is not None and not each.foreign_base:  # of an anonymous union
            value = lost(value, f"what {text(node)[:40]} shares with others")
        strong = len(owners) == 1 and not each.several
        cell = (each, name)
        before = run.store.get(cell) or BOTTOM
        run.store.set(cell, value if strong else join(before, value))
    if not owners or any(not isinstance(atom, Obj) or atom.cls is None for atom in owners):
        run.later([value], frame)  # a library keeps it and may call it
    if len(objects) < len(owners) or not owners:
        _forget_members(run, node, argument, name, value, frame)


def _forget_members(
    run: Machine, node: Node, argument: Node | None, name: str, value: Value, frame: Frame
) -> None:
    """Run ``x.name = value`` where the object is not known: of whatever has such a member, it may be the one."""
    if argument is not None and name in ("first", "second"):
        forget(run, argument, frame, written=value)
    seen = seen_type(run, argument, frame)
    cls = run.class_of(seen, frame)
    if seen.name in ("", "auto") or cls is not None:
        for cell in run.store.named(name):
            before = run.store.get(cell) or BOTTOM
            if isinstance(cell[0], Obj) and cell[0].cls is not None and before:
                run.store.set(cell, join(lost(before, f"what is written to {text(node)[:40]}"), value))


def _write_element(
    run: Machine, node: Node, container: Node, indices: Node | None, value: Value, frame: Frame
) -> None:
    keys = [run.evaluate(child, frame) for child in children(indices)]
    held = run.evaluate(container, frame)
    refers = is_plain(held) or REFERRED_TO in held
    if refers and is_plain(value) and points_to_plain(run, container, frame, _ANYTHING):
        through(run, node, frame)  # p[0] = x is *p = x
    found: list[Value] = []
    for atom in held:
        if run.methods_of(atom, "operator[]"):
            forget(run, node, frame, written=value)
        if isinstance(atom, Map) and keys:
            found.append((with_entry(atom, keys[0], value),))
        elif isinstance(atom, Seq) and not atom.place:
            found.append((_with_item(atom, keys[0] if keys else BOTTOM, value),))
        elif isinstance(atom, Text | Param):
            found.append(unknown("a text of which a letter is written"))
        else:
            found.append((atom,))
    if any(isinstance(atom, Seq) and atom.place for atom in held):
        forget(run, container, frame, written=value)
    elif found:
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
    return isinstance(atom, Param | bool | int)


def _with_item(atom: Seq, key: Value, value: Value) -> Seq:
    if len(key) == 1 and isinstance(key[0], int) and 0 <= key[0] < len(atom.items) and not atom.open:
        return Seq((*atom.items[: key[0]], value, *atom.items[key[0] + 1 :]))
    return open_sequence((*atom.items, value))
