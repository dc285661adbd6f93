"""Tests: what they give, what they say of a parameter, and what holds of a variable on each side."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

from enclave_addons.inference.kernel.findings import FoundNode, Options
from enclave_addons.inference.kernel.machine import Guard
from enclave_addons.inference.kernel.texts import Input, Text, input_of
from enclave_addons.inference.kernel.values import (
    BOTTOM,
    CONSTANTS,
    ITEMS,
    External,
    Items,
    Key,
    Obj,
    Unknown,
    Value,
    present,
    sole,
)
from enclave_addons.inference.python.containers import SEQUENCES, elements, is_certain, plain
from enclave_addons.inference.python.objects import Bound, Class, Frame, Function, Partial
from enclave_addons.inference.python.run import Run

Predicate = Callable[[object], "bool | None"]
_ORDER: dict[type, Callable[[Any, Any], object]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_BUILT_IN = {"str": str, "int": int, "float": float, "bool": bool, "bytes": bytes}
_KINDS = {"list": "list", "dict": "dict", "set": "set", "tuple": "tuple"}


def truth_of(atom: object) -> bool | None:
    """Return the truth of one atom; ``None`` if it is not known."""
    if isinstance(atom, CONSTANTS):
        return bool(atom)
    if isinstance(atom, Text):
        return True if any(isinstance(piece, str) for piece in atom.pieces) else None
    if isinstance(atom, Obj):
        if atom.kind in SEQUENCES:
            items = atom.cells.get(ITEMS, (None,))[0]
            return bool(items.exact) if isinstance(items, Items) and items.exact is not None else None
        if atom.kind == "dict":
            entries = [value for cell, value in atom.cells.items() if present(value)]
            if any(
                isinstance(cell, Key) and len(present(value)) == len(value)
                for cell, value in atom.cells.items()
            ):
                return True
            return None if entries or atom.summary else False
        if isinstance(atom.cls, Class):
            return (
                None
                if any({"__bool__", "__len__"} & each.cells.keys() for each in atom.cls.classes())
                else True
            )
        return True
    return True if isinstance(atom, (Function, Bound, Partial)) else None


def truth(value: Value) -> bool | None:
    """Return the truth of ``value``; ``None`` where it may be either, or where nothing is known of it yet."""
    return _agreed(map(truth_of, value))


def _agreed(outcomes: Iterator[bool | None]) -> bool | None:
    found = set(outcomes)
    return found.pop() if len(found) == 1 else None


def read_truth(run: Run, value: Value) -> bool | None:
    """Return ``truth``, and note that containers were looked into."""
    for atom in value:
        if isinstance(atom, Obj) and atom.kind in SEQUENCES:
            run.store.read(atom.cells, ITEMS)
        elif isinstance(atom, Obj) and atom.kind == "dict":
            for cell in list(atom.cells):
                run.store.read(atom.cells, cell)
    return truth(value)


def compare(run: Run, op: ast.cmpop, left: Value, right: Value) -> bool | None:
    """Return the outcome of a comparison."""
    if isinstance(op, (ast.In, ast.NotIn)):
        found = _contained(run, left, right)
        return found if found is None or isinstance(op, ast.In) else not found
    return (
        _agreed(_compared(op, a, b) for a in left or (None,) for b in right or (None,))
        if left and right
        else None
    )


def _compared(op: ast.cmpop, left: object, right: object) -> bool | None:
    if not isinstance(op, (ast.Is, ast.IsNot)):
        left, right = plain(left), plain(right)
    if isinstance(op, (ast.Eq, ast.NotEq, ast.Is, ast.IsNot)):
        same = _equal(left, right)
        return same if same is None or isinstance(op, (ast.Eq, ast.Is)) else not same
    if isinstance(left, CONSTANTS) and isinstance(right, CONSTANTS):
        with suppress(TypeError, KeyError):
            return bool(_ORDER[type(op)](left, right))
    return None


def _equal(left: object, right: object) -> bool | None:
    if isinstance(left, CONSTANTS) and isinstance(right, CONSTANTS):
        return left == right
    if isinstance(left, (Unknown, Text)) or isinstance(right, (Unknown, Text)):
        texts = [each for each in (left, right) if isinstance(each, Text)]
        others = [each for each in (left, right) if not isinstance(each, (Text, Unknown))]
        piece = input_of(texts[0]) if texts else None
        never_none = bool(texts) and (piece is None or bool(_defaults(piece)))
        return False if never_none and others and others[0] is None else None
    if isinstance(left, Obj) and isinstance(right, Obj):
        if left is right:
            return True if not left.summary or isinstance(left, Class) else None
        if left.kind == right.kind == "instance" and left.place is not None and left.place != right.place:
            return False if not (left.summary or right.summary) else None
        return False if left.kind != right.kind else None
    if isinstance(left, External) or isinstance(right, External):
        if isinstance(left, External) and isinstance(right, External) and "(" not in left.path:
            return True if left.path == right.path else None
        other = right if isinstance(left, External) else left
        path = left.path if isinstance(left, External) else right.path if isinstance(right, External) else ""
        return False if other is None and "(" not in path else None
    return left is right or (type(left) is type(right) and left == right)


def _contained(run: Run, left: Value, right: Value) -> bool | None:
    container, atom = sole(right), sole(left)
    if isinstance(container, Obj) and container.kind == "dict":
        return is_certain(run, container, left)
    if isinstance(container, str) and isinstance(atom, str):
        return atom in container
    if not isinstance(container, Obj):
        return None
    exact = elements(run, right).exact
    if exact is None:
        return None
    outcomes = [_agreed(_equal(a, b) for a in left for b in each) for each in exact]
    if True in outcomes:
        return True
    return False if all(each is False for each in outcomes) else None


def is_instance(atom: object, kinds: list[object]) -> bool | None:
    """Return whether ``atom`` is an object of one of the classes ``kinds``."""
    outcomes = [_is_a(atom, kind) for kind in kinds]
    if True in outcomes:
        return True
    return False if outcomes and all(each is False for each in outcomes) else None


def _is_a(atom: object, kind: object) -> bool | None:
    name = (
        kind.path.rpartition(".")[2]
        if isinstance(kind, External) and kind.path.startswith("builtins.")
        else ""
    )
    if isinstance(atom, Text):
        piece = input_of(atom)
        if piece is None:
            return name == "str" if name else None
        held = _defaults(piece)
        known = {is_instance(each, [kind]) for each in held if not isinstance(each, Text)}
        return known.pop() if len(known) == 1 and piece.item is None else None
    if isinstance(atom, CONSTANTS):
        return (
            isinstance(atom, _BUILT_IN[name])
            if name in _BUILT_IN
            else False
            if name or kind is None
            else None
        )
    if isinstance(atom, Obj):
        if isinstance(atom, Class):
            return name == "type" if name else None
        if isinstance(atom.cls, Class):
            if isinstance(kind, Class):
                return kind in atom.cls.order
            paths = atom.cls.foreign()
            return True if isinstance(kind, External) and kind.path in paths else None if paths else False
        if atom.kind in _KINDS.values():
            return _KINDS.get(name) == atom.kind if name or isinstance(kind, Class) else None
        return (
            True
            if isinstance(kind, External) and isinstance(atom.cls, External) and kind.path == atom.cls.path
            else None
        )
    return False if isinstance(atom, Function) and name else None


def classes_in(run: Run, value: Value) -> list[object] | None:
    """Return the classes that the second argument of ``isinstance`` names."""
    found: list[object] = []
    for atom in value:
        if isinstance(atom, Obj) and atom.kind == "tuple":
            for each in elements(run, (atom,)).exact or ():
                found.extend(each)
        else:
            found.append(atom)
    return found if all(isinstance(each, (Class, External)) for each in found) else None


def _defaults(piece: Input) -> Value:
    owner = piece.owner
    return owner.default(piece.name) if isinstance(owner, (FoundNode, Options)) else BOTTOM


# --- conditions on inputs -----------------------------------------------------------------------------------


def guard_of(run: Run, test: ast.expr, holds: bool) -> Guard | None:
    """Return what a test that was just evaluated says of a single input where it holds, or does not."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return guard_of(run, test.operand, not holds)
    if isinstance(test, ast.Compare) and len(test.ops) == 1:
        return _guard_of_comparison(run, test, holds)
    if isinstance(test, ast.BoolOp):
        left = [each for each in test.values if each in run.latest and truth(run.latest[each]) is None]
        strict = isinstance(test.op, ast.And) is holds  # then each of them must hold, or none
        return guard_of(run, left[0], holds) if left and (strict or len(left) == 1) else None
    piece = input_of(sole(run.latest.get(test)))
    if piece is None or piece.item is not None:
        return None
    if piece.edits:  # a flag
        return Guard(piece, "only if true" if holds else "only if false", ())
    kinds = {type(each) for each in _defaults(piece)}
    if kinds == {bool}:
        return Guard(piece, "only if true" if holds else "only if false", ())
    if kinds == {str}:
        return Guard(piece, "only if different" if holds else "only if equal", ("",))
    return None


def _guard_of_comparison(run: Run, test: ast.Compare, holds: bool) -> Guard | None:
    piece, other = input_of(sole(run.latest.get(test.left))), run.latest.get(test.comparators[0])
    op = test.ops[0]
    if piece is None or other is None or piece.item is not None:
        return None
    if isinstance(op, (ast.In, ast.NotIn)):
        exact = elements(run, other).exact
        words = [sole(each) for each in exact or ()]
        if exact is None or not all(isinstance(each, str) for each in words):
            return None
        among = isinstance(op, ast.In) is holds
        return Guard(piece, "only if among" if among else "only if not among", tuple(map(str, words)))
    constant = sole(other)
    if not isinstance(constant, (str, int, float)) or not isinstance(
        op, (ast.Eq, ast.NotEq, ast.Is, ast.IsNot)
    ):
        return None
    equal = isinstance(op, (ast.Eq, ast.Is)) is holds
    return Guard(piece, "only if equal" if equal else "only if different", (str(constant),))


# --- what holds of a variable -------------------------------------------------------------------------------


def narrow(run: Run, test: ast.expr, holds: bool, frame: Frame) -> None:
    """Leave of the variable or attribute in ``test`` what it may be where the test holds, or does not."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        narrow(run, test.operand, not holds, frame)
    elif isinstance(test, ast.BoolOp):
        if isinstance(test.op, ast.And) is holds:
            for each in test.values:
                narrow(run, each, holds, frame)
    elif isinstance(test, ast.Compare) and len(test.ops) == 1:
        other = run.latest.get(test.comparators[0], BOTTOM)
        if len(other) == 1 and not isinstance(test.ops[0], (ast.In, ast.NotIn)):
            _narrow(run, test.left, lambda atom: _compared(test.ops[0], atom, other[0]), holds, frame)
    elif isinstance(test, ast.Call) and isinstance(test.func, ast.Name) and test.func.id == "isinstance":
        kinds = classes_in(run, run.latest.get(test.args[1], BOTTOM)) if len(test.args) == 2 else None
        if kinds:
            _narrow(run, test.args[0], lambda atom: is_instance(atom, kinds), holds, frame)
    else:
        _narrow(run, test, truth_of, holds, frame)


def _narrow(run: Run, subject: ast.expr, predicate: Predicate, holds: bool, frame: Frame) -> None:
    value = run.latest.get(subject, BOTTOM)
    kept = tuple(atom for atom in value if predicate(atom) in (None, holds))
    if not kept or len(kept) == len(value):
        return
    if isinstance(subject, (ast.Name, ast.NamedExpr)):
        name = subject.id if isinstance(subject, ast.Name) else subject.target.id
        if name in frame.cells and present(frame.cells[name]) == value:
            run.store.write(frame.cells, name, kept)
    elif isinstance(subject, ast.Attribute):
        owner = sole(run.latest.get(subject.value))
        if (
            isinstance(owner, Obj)
            and not owner.summary
            and present(owner.cells.get(subject.attr, BOTTOM)) == value
        ):
            run.store.write(owner.cells, subject.attr, kept)
