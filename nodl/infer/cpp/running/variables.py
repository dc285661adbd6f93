"""What a name or member holds: variables, members of objects, constants, what their declarations say."""

from __future__ import annotations

import re

from nodl.infer.cpp.reading.declarations import Class
from nodl.infer.cpp.reading.type_names import NO_TYPE, Type
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.values import BOTTOM, NPOS, Bound, Const, Obj, Value, unknown
from nodl.infer.cpp.syntax import Node, children, text


def variable(run: Machine, name: str, frame: Frame) -> Value:
    """Return the local variable, member, constant, enumerator or function of that name."""
    owner = frame.owner_of(name)
    if owner is not None:
        target = owner.aliases.get(name)
        return run.evaluate(target, owner) if target is not None else run.store.get((owner, name)) or BOTTOM
    if name in frame.bindings:
        return _argument(run, frame.bindings[name].name, frame)
    this_object = current_object(frame)
    if this_object is not None and "::" not in name:
        found = member(run, this_object, name)
        if found is not None:
            return found
    found = constant(run, name, frame)
    if found is not None:
        return found
    if name.endswith("string::npos"):
        return (NPOS,)
    return unknown(f"the value of {name}")


def _argument(run: Machine, written: str, frame: Frame) -> Value:
    """Return a parameter of a template that stands for a value, as the argument is written."""
    if re.fullmatch(r"-?\d+", written):
        return (int(written),)
    if written in ("true", "false"):
        return (written == "true",)
    found = constant(run, written, frame) if re.fullmatch(r"[\w:]+", written) else None
    return found or unknown(f"the value of {written}")


def current_object(frame: Frame | None) -> Obj | None:
    """Return what ``this`` is, in a lambda that of the function around it; ``None`` outside of methods."""
    while frame is not None:
        if frame.this is not None:
            return frame.this
        frame = frame.outer
    return None


def member(run: Machine, owner: Obj, name: str, seen: Class | None = None) -> Value | None:
    """Return the field ``name`` of ``owner``, looked up in ``seen``; ``None`` if no class in reach has it."""
    value = run.store.get((owner, name))
    if value is not None:
        return value
    if owner.cls is None:
        return None
    for each in run.names.ancestry(seen or owner.cls):
        declared = each.fields.get(name)
        if declared is not None and declared.static:
            return static_member(run, each, name)
        if declared is not None:
            return BOTTOM
    return None


def static_member(run: Machine, cls: object, name: str) -> Value:
    """Return what a static field holds; its initial value when it is read first."""

    from nodl.infer.cpp.running.objects import default_value

    assert isinstance(cls, Class)
    cell = (cls, name)
    known = run.store.get(cell)
    if known is not None:
        return known
    declared = cls.fields[name]
    frame = Frame(cls.file, cls.scope)
    defined = [g for g in run.names.globals.get(name, ()) if g.scope == cls.scope and g.value is not None]
    outside = defined[0] if defined else None
    if any(each.specialises for each in defined):
        found = unknown(f"the value of {name}, which several specialisations have")
    elif declared.default is not None:
        found = _initial(run, declared.default, declared.type, frame)
    elif outside is not None:
        found = _initial(run, outside.value, declared.type, Frame(outside.file, cls.scope))
    else:
        kind = run.names.resolve(declared.type, cls.scope, cls.file)
        found = BOTTOM if declared.pointer or kind.pointer else default_value(run, declared.node, kind, frame)
    run.store.set(cell, found)
    return found


def _initial(run: Machine, value: Node | None, written: str, frame: Frame) -> Value:
    from nodl.infer.cpp.running.objects import made

    if value is not None and value.type in ("initializer_list", "argument_list"):
        return made(run, value, run.type_of(written, frame), children(value), frame)
    return run.evaluate(value, frame)


def constant(run: Machine, name: str, frame: Frame) -> Value | None:
    """Return the global, static member, enumerator or functions of that name; ``None`` if none is found."""
    from nodl.infer.cpp.running.objects import default_value

    static = static_by_name(run, name, frame)
    if static is not None:
        return static_member(run, *static)
    cell_owner = run.names.find_global(name, frame.scope, frame.file)
    if cell_owner is not None:
        cell = (cell_owner, "")
        known = run.store.get(cell)
        if known is None:
            inner = Frame(cell_owner.file, cell_owner.scope, path=(name,))
            run.store.set(cell, BOTTOM)
            kind = run.names.resolve(cell_owner.type, cell_owner.scope, cell_owner.file)
            if cell_owner.value is not None:
                known = _initial(run, cell_owner.value, cell_owner.type, inner)
            else:
                known = (
                    BOTTOM
                    if cell_owner.pointer or kind.pointer
                    else default_value(run, cell_owner.node, kind, inner)
                )
            run.store.set(cell, known)
        return known
    head, separator, last = name.rpartition("::")
    for key in (name, f"{head.rpartition('::')[2]}::{last}" if separator else name):
        full = run.names.enumerators.get(key)
        if full is not None:
            return (Const(full, run.names.enumerator_numbers.get(full)),)
    function = run.names.find_functions(name, frame.scope, frame.file)
    if function:
        return tuple(Bound(each, None) for each in function)
    return None


def static_by_name(run: Machine, name: str, frame: Frame) -> tuple[Class, str] | None:
    """Return the class that ``Foo::x`` is a static member of.

    Of ``x`` alone, if a class has one outside of its methods.
    """
    head, separator, last = name.rpartition("::")
    if separator:
        cls = run.class_of(run.type_of(head, frame), frame)
    else:
        cls = run.names.find_class("::".join(frame.scope), (), frame.file) if frame.scope else None
    for each in run.names.ancestry(cls):
        if last in each.fields and each.fields[last].static:
            return each, last
    return None


def declared_type(run: Machine, node: Node, frame: Frame) -> tuple[Type, bool]:
    """Return the declared type of a variable or member, ``NO_TYPE`` if not known.

    And whether it is a pointer, or as a local variable a reference.
    """
    name, this = text(node).removeprefix("this->"), current_object(frame)
    owner = frame.owner_of(name)
    if owner is not None:
        written = owner.types.get(name, "")
        kind = run.type_of(written, owner)
        return kind, kind.pointer or written.endswith(("&", "*"))
    ancestry, bindings = (run.names.ancestry(this.cls), this.bindings) if this is not None else ([], {})
    for each in ancestry:
        if name in each.fields:
            found = each.fields[name]
            kind = run.names.resolve(found.type, each.scope, each.file, bindings.get(each))
            return kind, found.pointer or kind.pointer
    outside = run.names.find_global(name, frame.scope, frame.file)
    if outside is None:
        return NO_TYPE, False
    kind = run.names.resolve(outside.type, outside.scope, outside.file)
    return kind, outside.pointer or kind.pointer


def is_pointer(run: Machine, node: Node, frame: Frame) -> bool:
    """Return whether a variable or member was declared as a pointer, and not as a reference."""
    kind, marked = declared_type(run, node, frame)
    return kind.pointer or (marked and not _is_reference(run, node, frame))


def _is_reference(run: Machine, node: Node, frame: Frame) -> bool:
    name, this = text(node), current_object(frame)
    owner = frame.owner_of(name)
    if owner is not None:
        return owner.types.get(name, "").endswith("&")
    ancestry = run.names.ancestry(this.cls) if this is not None else []
    declared = next((cls.fields[name].node for cls in ancestry if name in cls.fields), None)
    return "&" in text(declared).partition("=")[0]
