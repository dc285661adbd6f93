"""What a name or member holds: variables, members of objects, constants, what their declarations say."""

from __future__ import annotations

from collections.abc import Callable

from enclave_addons.inference.cpp.reading.declarations import Class
from enclave_addons.inference.cpp.running.constructors import declared_value
from enclave_addons.inference.cpp.running.machine import Frame, Machine
from enclave_addons.inference.cpp.running.memory import Cell
from enclave_addons.inference.cpp.running.static_types import current_object, static_by_name
from enclave_addons.inference.cpp.running.values import BOTTOM, Bound, Const, Obj, Value, unknown
from enclave_addons.inference.cpp.syntax import text


def variable(run: Machine, name: str, frame: Frame) -> Value:
    """Return the local variable, member, constant, enumerator or function of that name."""
    owner = frame.owner_of(name)
    if owner is not None:
        return run.store.get((owner, name)) or BOTTOM
    if name in frame.bindings:
        given = frame.bindings[name].name
        return (int(given),) if given.isdigit() else unknown(f"the argument {name} of a template")
    this_object = current_object(frame)
    if this_object is not None and "::" not in name:
        found = member(run, this_object, name)
        if found is not None:
            return found
    found = constant(run, name, frame)
    if found is not None:
        return found
    return unknown(f"the value of {name}")


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

    assert isinstance(cls, Class)
    cell = (cls, name)
    known = run.store.get(cell)
    if known is not None:
        return known
    declared = cls.fields[name]
    scope = (*cls.scope, cls.name)
    frame = Frame(cls.file, scope)
    defined = [g for g in run.names.globals.get(name, ()) if g.scope == cls.scope and g.value is not None]
    outside = defined[0] if defined else None
    if any(each.specialises for each in defined) or cls.qualified in run.names.doubts:
        found = unknown(f"the value of {name}, which several specialisations have")
    else:
        value = declared.default
        if value is None and outside is not None:
            value, frame = outside.value, Frame(outside.file, scope)
        found = _before_main(
            run,
            cell,
            lambda: declared_value(run, declared.node, declared.type, value, declared.pointer, frame),
        )
    run.store.set(cell, found)
    return found


def _before_main(run: Machine, cell: Cell, made: Callable[[], Value]) -> Value:
    """Return the initial value of a global or static member, which is made here when it is read first.

    C++ made it before ``main``: nothing is known of it if it is made of variables that changed since.
    """
    found: list[Value] = []
    earlier = set(run.initial)  # the others are made meanwhile
    reads = run.store.watched(lambda: found.append(made()))
    (value,) = found
    if any(other in earlier and held != run.initial[other] for other, held in reads.cells.items()):
        value = unknown("a variable that was made before main of one that changed since")
    run.initial[cell] = value
    return value


def constant(run: Machine, name: str, frame: Frame) -> Value | None:
    """Return the global, static member, enumerator or functions of that name; ``None`` if none is found."""
    static = static_by_name(run, name, frame)
    if static is not None:
        return static_member(run, *static)
    cell_owner = run.names.find_global(name, frame.scope, frame.file)
    if cell_owner is not None and "thread_local" in text(cell_owner.node).partition("=")[0]:
        return unknown(f"the value of {name}, which each thread has its own of")
    if cell_owner is not None:
        cell = (cell_owner, "")
        known = run.store.get(cell)
        if known is None:
            inner = Frame(cell_owner.file, cell_owner.scope, path=(name,))
            run.store.set(cell, BOTTOM)
            known = _before_main(
                run,
                cell,
                lambda: declared_value(
                    run, cell_owner.node, cell_owner.type, cell_owner.value, cell_owner.pointer, inner
                ),
            )
            run.store.set(cell, known)
        return known
    head, separator, last = name.rpartition("::")
    for key in (name, f"{head.rpartition('::')[2]}::{last}" if separator else name):
        full = run.names.enumerators.get(key)
        if full is not None:
            return (Const(full),)
    function = run.names.find_functions(name, frame.scope, frame.file)
    if function:
        return tuple(Bound(each, None) for each in function)
    return None
