"""Conditions: is a value certainly true or false, and what does a test ask of a parameter.

A branch is only left out on certainty. A test that asks for the value of a parameter is decided by the launch.
"""

from __future__ import annotations

import ast
import functools
import operator
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, TypeVar

from enclave_addons.inference.findings import NodeRecord, OptionDefaults
from enclave_addons.inference.interpreter.define import is_enumeration
from enclave_addons.inference.interpreter.run import Run
from enclave_addons.inference.text import (
    Guard,
    Input,
    NodePart,
    Text,
    TextAtom,
    constant_text,
    input_of,
    pieces_of,
)
from enclave_addons.inference.values import (
    BOOLEAN,
    BOTTOM,
    CONSTANTS,
    OF_LAUNCH,
    BoundMethod,
    ClassValue,
    Dictionary,
    External,
    Frame,
    FunctionValue,
    Instance,
    ModuleValue,
    Sequence,
    Value,
    contains,
    join,
    join_all,
    sole,
)

T = TypeVar("T")

_OPPOSITE = {
    "only if true": "only if false", "only if false": "only if true",
    "only if equal": "only if different", "only if different": "only if equal",
    "only if among": "only if not among", "only if not among": "only if among",
}  # fmt: skip


def truth_of(atom: object) -> bool | None:
    """Return ``bool(atom)`` of the concrete value, ``None`` if it may be either."""
    if isinstance(atom, CONSTANTS):
        return bool(atom)
    if isinstance(atom, Text):
        return True if any(isinstance(piece, str) for piece in atom.pieces) else None
    if isinstance(atom, Sequence):
        items = atom.items
        return None if items.exact is None else bool(items.exact)
    if isinstance(atom, (FunctionValue, ModuleValue, ClassValue)):
        return True
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
    """Return ``bool(value)`` if all alternatives agree; ``None`` if they differ or one of them is open."""
    seen = {truth_of(atom) for atom in value}
    return seen.pop() if len(seen) == 1 else None


_BUILT_IN: dict[str, type] = {
    f"builtins.{kind.__name__}": kind for kind in (str, int, float, bool, bytes, list, tuple, set, dict)
}
_SEQUENCES: dict[str, type] = {kind.__name__: kind for kind in (list, tuple, set)}


def is_instance(value: Value, classes: Value) -> bool | None:
    """Return the outcome of ``isinstance`` for built-in classes; ``None``: not known."""
    listed = classes[0] if len(classes) == 1 else None
    items = listed.items.exact if isinstance(listed, Sequence) else (classes,)
    wanted = tuple(
        _BUILT_IN.get(each[0].path if len(each) == 1 and isinstance(each[0], External) else "")
        for each in items or ()
    )
    kinds = {_kind_of(atom) for atom in value}
    if not wanted or None in wanted or not kinds or None in kinds:
        return None
    outcomes = {issubclass(kind, tuple(filter(None, wanted))) for kind in kinds if kind is not None}
    return outcomes.pop() if len(outcomes) == 1 else None


def _kind_of(atom: object) -> type | None:
    """Return the built-in class of a value; ``None``: not known."""
    atom = constant_text(atom)
    if isinstance(atom, CONSTANTS):
        return type(atom)
    if isinstance(atom, Sequence):
        return _SEQUENCES.get(atom.kind)
    if isinstance(atom, Dictionary):
        return dict if atom.kind == "dict" else None
    return None


def decide(run: Run, test: ast.expr, frame: Frame) -> bool | None:
    """Evaluate ``test`` once, for its effects and its truth; notes what its calls give, for ``conditions_of``."""
    run.answers.update(dict.fromkeys(_calls_in(test), BOTTOM))
    return truth(run.evaluate(test, frame))


def condition_of(run: Run, test: ast.expr, frame: Frame) -> Guard | None:
    """Return what ``test`` requires of a parameter; ``None`` if that cannot be said."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return opposite(condition_of(run, test.operand, frame))
    if not _may_ask(test):
        return None
    if isinstance(test, ast.Compare):
        return _comparison(run, test, frame) if len(test.ops) == 1 else None
    asked, defaults = _asked(run, test, frame)
    if asked is None:
        return None
    if all(isinstance(default, bool) for default in defaults):
        return Guard(asked, "only if true", ())
    if all(isinstance(default, str) for default in defaults):
        return Guard(asked, "only if different", ("",))
    return None


def opposite(condition: Guard | None) -> Guard | None:
    """Return the condition that holds where ``condition`` does not."""
    return None if condition is None else condition._replace(edit=_OPPOSITE[condition.edit])


def conditions_of(run: Run, test: ast.expr, holds: bool, frame: Frame) -> tuple[Guard, ...]:
    """Return what is certain of parameters where ``test`` holds, or where it does not."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return conditions_of(run, test.operand, not holds, frame)
    if isinstance(test, ast.BoolOp):
        parts = test.values
        if isinstance(test.op, ast.And) != holds:  # of several parts nobody knows which
            neutral = isinstance(test.op, ast.And)
            parts = [part for part in parts if _truth_again(run, part, frame) is not neutral]
        if isinstance(test.op, ast.And) == holds or len(parts) == 1:
            return tuple(each for part in parts for each in conditions_of(run, part, holds, frame))
    condition = condition_of(run, test, frame)
    return _certain(condition if holds else opposite(condition))


def _certain(condition: Guard | None) -> tuple[Guard, ...]:
    return () if condition is None else (condition,)


def under(run: Run, conditions: tuple[Guard, ...], action: Callable[[], T]) -> T:
    """Run ``action`` where the conditions hold: the interfaces that it makes depend on them."""
    before = run.guards
    run.guards = (*before, *(each for each in conditions if each not in before))
    result = action()
    run.guards = before
    return result


def sides_of(
    run: Run, test: ast.expr, frame: Frame, action: Callable[[bool], T]
) -> tuple[Callable[[Value, Value], Value] | None, list[Callable[[], T]]]:
    """Return how values are joined after a test, and ``action`` for either outcome, under what is certain then.

    What is made where a launch decides in a way that no condition says is a gap, until a launch decides.
    """
    condition = condition_of(run, test, frame) if run.has_inputs else None
    held = {True: _certain(condition), False: _certain(opposite(condition))}
    if run.has_inputs and condition is None and isinstance(test, ast.BoolOp | ast.UnaryOp):
        held = {holds: conditions_of(run, test, holds, frame) for holds in (True, False)}
    open_ = run.has_inputs and not all(held.values())
    read = [*filter(is_of_launch, _read_in(run, test, frame))] if open_ else []
    asks = bool(read)
    run.asks_launch = run.asks_launch or asks

    def side(holds: bool) -> T:
        made = run.findings.made
        narrowed(run, test, holds, frame)
        outcome = under(run, held[holds], partial(action, holds))
        if asks and not held[holds] and run.findings.made > made:
            run.gap(test, frame, "what is made under this test depends on a launch")
        return outcome

    joined = partial(either, run, condition) if condition or asks else None
    return joined, [partial(side, True), partial(side, False)]


def _read_in(run: Run, test: ast.expr, frame: Frame) -> Iterator[object]:
    for part in _parts_that_may_ask(test):
        yield from _answer(run, part, frame)


@functools.lru_cache(maxsize=8192)
def _parts_that_may_ask(test: ast.expr) -> tuple[ast.expr, ...]:
    parts = (part for part in ast.walk(test) if isinstance(part, ast.Name | ast.Attribute | ast.Call))
    return tuple(part for part in parts if _may_ask(part))


def is_of_launch(atom: object) -> bool:
    """Return whether a launch decides a value: a text with an input in it, or with what the node is called."""
    if atom is OF_LAUNCH[0]:
        return True
    pieces = atom.pieces if isinstance(atom, Text) else ()
    return any(isinstance(piece, NodePart | Input) for piece in pieces)


def where_either(first: tuple[Guard, ...], second: tuple[Guard, ...]) -> tuple[Guard, ...]:
    """Return what is certain of parameters where all of ``first`` or all of ``second`` hold."""
    found = {each: None for each in first if each in second}
    for asked in dict.fromkeys(each.asked for each in first):
        texts = [_texts_left(asked, guards) for guards in (first, second)]
        if all(texts):
            found[Guard(asked, "only if among", tuple(dict.fromkeys((*texts[0], *texts[1]))))] = None
    return tuple(found)


def _texts_left(asked: Input, guards: tuple[Guard, ...]) -> tuple[str, ...]:
    """Return the texts that ``guards`` leave to a parameter; none where they do not list them."""
    own = [each for each in guards if each.asked == asked]
    listed = [each.given for each in own if each.edit in ("only if equal", "only if among")]
    others = {
        text for each in own if each.edit in ("only if different", "only if not among") for text in each.given
    }
    return tuple(text for text in min(listed, key=len, default=()) if text not in others)


def either(run: Run, condition: Guard | None, first: Value, second: Value) -> Value:
    """Return what a variable holds: ``first`` where the condition holds, else ``second``.

    Only texts carry a condition: which truth, function, class or container is meant, and which text where no condition
    says what is asked, only a launch can say.
    """
    chosen = _CHOSEN if condition else (*_CHOSEN, *CONSTANTS, Text)
    both = (*first, *second)
    if any(
        isinstance(atom, chosen) and not (contains(first, atom) and contains(second, atom)) for atom in both
    ):
        run.asks_launch = True
        second = join(second, OF_LAUNCH)
    sides = ((condition, first, second), (opposite(condition), second, first))
    return join_all(
        tuple(
            only_if(held, atom)
            if held and isinstance(atom, (str, Text)) and not contains(other, atom)
            else atom
            for atom in value
        )
        for held, value, other in sides
    )


_CHOSEN = (bool, FunctionValue, ClassValue, BoundMethod, Sequence, Dictionary)


def _comparison(run: Run, test: ast.Compare, frame: Frame) -> Guard | None:
    """Return what a comparison with texts or whole numbers asks of a parameter."""
    asked, defaults = _asked(run, test.left, frame)
    other, op = test.comparators[0], type(test.ops[0])
    if asked is None and not issubclass(op, (ast.In, ast.NotIn)):
        asked, defaults = _asked(run, other, frame)
        other = test.left
    whole = all(type(default) is int for default in defaults)
    if asked is None or not (whole or all(type(each) is str for each in defaults)):
        return None
    value = _answer(run, other, frame)
    if issubclass(op, (ast.In, ast.NotIn)):
        among = _texts_in(value)
        edit = "only if among" if issubclass(op, ast.In) else "only if not among"
        return None if among is None else Guard(asked, edit, among)
    bound = value[0] if len(value) == 1 else None
    if type(bound) is not type(defaults[0]) or not issubclass(op, (ast.Eq, ast.NotEq)):
        return None
    return Guard(asked, "only if equal" if issubclass(op, ast.Eq) else "only if different", (str(bound),))


def _texts_in(value: Value) -> tuple[str, ...] | None:
    container = value[0] if len(value) == 1 else None
    if isinstance(container, Dictionary) and not container.is_open:
        keys = [cell.constant for cell, _, certain in container.entries() if certain]
        texts = tuple(each for each in keys if isinstance(each, str))
        return texts if len(texts) == len(container.entries()) else None
    if not isinstance(container, Sequence) or container.items.exact is None:
        return None
    known = [item[0] for item in container.items.exact if len(item) == 1 and type(item[0]) is str]
    texts = tuple(each for each in known if isinstance(each, str))
    return texts if len(texts) == len(container.items.exact) else None


def _answer(run: Run, node: ast.expr, frame: Frame) -> Value:
    """Return the value of a part of a test; a call is not made again."""
    return run.answers.get(node, BOTTOM) if isinstance(node, ast.Call) else run.evaluate(node, frame)


def _truth_again(run: Run, part: ast.expr, frame: Frame) -> bool | None:
    """Return the truth of a part of a test, ``None`` also where it would have to call something again."""
    if isinstance(part, ast.Call) or _only_reads(part):
        return truth(_answer(run, part, frame))
    return None


def _asked(run: Run, node: ast.expr, frame: Frame) -> tuple[Input | None, Value]:
    value = _answer(run, node, frame)
    asked = input_of(value[0]) if len(value) == 1 else None
    if asked is None or not isinstance(asked.owner, (NodeRecord, OptionDefaults)):
        return None, ()
    defaults = asked.owner.default(asked.name)
    return (asked, defaults) if defaults else (None, ())


_READS = frozenset({"get_parameter", "get_parameter_value", "declare_parameter"})


@functools.lru_cache(maxsize=8192)
def _calls_in(node: ast.expr) -> tuple[ast.Call, ...]:
    return tuple(part for part in ast.walk(node) if isinstance(part, ast.Call))


@functools.lru_cache(maxsize=8192)
def _may_ask(node: ast.expr) -> bool:
    """Return True for a value or a comparison of values, where evaluating again what is no call changes nothing."""
    if isinstance(node, ast.Compare):
        return all(isinstance(each, ast.Call) or _only_reads(each) for each in (node.left, *node.comparators))
    return isinstance(node, ast.Call) or (
        isinstance(node, (ast.Name, ast.Attribute, ast.Subscript)) and _only_reads(node)
    )


def _only_reads(node: ast.expr) -> bool:
    return all(isinstance(call.func, ast.Attribute) and call.func.attr in _READS for call in _calls_in(node))


def narrowed(run: Run, test: ast.expr, outcome: bool, frame: Frame) -> None:
    """Drop from a variable or field of ``self`` that is tested, or compared, what the outcome excludes."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        narrowed(run, test.operand, not outcome, frame)
    elif isinstance(test, ast.BoolOp) and isinstance(test.op, ast.And) == outcome:
        for part in test.values:
            narrowed(run, part, outcome, frame)
    holds: Callable[[object], bool | None] = truth_of
    if isinstance(test, ast.Compare) and len(test.ops) == 1 and isinstance(test.comparators[0], ast.Constant):
        op, other = test.ops[0], run.evaluate(test.comparators[0], frame)
        test, holds = test.left, lambda atom: compare_values(op, (atom,), other)
    cells: dict[object, Value] = {}
    key: object = None
    if isinstance(test, ast.Name):
        cells, key = frame.cells, test.id
    elif isinstance(test, ast.Attribute) and isinstance(test.value, ast.Name):
        owner = sole(frame.cells.get(test.value.id))
        if isinstance(owner, Instance) and not owner.summary:
            cells, key = owner.cells, test.attr
    value = cells.get(key, ())
    kept = tuple(atom for atom in value if holds(atom) in (outcome, None))
    if kept and len(kept) < len(value):
        run.state.write(cells, key, kept)


def only_if(condition: Guard, text: TextAtom) -> Text:
    """Return ``text`` if the condition holds, and nothing otherwise."""
    return Text((condition.piece, *(pieces_of(text) if text else ())))


def compare(run: Run, node: ast.Compare, frame: Frame) -> Value:
    """Compare: certain for constants, else either."""
    left = run.evaluate(node.left, frame)
    results: set[bool | None] = set()
    asks = False
    for op, comparator in zip(node.ops, node.comparators, strict=True):
        if isinstance(op, (ast.In, ast.NotIn)) and _all_variables(run, comparator, frame):
            results.add(None)  # ``'node' in locals()``
            continue
        right = run.evaluate(comparator, frame)
        outcome = compare_values(op, left, right)
        results.add(outcome)
        asks = asks or (outcome is None and any(map(is_of_launch, (*left, *right))))
        left = right
    if results == {True} or False in results:
        return (results == {True},)
    return OF_LAUNCH if asks else BOOLEAN


def _all_variables(run: Run, node: ast.expr, frame: Frame) -> bool:
    """Return whether it is a call of Python's own ``locals`` or ``globals``."""
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
        return False
    called = sole(run.evaluate(node.func, frame))
    return isinstance(called, External) and called.path in ("builtins.locals", "builtins.globals")


def compare_values(op: ast.cmpop, left: Value, right: Value) -> bool | None:
    """Return the outcome of comparing all pairs if they agree; ``None``: not known, or more than 16 pairs."""
    if len(left) * len(right) > 16 or not left or not right:
        return None
    outcomes = {_compare_atoms(op, a, b) for a in left for b in right}
    return outcomes.pop() if len(outcomes) == 1 else None


def _compare_atoms(op: ast.cmpop, left: object, right: object) -> bool | None:
    left, right = constant_text(left), constant_text(right)
    if not isinstance(op, (ast.Is, ast.IsNot)):
        left, right = _compared_as(left), _compared_as(right)
    if isinstance(op, (ast.In, ast.NotIn)):
        found = _is_among(left, right)
        return None if found is None else found is isinstance(op, ast.In)
    if isinstance(left, CONSTANTS) and isinstance(right, CONSTANTS):
        return _compare_constants(op, left, right)
    if not isinstance(op, (ast.Is, ast.IsNot, ast.Eq, ast.NotEq)):
        return None
    same = isinstance(op, (ast.Is, ast.Eq))
    if isinstance(left, Instance) and isinstance(right, Instance) and left.cls is right.cls:
        members = (
            isinstance(left.cls, ClassValue) and is_enumeration(left.cls) and "__eq__" not in left.cls.cells
        )
        return (left is right) is same if members else None
    if isinstance(left, ClassValue) and isinstance(right, ClassValue) and not left.summary:
        return (left is right) is same
    if left is None or right is None:
        other = right if left is None else left
        own = isinstance(other, Instance) and isinstance(op, (ast.Eq, ast.NotEq))
        return not same if isinstance(other, _NEVER_NONE) and not own else None
    return None


def _compared_as(atom: object) -> object:
    """Return the number or text that a member of an ``IntEnum`` or ``StrEnum`` is."""
    if not isinstance(atom, Instance) or not isinstance(atom.cls, ClassValue) or not is_enumeration(atom.cls):
        return atom
    cls, value = atom.cls, sole(atom.cells.get("value"))
    plain = any(isinstance(base, External) and base.path in _PLAIN_MEMBERS for base in cls.linear or ())
    return value if plain and isinstance(value, (int, str)) and _COMPARISONS.isdisjoint(cls.cells) else atom


_PLAIN_MEMBERS = frozenset({"enum.IntEnum", "enum.StrEnum", "builtins.int", "builtins.str"})
_COMPARISONS = frozenset({"__eq__", "__ne__", "__lt__", "__le__", "__gt__", "__ge__", "__contains__"})


def _is_among(constant: object, container: object) -> bool | None:
    """Return whether a constant is in a text, or in a sequence or dictionary of constants."""
    if not isinstance(constant, CONSTANTS):
        return None
    if isinstance(constant, str) and isinstance(container, str):
        return constant in container
    if isinstance(container, Sequence) and container.items.exact is not None:
        known = [item[0] for item in container.items.exact if len(item) == 1]
        certain = len(known) == len(container.items.exact) and all(isinstance(k, CONSTANTS) for k in known)
        return constant in known if certain else None
    if isinstance(container, Dictionary) and not container.is_open:
        held, certain = container.held(constant)
        return True if certain else None if held or container.summary else False
    return None


_NEVER_NONE = (Instance, FunctionValue, ClassValue, ModuleValue, Sequence, Dictionary)


def _compare_constants(op: ast.cmpop, left: object, right: object) -> bool | None:
    if isinstance(op, (ast.Is, ast.IsNot)) and type(left) is not type(right):
        return isinstance(op, ast.IsNot)
    try:
        return bool(_COMPARED[type(op)](left, right))
    except TypeError:
        return None


_COMPARED: dict[type, Callable[[Any, Any], object]] = {
    ast.Eq: operator.eq, ast.Is: operator.eq, ast.NotEq: operator.ne, ast.IsNot: operator.ne,
    ast.Lt: operator.lt, ast.Gt: operator.gt, ast.LtE: operator.le, ast.GtE: operator.ge,
}  # fmt: skip
