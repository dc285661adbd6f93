"""What iterating over a value gives."""

from __future__ import annotations

import ast

from nodl.infer.interpreter.frames import Frame
from nodl.infer.interpreter.run import Run
from nodl.infer.text import Input, Text, make_text
from nodl.infer.values import (
    ANY,
    BOTTOM,
    OTHER,
    OTHER_KEYS,
    ClassValue,
    Dictionary,
    Items,
    Sequence,
    Unknown,
    Value,
    join,
    join_all,
    present,
    unknown,
)


def elements(run: Run, value: Value, node: ast.AST, frame: Frame) -> Items:
    """The elements of every iterable that ``value`` may be; ``None`` among others is not iterable."""
    run.spend(len(value))
    found = [_elements_of(run, atom, node, frame) for atom in value if atom is not None]
    if not found:
        return Items(None, ANY)
    if len(found) == 1:
        return found[0]
    return Items(None, join_all(items.any_element() for items in found))


def _elements_of(run: Run, atom: object, node: ast.AST, frame: Frame) -> Items:
    if isinstance(atom, Sequence):
        items = atom.items
        if atom.escaped and atom.kind != "tuple":
            return Items(None, join(items.any_element(), ANY))
        return items
    if isinstance(atom, Dictionary):
        return keys_of(atom)
    if isinstance(atom, str):
        return Items(tuple((character,) for character in atom)) if len(atom) <= 256 else Items(None, ANY)
    if isinstance(atom, Text):
        return Items(None, _input_items(atom))
    if isinstance(atom, ClassValue):
        return enum_members(run, atom, node, frame)
    return Items(None, (atom,) if isinstance(atom, Unknown) else ANY)


def _input_items(text: Text) -> Value:
    """Each element of a parameter that holds a list."""
    piece = text.pieces[0]
    if len(text.pieces) == 1 and isinstance(piece, Input) and piece.item is None and not piece.edits:
        return (make_text((Input(piece.name, piece.owner, "each"),)),)
    return unknown("the characters of a text that is not known")


def keys_of(obj: Dictionary) -> Items:
    """The keys in order if all are known and certainly there; else what any key may be."""
    return _in_order(
        obj, tuple((cell.constant,) for cell, _, _ in obj.entries()), obj.cells.get(OTHER_KEYS, ANY)
    )


def values_of(obj: Dictionary) -> Items:
    """The values in the order of their keys if all are known and certainly there; else what any may be."""
    return _in_order(obj, tuple(value for _, value, _ in obj.entries()), obj.cells.get(OTHER, BOTTOM))


def _in_order(obj: Dictionary, known: tuple[Value, ...], others: Value) -> Items:
    if obj.is_open:
        result = join_all((present(others), *known))
        return Items(None, join(result, ANY) if obj.escaped else result)
    certain = all(certain for _, _, certain in obj.entries()) and not obj.summary
    return Items(known) if certain else Items(None, join_all(known))


def enum_members(run: Run, cls: ClassValue, node: ast.AST, frame: Frame) -> Items:
    """What iterating over an enumeration gives: each name assigned in its body; anything without one."""
    names = [
        target.id
        for statement in cls.node.body
        if isinstance(statement, ast.Assign)
        for target in statement.targets
        if isinstance(target, ast.Name)
    ]
    if not names:
        return Items(None, ANY)
    return Items(tuple(run.attribute((cls,), name, node, frame) for name in names))
