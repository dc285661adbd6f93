"""Conditions: is a value certainly true or false, and what does a test tell about the tested variable.

Pruning a branch is only done on certainty; narrowing only removes alternatives that the branch excludes.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable

from enclave_launch.boundary.light import Any
from nodl.infer.interpreter import special
from nodl.infer.interpreter.frames import Frame
from nodl.infer.interpreter.run import Run
from nodl.infer.text import Input, Text, input_of
from nodl.infer.values import (
    BOTTOM,
    CONSTANTS,
    ITEMS,
    ClassValue,
    Dictionary,
    FunctionValue,
    Instance,
    ModuleValue,
    NativeObject,
    Sequence,
    Value,
    contains,
)


def truth_of(atom: object) -> bool | None:
    """``bool(atom)`` of the concrete value, ``None`` if it may be either."""
    if isinstance(atom, CONSTANTS):
        return bool(atom)
    if isinstance(atom, Text):
        return True if any(isinstance(piece, str) for piece in atom.pieces) else None
    if isinstance(atom, Sequence):
        items = atom.items
        return bool(items.exact) if items.exact is not None and len(atom.cells[ITEMS]) == 1 else None
    if isinstance(atom, FunctionValue | ModuleValue | ClassValue):
        return True
    if isinstance(atom, NativeObject):
        return bool(atom.object) if not hasattr(atom.object, "__len__") else None
    if isinstance(atom, Dictionary):
        entries = atom.entries()
        certain = any(certain for _, _, certain in entries)
        return True if certain else None if entries or atom.is_open or atom.summary else False
    if isinstance(atom, Instance) and isinstance(atom.cls, ClassValue):
        return None if atom.cls.linear is None or _defines_truth(atom.cls) else True
    return None


def _defines_truth(cls: ClassValue) -> bool:
    return any(
        not isinstance(base, ClassValue) or "__bool__" in base.cells or "__len__" in base.cells
        for base in cls.linear or ()
    )


def truth(value: Value) -> bool | None:
    """``bool(value)`` if all alternatives agree; ``None`` if they differ or one of them is open."""
    seen = {truth_of(atom) for atom in value}
    return seen.pop() if len(seen) == 1 else None


def decide(run: Run, test: ast.expr, frame: Frame) -> bool | None:
    """Evaluate ``test`` once, for its effects and its truth."""
    return truth(special.tested(run, run.evaluate(test, frame), test, frame))


def forked(run: Run, test: ast.expr, frame: Frame) -> bool | None:
    """The outcome of an undecided test on the path that is followed; ``None``: both, joined."""
    if run.state.forks or run.repeated:
        return None
    condition = _condition(run, test, frame)
    run.undecided += 1
    run.conditional = run.conditional or condition is not None
    if run.decisions is None:
        return None
    outcome = run.decisions.next(condition)
    narrowed(run, test, outcome, frame)
    return outcome


def _condition(run: Run, test: ast.expr, frame: Frame) -> tuple[Input, str, tuple[str, ...]] | None:
    """What ``test`` asks of a parameter: the input, and the edits that keep a name where it holds or does not."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        found = _condition(run, test.operand, frame)
        return None if found is None else (found[0], OPPOSITE[found[1]], found[2])
    left, edit = test, "only if true"
    given: tuple[str, ...] = ()
    if isinstance(test, ast.Compare) and len(test.ops) == 1 and isinstance(test.ops[0], ast.Eq | ast.NotEq):
        other = test.comparators[0]
        if not isinstance(other, ast.Constant) or type(other.value) not in (str, int):
            return None
        left, given = test.left, (str(other.value),)
        edit = "only if equal" if isinstance(test.ops[0], ast.Eq) else "only if different"
    if not _only_reads(left):
        return None
    value = run.evaluate(left, frame)
    asked = input_of(value[0]) if len(value) == 1 else None
    if asked is None or asked.edits or asked.item is not None or asked.name.startswith(("-", "<", "$")):
        return None
    defaults = getattr(asked.owner, "parameters", {}).get(asked.name, ())
    wanted = bool if edit == "only if true" else (str, int)
    plain = all(isinstance(default, wanted) for default in defaults) and bool(defaults)
    return (asked, edit, given) if plain else None


OPPOSITE = {
    "only if true": "only if false", "only if false": "only if true",
    "only if equal": "only if different", "only if different": "only if equal",
}  # fmt: skip
_READS = frozenset({"get_parameter", "get_parameter_value", "declare_parameter"})


def _only_reads(node: ast.expr) -> bool:
    """Evaluating it once more changes nothing."""
    calls = (part for part in ast.walk(node) if isinstance(part, ast.Call))
    return all(isinstance(call.func, ast.Attribute) and call.func.attr in _READS for call in calls)


def narrowed(run: Run, test: ast.expr, outcome: bool, frame: Frame) -> None:
    """Drop from a tested variable or field of ``self`` what the outcome of ``test`` excludes."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        narrowed(run, test.operand, not outcome, frame)
    elif isinstance(test, ast.BoolOp):
        if isinstance(test.op, ast.And) == outcome:
            for part in test.values:
                narrowed(run, part, outcome, frame)
    elif isinstance(test, ast.Compare) and len(test.ops) == 1:
        _narrow_comparison(run, test, outcome, frame)
    elif isinstance(test, ast.Name | ast.Attribute):
        _filter(run, test, frame, lambda atom: truth_of(atom) in (outcome, None))


def _narrow_comparison(run: Run, test: ast.Compare, outcome: bool, frame: Frame) -> None:
    if not isinstance(test.ops[0], ast.Is | ast.Eq | ast.IsNot | ast.NotEq):
        return
    wanted = outcome == isinstance(test.ops[0], ast.Is | ast.Eq)
    other = test.comparators[0]
    if isinstance(other, ast.Constant) and isinstance(test.left, ast.Name | ast.Attribute):
        constant = other.value
        _filter(run, test.left, frame, lambda atom: _may_equal(atom, constant, wanted))


def _may_equal(atom: object, constant: object, wanted: bool) -> bool:
    if isinstance(atom, CONSTANTS):
        return (atom == constant) == wanted
    return not (constant is None and isinstance(atom, _NEVER_NONE) and wanted)


_NEVER_NONE = (Instance, FunctionValue, ClassValue, ModuleValue, Sequence)


def _filter(run: Run, target: ast.expr, frame: Frame, keep: Callable[[object], bool]) -> None:
    if isinstance(target, ast.Name):
        cells = frame.cells
        key: object = target.id
    elif isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
        owner = frame.cells.get(target.value.id, BOTTOM)
        if len(owner) != 1 or not isinstance(owner[0], Instance) or owner[0].summary:
            return
        cells = owner[0].cells
        key = target.attr
    else:
        return
    value = cells.get(key)
    if value is None or len(value) < 2:
        return
    kept = tuple(atom for atom in value if keep(atom))
    if kept and len(kept) < len(value):
        run.state.write(cells, key, kept)


def compare(run: Run, node: ast.Compare, frame: Frame) -> Value:
    """A comparison: certain for constants, else either."""
    left = run.evaluate(node.left, frame)
    results: set[bool | None] = set()
    for op, comparator in zip(node.ops, node.comparators, strict=True):
        right = run.evaluate(comparator, frame)
        own: Value = BOTTOM
        if special.has_own(left) or special.has_own(right):
            own = special.comparison(run, op, left, right, node, frame)
            if own and len(node.ops) == 1:
                return own
        results.add(truth(own) if own else compare_values(op, left, right))
        left = right
    if results == {True}:
        return (True,)
    return (False,) if False in results else (True, False)


def compare_values(op: ast.cmpop, left: Value, right: Value) -> bool | None:
    """The outcome of comparing all pairs if they agree; ``None``: not known, or more than 16 pairs."""
    if len(left) * len(right) > 16 or not left or not right:
        return None
    outcomes = {_compare_atoms(op, a, b) for a in left for b in right}
    return outcomes.pop() if len(outcomes) == 1 else None


def _compare_atoms(op: ast.cmpop, left: object, right: object) -> bool | None:
    if isinstance(op, ast.In | ast.NotIn):
        found = _membership(left, right)
        return found if found is None or isinstance(op, ast.In) else not found
    if isinstance(left, CONSTANTS) and isinstance(right, CONSTANTS):
        return _compare_constants(op, left, right)
    with_none = isinstance(op, ast.Is | ast.IsNot | ast.Eq | ast.NotEq) and (left is None or right is None)
    if with_none and isinstance(right if left is None else left, _NEVER_NONE):
        return isinstance(op, ast.IsNot | ast.NotEq)
    return None


def _membership(element: object, container: object) -> bool | None:
    if isinstance(container, str) and isinstance(element, str):
        return element in container
    if isinstance(container, Dictionary) and isinstance(element, CONSTANTS):
        held, certain = container.held(element)
        return True if certain else None if held or container.is_open else False
    if isinstance(container, Sequence) and isinstance(element, CONSTANTS):
        exact = container.items.exact
        if exact is None or container.escaped:
            return None
        if any(len(item) == 1 and contains(item, element) for item in exact):
            return True
        certain = all(isinstance(atom, CONSTANTS) for item in exact for atom in item)
        return False if certain and not any(contains(item, element) for item in exact) else None
    return None


def _compare_constants(op: ast.cmpop, left: object, right: object) -> bool | None:
    try:
        return bool(_COMPARED[type(op)](left, right))
    except TypeError:
        return None


_COMPARED: dict[type, Callable[[Any, Any], object]] = {
    ast.Eq: operator.eq, ast.Is: operator.eq, ast.NotEq: operator.ne, ast.IsNot: operator.ne,
    ast.Lt: operator.lt, ast.Gt: operator.gt, ast.LtE: operator.le, ast.GtE: operator.ge,
}  # fmt: skip
