"""What iterating over a value and ``owner[key]`` give."""

from __future__ import annotations

import ast

from nodl.infer.interpreter.conditions import is_plain_parameter, only_if
from nodl.infer.interpreter.define import is_constant, is_enumeration, is_key
from nodl.infer.interpreter.frames import Arguments, Frame
from nodl.infer.interpreter.run import Run
from nodl.infer.text import Input, Text, input_of, make_text
from nodl.infer.values import (
    ANY,
    BOTTOM,
    OTHER,
    OTHER_KEYS,
    RESULT,
    ClassValue,
    Dictionary,
    External,
    Items,
    Key,
    Sequence,
    Unknown,
    Value,
    external,
    join,
    join_all,
    present,
    unknown,
)


def subscript(run: Run, node: ast.Subscript, frame: Frame) -> Value:
    """Return what ``owner[key]`` gives for each owner but ``None``; ``ANY`` when nothing comes of it."""
    owner = run.evaluate(node.value, frame)
    key = run.evaluate(node.slice, frame) if not isinstance(node.slice, ast.Slice) else ANY
    if isinstance(node.slice, ast.Slice):
        for bound in (node.slice.lower, node.slice.upper, node.slice.step):
            if bound is not None:
                run.evaluate(bound, frame)
    result: Value = BOTTOM
    for atom in owner:
        if atom is not None:
            result = join(result, _element(run, atom, key, node, frame))
    return result or ANY


def _element(run: Run, atom: object, key: Value, node: ast.Subscript, frame: Frame) -> Value:
    if isinstance(atom, Dictionary):
        return dictionary_item(run, atom, key, node, frame)
    if isinstance(atom, Sequence):
        if isinstance(node.slice, ast.Slice):
            return _sliced(run, atom, node)
        return _sequence_item(run, atom, key)
    if isinstance(atom, str):
        return _character(atom, key)
    if isinstance(atom, Text):
        piece = atom.pieces[0]
        index = key[0] if len(key) == 1 else None
        if len(atom.pieces) == 1 and isinstance(piece, Input) and piece.item is None and type(index) is int:
            return (make_text((Input(piece.name, piece.owner, index, piece.edits),)),)
        return unknown("a part of a text that is not known")
    if isinstance(atom, ClassValue):
        return ANY if is_enumeration(atom) else (atom,)  # Generic[T]
    if isinstance(atom, External) and atom.path == "os.environ":
        return run.call(external("os.environ.get"), Arguments([key]), node, frame)
    if isinstance(atom, External):
        if atom.path.startswith(("typing.", "builtins.")) or atom.path.endswith(("[]", RESULT)):
            return (atom,)
        return external(f"{atom.path}[]")
    return (atom,) if isinstance(atom, Unknown) else ANY


def chosen_by_parameter(obj: Dictionary, key: Value, default: Value | None = None) -> Value | None:
    """Return the texts of a dictionary, each if the parameter that is the ``key`` says so.

    ``default``: what is taken for any other value. ``None``: not such a look-up.
    """
    asked = input_of(key[0]) if len(key) == 1 else None
    if asked is None or not is_plain_parameter(asked) or obj.is_open or obj.default:
        return None
    found: list[object] = []
    keys: list[str] = []
    for cell, value, certain in obj.entries():
        text = value[0] if len(value) == 1 else None
        if not certain or type(cell.constant) is not str or not isinstance(text, str | Text):
            return None
        keys.append(cell.constant)
        found.append(only_if((asked, "only if equal", (cell.constant,)), text))
    for other in default or ():
        if not isinstance(other, str | Text):
            return None
        found.append(only_if((asked, "only if not among", tuple(keys)), other))
    return tuple(found) or None


def dictionary_item(run: Run, obj: Dictionary, key: Value, node: ast.AST, frame: Frame) -> Value:
    """Return what ``obj[key]`` gives; fills a ``defaultdict``."""
    chosen = chosen_by_parameter(obj, key)
    if chosen is not None:
        return chosen
    result: Value = BOTTOM
    everything = False
    everywhere = not obj.escaped
    for atom in key:
        held, certain = obj.held(atom) if is_key(atom) else (BOTTOM, False)
        result = join(result, held)
        everywhere = everywhere and certain
        everything = everything or not (held or is_constant(atom))
    if everything:
        run.spend(len(obj.cells))
        result = join(result, values_of(obj).any_element())
        everywhere = False
    result = join(result, present(obj.cells.get(OTHER, BOTTOM)))
    if obj.default and not everywhere:
        made = run.call(obj.default, Arguments(), node, frame)
        for atom in key:
            if isinstance(atom, str | int):
                old = obj.held(atom)[0]
                run.state.write(obj.cells, Key(atom), join(old, made))
        result = join(result, made)
    if obj.escaped or not result:
        result = join(result, unknown("an element of a dictionary that is filled elsewhere"))
    return result


def _sequence_item(run: Run, sequence: Sequence, key: Value) -> Value:
    items = sequence.items
    if items.exact is None or sequence.escaped:
        found = items.any_element()
        one_of_several = len(found) > 1 and all(type(index) is int for index in key)
        return join(found, ANY) if sequence.escaped or one_of_several else found or ANY
    if all(type(index) is int for index in key):
        length = len(items.exact)
        result: Value = BOTTOM
        for index in key:
            if isinstance(index, int) and -length <= index < length:
                result = join(result, items.exact[index])
        return result or ANY
    return items.any_element() or ANY


def _sliced(run: Run, sequence: Sequence, node: ast.AST) -> Value:
    """Return some of the elements; nobody knows which."""
    found = sequence.items.any_element()
    return run.sequence(node, sequence.kind, Items(None, join(found, ANY) if len(found) > 1 else found))


def _character(text: str, key: Value) -> Value:
    index = key[0] if len(key) == 1 else None
    if type(index) is int and -len(text) <= index < len(text):
        return (text[index],)
    return unknown("a part of a text")


def elements(run: Run, value: Value, node: ast.AST, frame: Frame) -> Items:
    """Return the elements of every iterable that ``value`` may be; ``None`` among others is not iterable."""
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
    return Items(None, (atom,) if isinstance(atom, Unknown) else ANY)


def _input_items(text: Text) -> Value:
    """Return each element of a parameter that holds a list."""
    piece = text.pieces[0]
    if len(text.pieces) == 1 and isinstance(piece, Input) and piece.item is None and not piece.edits:
        return (make_text((Input(piece.name, piece.owner, "each"),)),)
    return unknown("the characters of a text that is not known")


def keys_of(obj: Dictionary) -> Items:
    """Return the keys in order if all are known and certainly there; else what any key may be."""
    return _in_order(
        obj, tuple((cell.constant,) for cell, _, _ in obj.entries()), obj.cells.get(OTHER_KEYS, ANY)
    )


def values_of(obj: Dictionary) -> Items:
    """Return the values in the order of their keys if all are known and certainly there; else what any may be."""
    return _in_order(obj, tuple(value for _, value, _ in obj.entries()), obj.cells.get(OTHER, BOTTOM))


def _in_order(obj: Dictionary, known: tuple[Value, ...], others: Value) -> Items:
    if obj.is_open:
        result = join_all((present(others), *known))
        return Items(None, join(result, ANY) if obj.escaped else result)
    certain = all(certain for _, _, certain in obj.entries()) and not obj.summary
    return Items(known) if certain else Items(None, join_all(known))
