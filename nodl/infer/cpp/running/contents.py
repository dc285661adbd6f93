"""What values hold: nodes in them, copies of them, the items that a loop goes over; what is handed to unknown code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import (
    BOTTOM,
    Group,
    Map,
    Obj,
    Param,
    Seq,
    Unknown,
    Value,
    literal,
    unknown,
)

if TYPE_CHECKING:
    from tree_sitter import Node


def nodes_in(run: Machine, value: Value) -> list[Obj]:
    """The nodes (or interfaces of nodes) that ``value`` may be or hold in plain containers."""
    found: list[Obj] = []
    for atom in value:
        if isinstance(atom, Obj) and atom.node is not None:
            found.append(atom)
        elif isinstance(atom, Seq | Group):
            found += [obj for item in atom.items for obj in nodes_in(run, item)]
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
    """Somebody who is not known gets these values: a node among them is a gap, closures may be called at any time."""
    for value in arguments:
        for obj in nodes_in(run, value):
            if obj is not ignore and obj.node is not None:
                run.gap(
                    node, frame, f"the node is handed to {whom}, which may make interfaces on it", obj.node
                )
                break
        for atom in value:
            run.later(atom, frame)


def copied(run: Machine, value: Value, node: Node, frame: Frame) -> Value:
    """Structures are copied by value; nodes, pointers and all else stay who they are."""
    if not any(
        isinstance(atom, Obj) and not atom.heap and atom.cls is not None and atom.node is None
        for atom in value
    ):
        return value
    return tuple(_copy(run, atom, node, frame) for atom in value)


def _copy(run: Machine, atom: object, node: Node, frame: Frame) -> object:
    if not isinstance(atom, Obj) or atom.heap or atom.cls is None or atom.node is not None:
        return atom
    names = [name for each in run.names.ancestry(atom.cls) for name in each.fields]
    values = {name: run.store.get((atom, name)) for name in names}
    if any(nodes_in(run, value or BOTTOM) for value in values.values()):
        return atom
    key = ("copy", atom, frame.file.file, node.start_byte, frame.path)
    twin = run.obj(key, atom.type, cls=atom.cls, bindings=atom.bindings, foreign_base=atom.foreign_base)
    for name, value in values.items():
        if value is not None:
            run.store.set((twin, name), value)
    return twin


def iterated(run: Machine, subject: Value, node: Node, frame: Frame) -> tuple[list[Value], bool]:
    """What a loop over ``subject`` goes through; whether that is exactly known."""
    if len(subject) == 1:
        items, exact = items_of(run, subject[0])
        return items, exact
    found: list[Value] = []
    for atom in subject:
        found += items_of(run, atom)[0]
    return found or [unknown("an element of something that is not known")], False


def items_of(run: Machine, atom: object) -> tuple[list[Value], bool]:
    """Items of a container or list parameter, and whether exactly these; one unknown item for all else."""
    if isinstance(atom, Seq):
        return list(atom.items), not atom.open
    if isinstance(atom, Map):
        return [(Group(entry),) for entry in atom.entries], not atom.open
    if isinstance(atom, Group):
        return list(atom.items), True
    if isinstance(atom, Param):
        return parameter_items(run, atom)
    why = atom.why if isinstance(atom, Unknown) else "an element of something that is not known"
    return [unknown(why)], False


def parameter_items(run: Machine, atom: Param) -> tuple[list[Value], bool]:
    """The elements of a list that a parameter gives: those of the launch file, else of its default."""
    given = run.given(atom.record, atom.name)
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
