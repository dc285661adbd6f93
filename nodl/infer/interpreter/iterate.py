"""What iterating over a value gives."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterator

from nodl.infer.interpreter import special
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.raising import Attempt, Raised
from nodl.infer.interpreter.run import Run
from nodl.infer.models import concrete
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
    NativeObject,
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
    if isinstance(atom, NativeObject):
        return _pulled_all(run, atom, node, frame)
    if isinstance(atom, Text):
        return Items(None, input_items(atom))
    if isinstance(atom, ClassValue):
        return enum_members(run, atom, node, frame)
    if isinstance(atom, Instance):
        if special.method(atom, "__iter__") or special.method(atom, "__getitem__"):
            return _of_program(run, atom, node, frame)
        iterator = run.call(run.attribute((atom,), "__iter__", node, frame), Arguments(), node, frame)
        if len(iterator) == 1 and isinstance(iterator[0], Sequence):
            return iterator[0].items
        return Items(None, ANY)
    if isinstance(atom, Unknown):
        return Items(None, (atom,))
    return Items(None, ANY)


def _pulled_all(run: Run, obj: NativeObject, node: ast.AST, frame: Frame) -> Items:
    found: list[Value] = []
    call = Call(Arguments(), node, frame)
    if concrete.is_usable(run, obj):
        run.state.pulled += 1
        try:
            for element in concrete.pulled(run, obj, call):
                found.append(element)
                run.spend(1)
                if len(found) > concrete.MAX_ELEMENTS:
                    raise concrete.NotConcrete
            return Items(tuple(found))
        except (concrete.NotConcrete, TypeError):
            pass
    return Items(None, join(join_all(found), lose(run, obj)))


def lose(run: Run, obj: NativeObject) -> Value:
    """What an iterator may give that cannot be followed any more."""
    result = concrete.lose(run, obj)
    if obj.fallback is not None:
        fallback, obj.fallback = obj.fallback, None
        return join(result, fallback())
    return result


def _of_program(run: Run, obj: Instance, node: ast.AST, frame: Frame) -> Items:
    """An iterable of the program: asked for its elements one by one while that is decided."""
    found: list[Value] = []
    try:
        for element in own_elements(run, obj, node, frame):
            found.append(element)
            run.turns -= 1
            if run.fuel <= 0:
                break
        else:
            return Items(tuple(found))
    except Undecided:
        pass
    iterator = run.call(run.attribute((obj,), "__iter__", node, frame), Arguments(), node, frame)
    following = run.attribute(iterator, "__next__", node, frame)
    run.register_callback(following, 0)
    return Items(None, join(join_all(found), ANY))


class Undecided(Exception):
    """Whether there is one more element is not known."""


def own_elements(run: Run, obj: Instance, node: ast.AST, frame: Frame) -> Iterator[Value]:
    """What ``__iter__`` and ``__next__`` (or ``__getitem__``) give, up to their ``StopIteration``."""
    iterator: Value = (obj,)
    if special.method(obj, "__iter__"):
        iterator = run.call(special.method(obj, "__iter__"), Arguments(), node, frame)
    atom = iterator[0] if len(iterator) == 1 else None
    if not isinstance(atom, Instance):
        items = elements(run, iterator, node, frame)
        if items.exact is None:
            raise Undecided
        yield from items.exact
        return
    yield from _asked(run, atom, obj is atom and not special.method(obj, "__iter__"), node, frame)


def _asked(run: Run, obj: Instance, by_index: bool, node: ast.AST, frame: Frame) -> Iterator[Value]:
    end = "builtins.IndexError" if by_index else "builtins.StopIteration"
    for index in itertools.count():
        attempt = Attempt(run, frame)
        try:
            following = special.method(obj, "__getitem__" if by_index else "__next__")
            found = run.call(following, Arguments([(index,)] if by_index else []), node, frame)
        except Raised as raised:
            attempt.end(run, frame)
            if end in raised.kinds and run.risks - attempt.risks <= 1:
                return
            raise Undecided from raised
        attempt.end(run, frame)
        if run.risks != attempt.risks or not found:
            raise Undecided
        yield found


def input_items(text: Text) -> Value:
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
