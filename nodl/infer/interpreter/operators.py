"""Operators: ``+``, ``%``, arithmetic, unions."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable

from nodl.infer.interpreter import special
from nodl.infer.interpreter.assign import copy_dictionary
from nodl.infer.interpreter.formatting import as_texts, percent
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.raising import throw
from nodl.infer.interpreter.run import Run
from nodl.infer.models import concrete
from nodl.infer.text import Hole, Text, TextAtom, concatenate, concatenations, make_text
from nodl.infer.values import (
    ANY,
    BOTTOM,
    Dictionary,
    Instance,
    Items,
    NativeObject,
    Sequence,
    Unknown,
    Value,
    join,
    join_all,
    sole,
)

_ARITHMETIC: dict[type, Callable[[object, object], object]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
}
_NUMBERS = (int, float)
_LARGE = 1 << 40


def binary(run: Run, node: ast.BinOp, frame: Frame) -> Value:
    """Evaluate both sides, the left one first, and apply the operator."""
    left = run.evaluate(node.left, frame)
    right = run.evaluate(node.right, frame)
    return binary_operation(run, node, left, node.op, right, frame)


def binary_operation(
    run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value, frame: Frame
) -> Value:
    """``left op right``, by special methods of the program first; ``ANY`` where nothing is known."""
    if special.has_own(left) or special.has_own(right):
        defined = special.binary(run, left, op, right, node, frame)
        if defined:
            return defined
    if _holds(left, NativeObject) or _holds(right, NativeObject):
        return _native_binary(run, node, left, op, right, frame)
    containers = (Sequence, Dictionary)
    if len(left) == len(right) == 1 and isinstance(left[0], containers) and isinstance(right[0], containers):
        found = _container_operation(run, node, left, op, right, frame)
        if found is not None:
            return found
    if isinstance(op, ast.Add):
        return _add(run, node, left, right)
    if isinstance(op, ast.Mod) and any(isinstance(atom, str | Text) for atom in left):
        return percent(left, _spoken_operand(run, right, node, frame))
    if isinstance(op, ast.Div) and any(isinstance(atom, Instance) for atom in left):
        return ANY  # a path
    if type(op) in _ARITHMETIC and len(left) * len(right) <= 16:
        return _arithmetic(run, node, left, op, right)
    if isinstance(op, ast.BitOr):
        return join(left, right) if any(hasattr(atom, "cells") for atom in left) else ANY
    return ANY


def _holds(value: Value, kind: type) -> bool:
    for atom in value:  # noqa: SIM110 - asked at every operator
        if type(atom) is kind:
            return True
    return False


def _arithmetic(run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value) -> Value:
    result: Value = BOTTOM
    for a in left:
        for b in right:
            result = join(result, _arithmetic_atoms(run, node, a, op, b))
    return result or ANY


def _arithmetic_atoms(run: Run, node: ast.AST, a: object, op: ast.operator, b: object) -> Value:
    if isinstance(op, ast.Mult) and isinstance(a, Sequence) and isinstance(b, int):
        exact = a.items.exact
        if exact is not None and 0 <= len(exact) * b <= 64:
            return run.sequence(node, a.kind, Items(exact * b))
        return run.sequence(node, a.kind, Items(None, a.items.any_element()))
    if not (isinstance(a, _NUMBERS) and isinstance(b, _NUMBERS)):
        if isinstance(op, ast.Mult) and isinstance(a, str) and isinstance(b, int) and len(a) * b < 300:
            return (a * b,)
        return (b,) if isinstance(b, Unknown) else (a,) if isinstance(a, Unknown) else ANY
    if isinstance(op, ast.Pow | ast.LShift | ast.RShift) and (abs(a) > _LARGE or not 0 <= b <= 64):
        return ANY  # of any size
    try:
        result = _ARITHMETIC[type(op)](a, b)
    except (ArithmeticError, ValueError) as error:
        throw(run, type(error))
        return ANY
    except TypeError:
        return ANY
    return (result,) if isinstance(result, _NUMBERS) and abs(result) < _LARGE else ANY


def _add(run: Run, node: ast.AST, left: Value, right: Value) -> Value:
    if len(left) == 1 and len(right) == 1 and type(left[0]) is str and type(right[0]) is str:
        return (concatenate(left[0], right[0]),)
    texts_left = [atom for atom in left if isinstance(atom, str | Text)]
    texts_right = [atom for atom in right if isinstance(atom, str | Text)]
    sequences = [atom for atom in (*left, *right) if isinstance(atom, Sequence)]
    if sequences:
        return _added_sequences(run, node, left, right, sequences)
    if not texts_left and not texts_right:
        return _arithmetic(run, node, left, ast.Add(), right) if len(left) * len(right) <= 16 else ANY
    # One side is a text, so the sum is only defined where the other one is too.
    return tuple(
        concatenations([texts_left or as_texts(left), texts_right or as_texts(right)])
        if _pure(left) and _pure(right)
        else concatenations([_text_side(left), _text_side(right)])
    )


def _container_operation(
    run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value, frame: Frame
) -> Value | None:
    """Union, difference ... of sets, and ``|`` of dictionaries."""
    if isinstance(left[0], Dictionary) and isinstance(op, ast.BitOr):
        merged = run.allocate(node, "merged", Dictionary)
        copy_dictionary(run, merged, left)
        copy_dictionary(run, merged, right)
        return (merged,)
    if not isinstance(op, ast.BitOr | ast.BitAnd | ast.BitXor | ast.Sub):
        return None
    return concrete.compute(run, _ARITHMETIC[type(op)], Call(Arguments([left, right]), node, frame))


def _native_binary(
    run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value, frame: Frame
) -> Value:
    """A path divided by a text, for instance."""
    call = Call(Arguments([left, right]), node, frame)
    found = concrete.compute(run, _ARITHMETIC.get(type(op), operator.matmul), call)
    return found if found is not None else ANY


def _spoken_operand(run: Run, right: Value, node: ast.AST, frame: Frame) -> Value:
    """The right side of ``%`` with the program's objects as their texts."""
    atom = sole(right)
    if isinstance(atom, Sequence) and atom.kind == "tuple" and atom.items.exact is not None:
        return run.tuple_of(tuple(special.spoken(run, each, node, frame) for each in atom.items.exact))
    return special.spoken(run, right, node, frame)


def _pure(value: Value) -> bool:
    return not any(isinstance(atom, Unknown) for atom in value)


def _text_side(value: Value) -> list[TextAtom]:
    found: list[TextAtom] = []
    for atom in value:
        if isinstance(atom, str | Text):
            found.append(atom)
        elif isinstance(atom, Unknown):
            found.append(make_text((Hole(atom.why),)))
    return found or as_texts(value)


def _added_sequences(run: Run, node: ast.AST, left: Value, right: Value, sequences: list[Sequence]) -> Value:
    kind = sequences[0].kind
    if len(left) == len(right) == 1 and len(sequences) == 2:
        first, second = sequences[0].items, sequences[1].items
        if first.exact is not None and second.exact is not None and len(first.exact + second.exact) <= 256:
            return run.sequence(node, kind, Items(first.exact + second.exact))
    element = join_all(sequence.items.any_element() for sequence in sequences)
    if any(not isinstance(atom, Sequence) for atom in (*left, *right)):
        element = join(element, ANY)
    return run.sequence(node, kind, Items(None, element))
