"""Elements and slices: ``owner[key]``."""

from __future__ import annotations

import ast

from nodl.infer.interpreter import special
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.iterate import values_of
from nodl.infer.interpreter.raising import throw
from nodl.infer.interpreter.run import Run
from nodl.infer.methods import NativeMethod, Variables
from nodl.infer.text import Input, Text, make_text
from nodl.infer.values import (
    ANY,
    BOTTOM,
    NONE,
    OTHER,
    RESULT,
    ClassValue,
    Dictionary,
    External,
    Instance,
    Items,
    Key,
    NativeObject,
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
    """What ``owner[key]`` gives for each owner but ``None``; ``ANY`` when nothing comes of it."""
    owner = run.evaluate(node.value, frame)
    key = run.evaluate(node.slice, frame) if not isinstance(node.slice, ast.Slice) else ANY
    if isinstance(node.slice, ast.Slice) and not all(isinstance(a, str | Sequence) for a in owner):
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
            return _sliced(run, atom, node, frame)
        return _sequence_item(run, atom, key)
    if isinstance(atom, str):
        return _character(run, atom, key, node, frame)
    if isinstance(atom, Text):
        piece = atom.pieces[0]
        index = key[0] if len(key) == 1 else None
        if len(atom.pieces) == 1 and isinstance(piece, Input) and piece.item is None and type(index) is int:
            return (make_text((Input(piece.name, piece.owner, index, piece.edits),)),)
        return unknown("a part of a text that is not known")
    if isinstance(atom, NativeObject):
        call = Call(Arguments([key]), node, frame)
        return run.call_atom(NativeMethod(atom, "__getitem__"), call)
    if isinstance(atom, Variables):
        return variable(run, atom, key, node, frame)
    if isinstance(atom, Instance):
        getter = run.attribute((atom,), "__getitem__", node, frame)
        return run.call(getter, Arguments([key]), node, frame)
    if isinstance(atom, ClassValue):
        return _class_item(run, atom, key, node, frame)
    if isinstance(atom, External) and atom.path == "os.environ":
        return run.call(external("os.environ.get"), Arguments([key]), node, frame)
    if isinstance(atom, External):
        if atom.path.startswith(("typing.", "builtins.")) or atom.path.endswith(("[]", RESULT)):
            return (atom,)
        return external(f"{atom.path}[]")
    return (atom,) if isinstance(atom, Unknown) else ANY


def variable(run: Run, atom: Variables, key: Value, node: ast.AST, frame: Frame) -> Value:
    """``globals()[key]``, ``vars(x)[key]``."""
    result: Value = BOTTOM
    for name in key:
        if isinstance(name, str):
            result = join(result, present(atom.owner.cells.get(name, BOTTOM)))
            continue
        for value in atom.named().values():
            run.escape_value(value, opened=False)
        result = join(result, unknown("a variable whose name is made at run time"))
    return result or unknown("a variable that nothing analysed sets")


def _class_item(run: Run, cls: ClassValue, key: Value, node: ast.AST, frame: Frame) -> Value:
    names = [atom for atom in key if isinstance(atom, str)]
    if names and all(name in cls.cells for name in names):  # Enum["MEMBER"]
        return join_all(run.attribute((cls,), name, node, frame) for name in names)
    return (cls,)  # Generic[T]


def dictionary_item(run: Run, obj: Dictionary, key: Value, node: ast.AST, frame: Frame) -> Value:
    """What ``obj[key]`` gives; fills a ``defaultdict``. Raises ``Raised`` where a ``KeyError`` is certain."""
    result: Value = BOTTOM
    everything = False
    everywhere = not obj.escaped
    for atom in key:
        held, certain = obj.held(atom) if special.is_key(atom) else (BOTTOM, False)
        result = join(result, held)
        everywhere = everywhere and certain
        everything = everything or not (held or special.is_constant(atom))
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
    if not result and not everything and not obj.is_open and is_settled(run):
        throw(run, KeyError)
    if obj.escaped or not result:
        result = join(result, unknown("an element of a dictionary that is filled elsewhere"))
    return result


def is_settled(run: Run) -> bool:
    """Whether nothing else can have changed what is seen: no callback is waiting, nothing is repeated."""
    return not run.callbacks and not run.repeated


def _sequence_item(run: Run, sequence: Sequence, key: Value) -> Value:
    items = sequence.items
    if items.exact is None or sequence.escaped:
        return join(items.any_element(), ANY) if sequence.escaped else items.any_element() or ANY
    if all(type(index) is int for index in key):
        length = len(items.exact)
        result: Value = BOTTOM
        for index in key:
            if isinstance(index, int) and -length <= index < length:
                result = join(result, items.exact[index])
        if not result and is_settled(run):
            throw(run, IndexError)
        return result or ANY
    return items.any_element() or ANY


def _sliced(run: Run, sequence: Sequence, node: ast.Subscript, frame: Frame) -> Value:
    items = sequence.items
    bounds = slice_of(run, node.slice, frame)
    if items.exact is not None and bounds is not None and not sequence.escaped:
        return run.sequence(node, sequence.kind, Items(items.exact[bounds]))
    return run.sequence(node, sequence.kind, Items(None, items.any_element()))


def slice_of(run: Run, node: ast.expr, frame: Frame) -> slice | None:
    """The slice if its bounds are known."""
    assert isinstance(node, ast.Slice)
    bounds: list[int | None] = []
    for bound in (node.lower, node.upper, node.step):
        value = NONE if bound is None else run.evaluate(bound, frame)
        if len(value) != 1 or not isinstance(value[0], int | None):
            return None
        bounds.append(value[0])
    return slice(*bounds) if bounds[2] != 0 else None


def _character(run: Run, text: str, key: Value, node: ast.Subscript, frame: Frame) -> Value:
    if isinstance(node.slice, ast.Slice):
        bounds = slice_of(run, node.slice, frame)
        return (text[bounds],) if bounds is not None else unknown("a part of a text")
    index = key[0] if len(key) == 1 else None
    if type(index) is int and -len(text) <= index < len(text):
        return (text[index],)
    return unknown("a part of a text")
