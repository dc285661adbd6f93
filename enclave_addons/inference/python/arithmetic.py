"""Operators: numbers and texts are computed, lists and dictionaries joined."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from typing import Any

from enclave_addons.inference.kernel.texts import AnyText, Text, concatenations
from enclave_addons.inference.kernel.values import ANY, OF_LAUNCH, Items, Obj, Value, join, join_all, sole
from enclave_addons.inference.python.containers import elements, fill
from enclave_addons.inference.python.formatting import as_texts, percent, text_value
from enclave_addons.inference.python.run import MAX_EXACT, Run

_ARITHMETIC: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
}
_LARGEST = 10**9


def binary(run: Run, op: ast.operator, left: Value, right: Value, node: ast.AST) -> Value:
    """Return ``left op right``."""
    first, second = sole(left), sole(right)
    if isinstance(op, ast.Mod) and any(isinstance(atom, str) for atom in left):
        return percent(left, right)
    if isinstance(op, ast.Add) and any(isinstance(atom, (str, Text)) for atom in (*left, *right)):
        operands: list[list[AnyText]] = [
            as_texts(tuple(atom for atom in value if atom is not None)) for value in (left, right)
        ]
        return text_value(concatenations(operands))
    if isinstance(op, (ast.Add, ast.BitOr)) and isinstance(first, Obj) and isinstance(second, Obj):
        return _combined(run, first, second, node)
    if isinstance(op, ast.Mult) and isinstance(second, int) and second <= MAX_EXACT:
        if isinstance(first, Obj) and first.kind in ("list", "tuple"):
            items = run.items_of(first)
            if items.exact is not None and len(items.exact) * second <= MAX_EXACT:
                return run.sequence(node, first.kind, Items(items.exact * second), "times")
        if isinstance(first, str):
            return (first * second,) if len(first) * second < 256 else ANY
    if isinstance(op, ast.Div) and isinstance(second, str):
        return (
            text_value(concatenations([as_texts(left), ["/"], [second]])) if isinstance(first, str) else ANY
        )
    compute = _ARITHMETIC.get(type(op))
    numbers = all(type(atom) in (int, float, bool) and abs(atom) < _LARGEST for atom in (*left, *right))  # type: ignore[arg-type]
    if compute is None or not numbers or len(left) * len(right) > MAX_EXACT or not (left and right):
        return OF_LAUNCH if any(isinstance(atom, Text) for atom in (*left, *right)) else ANY
    try:
        return join_all((compute(a, b),) for a in left for b in right)
    except (ArithmeticError, TypeError, ValueError):
        return ANY


def _combined(run: Run, first: Obj, second: Obj, node: ast.AST) -> Value:
    if first.kind == "dict" and second.kind == "dict":
        obj = run.allocate(node, "dict")
        fill(run, obj, (first,), {})
        fill(run, obj, (second,), {})
        return (obj,)
    a, b = elements(run, (first,)), elements(run, (second,))
    if a.exact is not None and b.exact is not None and len(a.exact) + len(b.exact) <= MAX_EXACT:
        return run.sequence(node, first.kind, Items((*a.exact, *b.exact)), "sum")
    return run.sequence(node, "list", Items(None, join(a.any_element(), b.any_element())), "sum")
