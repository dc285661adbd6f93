"""What iterating over a value gives."""

from __future__ import annotations

import ast

from nodl.infer.interpreter.run import Arguments, Frame, Run
from nodl.infer.text import Input, Text, make_text
from nodl.infer.values import (
    ANY,
    BOTTOM,
    OTHER,
    OTHER_KEYS,
    ClassValue,
    Dictionary,
    Instance,
    Items,
    Sequence,
    Unknown,
    Value,
    join,
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
    result: Value = BOTTOM
    for items in found:
        result = join(result, items.any_element())
    return Items(None, result)


def _elements_of(run: Run, atom: object, node: ast.AST, frame: Frame) -> Items:
    if isinstance(atom, Sequence):
        items = atom.items
        if atom.escaped and atom.kind != "tuple":
            return Items(None, join(items.any_element(), ANY))
        return items
    if isinstance(atom, Dictionary):
        return keys_of(atom)
    if isinstance(atom, str):
        return Items(tuple((character,) for character in atom)) if len(atom) <= 32 else Items(None, ANY)
    if isinstance(atom, Text):
        return Items(None, input_items(atom))
    if isinstance(atom, ClassValue):
        return enum_members(run, atom, node, frame)
    if isinstance(atom, Instance):
        iterator = run.call(run.attribute((atom,), "__iter__", node, frame), Arguments(), node, frame)
        if len(iterator) == 1 and isinstance(iterator[0], Sequence):
            return iterator[0].items
        return Items(None, ANY)
    if isinstance(atom, Unknown):
        return Items(None, (atom,))
    return Items(None, ANY)


def input_items(text: Text) -> Value:
    """Each element of a parameter that holds a list."""
    piece = text.pieces[0]
    if len(text.pieces) == 1 and isinstance(piece, Input) and piece.item is None and not piece.edits:
        return (make_text((Input(piece.name, piece.owner, "each"),)),)
    return unknown("the characters of a text that is not known")


def keys_of(obj: Dictionary) -> Items:
    entries = obj.entries()
    keys = tuple((cell.constant,) for cell, _, _ in entries)
    if obj.is_open:
        result = present(obj.cells.get(OTHER_KEYS, ANY))
        for key in keys:
            result = join(result, key)
        return Items(None, join(result, ANY) if obj.escaped else result)
    certain = all(certain for _, _, certain in entries) and not obj.summary
    return Items(keys) if certain else Items(None, Items(keys).any_element())


def values_of(obj: Dictionary) -> Items:
    entries = obj.entries()
    values = tuple(value for _, value, _ in entries)
    if obj.is_open:
        result = present(obj.cells.get(OTHER, BOTTOM))
        for value in values:
            result = join(result, value)
        return Items(None, join(result, ANY) if obj.escaped else result)
    certain = all(certain for _, _, certain in entries) and not obj.summary
    return Items(values) if certain else Items(None, Items(values).any_element())


def enum_members(run: Run, cls: ClassValue, node: ast.AST, frame: Frame) -> Items:
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
