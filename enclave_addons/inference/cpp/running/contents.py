"""What values hold: nodes in them, copies of them, the items that a loop goes over; what is handed to unknown code."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from enclave_addons.inference.cpp.reading.declarations import Class, Function
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.reading.writes import writes_of
from enclave_addons.inference.cpp.running.launch_values import given_by_launch
from enclave_addons.inference.cpp.running.machine import Frame, Machine
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Group,
    Map,
    Obj,
    Param,
    Seq,
    Unknown,
    Value,
    join,
    literal,
    lost,
    unknown,
)
from enclave_addons.inference.cpp.syntax import Node


def nodes_in(value: Value) -> list[Obj]:
    """Return the nodes (or interfaces of nodes) that ``value`` may be or hold in plain containers."""
    found: list[Obj] = []
    for atom in value:
        if isinstance(atom, Obj) and atom.node is not None:
            found.append(atom)
        elif isinstance(atom, Seq | Group):
            found += [obj for item in atom.items for obj in nodes_in(item)]
    return found


def handed_over(
    run: Machine,
    whom: str,
    arguments: Sequence[Value],
    node: Node,
    frame: Frame,
    *,
    ignore: Obj | None = None,
) -> None:
    """Note that unknown code gets these values: a node among them is a gap, and callbacks may run from now on."""
    why = f"the node is handed to {whom}, which may make interfaces on it"
    for value in arguments:
        owner = next((obj for obj in nodes_in(value) if obj is not ignore), None)
        if owner is not None:
            run.gap(node, frame, why, owner.node)
    run.later(arguments, frame)
    if run.callbacks and not run.calls_back:
        run.store.others_run()


def copied(run: Machine, value: Value, node: Node, frame: Frame, cls: Class | None = None) -> Value:
    """Copy structures by value; nodes, pointers and all else stay who they are.

    Into an object of ``cls`` goes of a derived class what it has of ``cls`` (slicing), also from behind a pointer.
    """
    for atom in value:
        if isinstance(atom, Obj) and atom.cls is None and atom.node is None and not atom.heap:
            _shared_with_copy(run, atom)
    if not any(isinstance(atom, Obj) and atom.cls is not None and atom.node is None for atom in value):
        return value
    return tuple(_copy(run, atom, node, frame, cls) for atom in value)


def _shared_with_copy(run: Machine, atom: Obj) -> None:
    """Know nothing of the texts and numbers that members of a library's object hold, which stands for its copy, too."""
    atom.data["copied"] = True
    run.store.lose([(atom, name) for name in atom.data.get("written", ())], "a member that a copy has, too")


def _copy(run: Machine, atom: object, node: Node, frame: Frame, cls: Class | None) -> object:
    if not isinstance(atom, Obj) or atom.cls is None or atom.node is not None:
        return atom
    target = cls if cls is not None and cls in run.names.ancestry(atom.cls) else atom.cls
    if atom.heap and target is not cls:
        return atom
    ancestry = run.names.ancestry(target)
    own = [f for each in ancestry for f in run.names.methods[each].get(each.name, ()) if takes_another(f)]
    if any(map(run.makes_interfaces, own)):
        run.gap(node, frame, f"the constructor of {target.name} that copies or moves it is not followed here")
    cells = {(each, name): run.store.get((atom, name)) for each in ancestry for name in each.fields}
    kind = atom.type if target is atom.cls else Type(target.qualified)
    key = ("copy", atom, frame.file.file, node.start_byte, node.end_byte, frame.path, target)
    twin = run.obj(key, kind, cls=target, bindings=atom.bindings, foreign_base=atom.foreign_base)
    for (each, name), value in cells.items():
        if value is not None:
            taken = _member_copied(run, each, name, value, node, frame)
            run.store.set((twin, name), lost(taken, f"what {target.name} copies") if own else taken)
    for constructor in own:
        _forget_written(run, constructor)
    return twin


def _forget_written(run: Machine, constructor: Function) -> None:
    """Make unknown, by their names, what a constructor that copies or moves may write: also static members, globals."""
    code = [constructor.node, *(value for _, value in constructor.initialisers)]
    for name in sorted(frozenset[str]().union(*map(writes_of, code))):
        run.store.lose(run.store.named(name), f"what {constructor.name} copies")


def _member_copied(run: Machine, cls: Class, name: str, value: Value, node: Node, frame: Frame) -> Value:
    """Return a member as a copy has it: objects within are copied too, those that it points to are not."""
    field = cls.fields[name]
    kind = run.names.resolve(field.type, cls.scope, cls.file)
    if field.static or field.pointer or kind.pointer:
        return value
    if run.class_of(kind, cls) is not None:
        return copied(run, value, node, frame)
    return elements_copied(run, kind, value, node, frame)


def elements_copied(run: Machine, kind: Type, value: Value, node: Node, frame: Frame) -> Value:
    """Return a container of type ``kind`` as a copy has it: its elements are copied unless they are pointers."""
    if not kind.arguments or kind.arguments[-1].pointer:
        return value
    return tuple(_elements_copied(run, atom, node, frame) for atom in value)


def _elements_copied(run: Machine, atom: object, node: Node, frame: Frame) -> object:
    if isinstance(atom, Seq):
        return Seq(tuple(copied(run, item, node, frame) for item in atom.items), atom.open)
    if isinstance(atom, Map):
        return Map(tuple((key, copied(run, item, node, frame)) for key, item in atom.entries), atom.open)
    return atom


def takes_another(constructor: Function) -> bool:
    """Return whether it copies or moves an object of its class."""
    given = [each for each in constructor.parameters if each.default is None]
    words = re.findall(r"\w+", given[0].type) if len(given) == 1 else []
    return constructor.name in words and "&" in given[0].type


def overwrite(run: Machine, targets: Sequence[Obj], value: Value, node: Node, frame: Frame) -> None:
    """Run ``object = other``: it has the members of the other one then; or may have, of several objects."""
    others = [atom for atom in value if isinstance(atom, Obj) and atom.cls is not None]
    for target in targets:
        for each in run.names.ancestry(target.cls):
            for name in each.fields:
                cell = (target, name)
                held = join(*(run.store.get((other, name)) or BOTTOM for other in others))
                read = _member_copied(run, each, name, held, node, replace(frame, path=(*frame.path, target)))
                is_one = len(targets) == 1 and not target.several
                before = [] if is_one else [run.store.get(cell) or BOTTOM]
                run.store.set(cell, join(*before, read))


def iterated(run: Machine, subject: Value) -> tuple[list[Value], bool]:
    """Return what a loop over ``subject`` goes through, and whether that is exactly known."""
    if len(subject) == 1:
        items, exact = items_of(run, subject[0])
        return items, exact
    found = [item for atom in subject for item in items_of(run, atom)[0]]
    if any(isinstance(atom, Unknown) for item in found for atom in item):
        found = [join(*found)]
    return found or [unknown("an element of something that is not known")], False


def items_of(run: Machine, atom: object) -> tuple[list[Value], bool]:
    """Return items of a container or list parameter, and whether exactly these; one unknown item for all else."""
    if isinstance(atom, Seq):
        return list(atom.items), not atom.open
    if isinstance(atom, Map):
        # They stand as they were made, not by their keys.
        return [(Group(entry),) for entry in atom.entries], not atom.open and len(atom.entries) < 2
    if isinstance(atom, Group):
        return list(atom.items), True
    if isinstance(atom, Param):
        return parameter_items(run, atom)
    why = atom.why if isinstance(atom, Unknown) else "an element of something that is not known"
    return [unknown(why)], False


def parameter_items(run: Machine, atom: Param) -> tuple[list[Value], bool]:
    """Return the elements of a list that a parameter gives: those of the launch file, else of its default."""
    given = given_by_launch(run, atom.record, atom.name)
    if isinstance(given, list | tuple):
        return [(Param(atom.record, atom.name, i, literal(str(each))),) for i, each in enumerate(given)], True
    default = tuple(each for each in atom.default if isinstance(each, Seq) and not each.open)
    if default and len(default) == len(atom.default):
        longest = max(default, key=lambda each: len(each.items))
        if len(default) == 1:
            return [
                (Param(atom.record, atom.name, index, item),) for index, item in enumerate(longest.items)
            ], True
        return [item for each in default for item in each.items], False
    return [unknown(f"an element of parameter {atom.name}")], False
