"""Operators: ``+``, ``%``, arithmetic, unions."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable

from nodl.infer.interpreter.formatting import as_texts, percent
from nodl.infer.interpreter.frames import Frame
from nodl.infer.interpreter.run import Run
from nodl.infer.text import Hole, Text, TextAtom, concatenate, concatenations, make_text
from nodl.infer.values import (
    ANY,
    BOTTOM,
    ClassValue,
    Dictionary,
    Instance,
    Items,
    Sequence,
    Unknown,
    Value,
    join,
    join_all,
)

_ARITHMETIC: dict[type, Callable[[object, object], object]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
}
_COMBINING = (ast.BitOr, ast.BitAnd, ast.BitXor, ast.Sub)
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
    """Evaluate ``left op right``; ``ANY`` if nothing is known."""
    if _has_own(left) or _has_own(right):
        return ANY  # by a special method, which is called from outside
    if isinstance(op, ast.Add):
        return _add(run, node, left, right)
    if isinstance(op, ast.Mod) and any(isinstance(atom, str | Text) for atom in left):
        return percent(left, right)
    if type(op) in _COMBINING and any(isinstance(atom, Sequence | Dictionary) for atom in (*left, *right)):
        run.escape_value((*left, *right))  # dictionaries or sets: what is in them may be called
        return ANY
    if type(op) in _ARITHMETIC and len(left) * len(right) <= 16:
        return _arithmetic(run, node, left, op, right)
    return ANY


def _has_own(value: Value) -> bool:
    """Return True if ``value`` may be an object of one of the program's classes."""
    for atom in value:  # noqa: SIM110 - asked at every operator; a generator takes three times as long
        if type(atom) is Instance and type(atom.cls) is ClassValue:
            return True
    return False


def _arithmetic(run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value) -> Value:
    result: Value = BOTTOM
    for a in left:
        for b in right:
            result = join(result, _arithmetic_atoms(run, node, a, op, b))
    return result or ANY


def _arithmetic_atoms(run: Run, node: ast.AST, a: object, op: ast.operator, b: object) -> Value:
    if isinstance(op, ast.Mult) and isinstance(a, Sequence):
        return run.sequence(node, a.kind, Items(None, a.items.any_element()))
    if isinstance(a, _NUMBERS) and isinstance(b, _NUMBERS) and max(abs(a), abs(b)) < _LARGE:
        result = _ARITHMETIC[type(op)](a, b)
        return (result,) if isinstance(result, _NUMBERS) else ANY
    return (b,) if isinstance(b, Unknown) else (a,) if isinstance(a, Unknown) else ANY


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
    element = join_all(sequence.items.any_element() for sequence in sequences)
    if any(not isinstance(atom, Sequence) for atom in (*left, *right)):
        element = join(element, ANY)
    return run.sequence(node, sequences[0].kind, Items(None, element))
