"""Conditions: is a value certainly true or false, and what does a test ask of a parameter.

A branch is only left out on certainty. A test that asks for the value of a parameter is decided by the launch.
"""

from __future__ import annotations

import ast
import functools
import operator
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, TypeVar

from nodl.infer.findings import NodeRecord, OptionDefaults
from nodl.infer.interpreter.define import is_enumeration
from nodl.infer.interpreter.run import Run
from nodl.infer.text import (
    Guard,
    Input,
    NodePart,
    Text,
    TextAtom,
    constant_text,
    input_of,
    is_condition,
    is_one_of_several,
    make_text,
    pieces_of,
    with_edit,
)
from nodl.infer.values import (
    BOTTOM,
    CONSTANTS,
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
    join_all,
    sole,
)
from nodl.name_template import EDITS, either_of

T = TypeVar("T")

OPPOSITE = {
    "only if true": "only if false", "only if false": "only if true",
    "only if equal": "only if different", "only if different": "only if equal",
    "only if among": "only if not among", "only if not among": "only if among",
    "only if above": "only if not above", "only if not above": "only if above",
    "only if starting": "only if not starting", "only if not starting": "only if starting",
    "only if ending": "only if not ending", "only if not ending": "only if ending",
    "only if either": "only if neither", "only if neither": "only if either",
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
_GIVE_TEXT = EDITS | {"split", "part", "after", "key"}


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
    """Return the built-in class of a value; ``None``: not known. A parameter has the type that it is declared with."""
    atom = constant_text(atom)
    if isinstance(atom, CONSTANTS):
        return type(atom)
    if isinstance(atom, Sequence):
        return _SEQUENCES.get(atom.kind)
    if isinstance(atom, Dictionary):
        return dict if atom.kind == "dict" else None
    if not isinstance(atom, Text):
        return None
    pieces = [piece for piece in atom.pieces if not (isinstance(piece, Input) and is_condition(piece))]
    asked = pieces[0] if len(pieces) == 1 else None
    if not isinstance(asked, Input) or (asked.edits and asked.edits[-1][0] in _GIVE_TEXT):
        return str if asked is None or isinstance(asked, Input) else None
    if asked.edits or not isinstance(asked.owner, NodeRecord) or asked.name in asked.owner.loose:
        return None
    kinds = {_kind_of_default(default, asked.item) for default in asked.owner.default(asked.name)}
    return kinds.pop() if len(kinds) == 1 else None


def _kind_of_default(default: object, item: int | str | None) -> type | None:
    """Return the class of a parameter with this default, or of an element of it. rclpy gives only texts as a list."""
    if not isinstance(default, Sequence):
        return _kind_of(default) if item is None else None
    elements = default.items.any_element()
    if default.kind != "list" or not elements or any(_kind_of(each) is not str for each in elements):
        return None
    return list if item is None else str


def decide(run: Run, test: ast.expr, frame: Frame) -> bool | None:
    """Evaluate ``test`` once, for its effects and its truth; notes what its calls give, for ``conditions_of``."""
    run.answers.update(dict.fromkeys(_calls_in(test), BOTTOM))
    return truth(run.evaluate(test, frame))


def condition_of(run: Run, test: ast.expr, frame: Frame) -> Guard | None:
    """Return what ``test`` requires of a parameter; ``None`` if that cannot be said."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return opposite(condition_of(run, test.operand, frame))
    if isinstance(test, ast.BoolOp):
        parts = (condition_of(run, part, frame) for part in test.values)
        return _combined(parts, isinstance(test.op, ast.And))
    if not _may_ask(test):
        return None
    if isinstance(test, ast.Compare):
        return _combined((_comparison(run, each, frame) for each in _links(test)), True)
    if isinstance(test, ast.Call) and isinstance(test.func, ast.Attribute) and test.func.attr in _AFFIXES:
        return _of_affix(run, test, test.func, frame)
    asked, defaults = _asked(run, test, frame)
    if asked is None:
        return None
    if all(isinstance(default, bool) for default in defaults):
        return Guard(asked, "only if true", ())
    if all(isinstance(default, str) for default in defaults):
        return Guard(asked, "only if different", ("",))
    return Guard(asked, "only if different", ("0",)) if _whole_numbers(defaults) else None


def _combined(parts: Iterable[Guard | None], all_of: bool) -> Guard | None:
    """Return the condition that holds where all ``parts`` do, or one of them; they must ask for one parameter."""
    known: list[Guard] = []
    for part in parts:
        if part is None or (known and part.asked != known[0].asked):
            return None
        known.append(part)
    if len(known) == 1:
        return known[0]
    edits = [(part.edit, part.given) for part in known]
    return Guard(known[0].asked, *(either_of(edits) if all_of else either_of(*([each] for each in edits))))


@functools.lru_cache(maxsize=8192)
def _links(test: ast.Compare) -> tuple[ast.Compare, ...]:
    """Return the comparisons of a chain: of ``1 < n < 3``, ``1 < n`` and ``n < 3``."""
    sides = [test.left, *test.comparators]
    return tuple(
        ast.Compare(left, [op], [right])
        for left, op, right in zip(sides, test.ops, test.comparators, strict=False)
    )


_AFFIXES = {"startswith": "only if starting", "endswith": "only if ending"}


def _of_affix(run: Run, test: ast.Call, method: ast.Attribute, frame: Frame) -> Guard | None:
    if not (isinstance(method.value, ast.Call) or _only_reads(method.value)) or len(test.args) != 1:
        return None
    asked, defaults = _asked(run, method.value, frame)
    affix = test.args[0].value if isinstance(test.args[0], ast.Constant) else None
    if asked is None or not isinstance(affix, str) or not all(type(each) is str for each in defaults):
        return None
    return Guard(asked, _AFFIXES[method.attr], (affix,))


def opposite(condition: Guard | None) -> Guard | None:
    """Return the condition that holds where ``condition`` does not; ``None``: what no element of a list is."""
    if condition is None or condition.asked.item is not None:
        return None
    return condition._replace(edit=OPPOSITE[condition.edit])


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
    found = condition if holds else opposite(condition)
    return () if found is None else (found,)


def under(run: Run, conditions: tuple[Guard, ...], action: Callable[[], T]) -> T:
    """Run ``action`` where the conditions hold: the interfaces that it makes depend on them."""
    before = run.guards
    run.guards = (*before, *(each for each in conditions if each not in before))
    result = action()
    run.guards = before
    return result


def sides_of(
    run: Run, test: ast.expr, frame: Frame, action: Callable[[bool], T]
) -> tuple[Guard | None, list[Callable[[], T]]]:
    """Return what ``test`` asks of a parameter, and ``action`` for either outcome, under what is certain then."""
    held = {holds: conditions_of(run, test, holds, frame) for holds in (True, False)}
    if not all(held.values()) and _reads_parameter(run, test, frame):
        run.asks_launch = True

    def side(holds: bool) -> T:
        narrowed(run, test, holds, frame)
        return under(run, held[holds], partial(action, holds))

    return condition_of(run, test, frame), [partial(side, True), partial(side, False)]


def _reads_parameter(run: Run, test: ast.expr, frame: Frame) -> bool:
    """Return whether a variable, a field or a call in ``test`` gives what a parameter or the node's name decides."""
    parts = (part for part in ast.walk(test) if isinstance(part, ast.Name | ast.Attribute | ast.Call))
    return any(is_of_launch(atom) for part in parts if _may_ask(part) for atom in _answer(run, part, frame))


def is_of_launch(atom: object) -> bool:
    """Return whether a launch decides a text: it has an input in it, or what the node is called."""
    pieces = atom.pieces if isinstance(atom, Text) else ()
    return any(isinstance(piece, NodePart | Input) for piece in pieces)


def where_either(first: tuple[Guard, ...], second: tuple[Guard, ...]) -> tuple[Guard, ...]:
    """Return what is certain of parameters where all of ``first`` or all of ``second`` hold."""
    found = {each: None for each in first if each in second}
    left = [each for each in first if each not in found], [each for each in second if each not in found]
    for asked in dict.fromkeys(each.asked for each in first if each.asked.item is None):
        texts = [_texts_left(asked, guards) for guards in (first, second)]
        sides = sorted(([each for each in guards if each.asked == asked] for guards in left), key=len)
        if all(texts):
            found[Guard(asked, "only if among", tuple(dict.fromkeys((*texts[0], *texts[1]))))] = None
        elif len(sides[0]) == 1:  # ``a``, or ``not a`` and ``b``, is ``a`` or ``b``
            others = [each for each in sides[1] if each != opposite(sides[0][0])]
            if others:
                edits = [[(each.edit, each.given) for each in side] for side in (sides[0], others)]
                found[Guard(asked, *either_of(*edits))] = None
    return tuple(found)


def _texts_left(asked: Input, guards: tuple[Guard, ...]) -> tuple[str, ...]:
    """Return the texts that ``guards`` leave to a parameter; none where they do not list them."""
    own = [each for each in guards if each.asked == asked]
    listed = [each.given for each in own if each.edit in ("only if equal", "only if among")]
    others = {
        text for each in own if each.edit in ("only if different", "only if not among") for text in each.given
    }
    return tuple(text for text in min(listed, key=len, default=()) if text not in others)


def either(run: Run, condition: Guard, first: Value, second: Value) -> Value:
    """Return what a variable holds: ``first`` where the condition holds, else ``second``.

    Only texts carry a condition: which function, class or container is meant only a launch can say.
    """
    if any(
        isinstance(atom, _CHOSEN) and not (atom in first and atom in second) for atom in (*first, *second)
    ):
        run.asks_launch = True
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


_CHOSEN = (FunctionValue, ClassValue, BoundMethod, Sequence, Dictionary)


def _comparison(run: Run, test: ast.Compare, frame: Frame) -> Guard | None:
    asked, defaults = _asked(run, test.left, frame)
    other, op = test.comparators[0], type(test.ops[0])
    if asked is None:
        asked, defaults = _asked(run, other, frame)
        other = test.left
        if (
            asked is not None
            and issubclass(op, ast.In)
            and all(isinstance(each, Sequence) for each in defaults)
        ):
            asked, defaults, op = asked._replace(item="each"), ("",), ast.Eq
        op = _MIRRORED.get(op, op)
        if issubclass(op, (ast.In, ast.NotIn)):
            return None
    if asked is None or not (all(type(each) is str for each in defaults) or _whole_numbers(defaults)):
        return None
    value = _answer(run, other, frame)
    if issubclass(op, (ast.In, ast.NotIn)):
        among = _texts_in(value)
        edit = "only if among" if issubclass(op, ast.In) else "only if not among"
        return None if among is None else Guard(asked, edit, among)
    bound = value[0] if len(value) == 1 else None
    if type(bound) is not type(defaults[0]):
        return None
    if isinstance(bound, int) and op in _BOUNDS:
        edit, less = _BOUNDS[op]
        return Guard(asked, edit, (str(bound - less),))
    if not isinstance(bound, (str, int)) or not issubclass(op, (ast.Eq, ast.NotEq)):
        return None
    return Guard(asked, "only if equal" if issubclass(op, ast.Eq) else "only if different", (str(bound),))


_MIRRORED: dict[type, type] = {ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE}
_BOUNDS: dict[type, tuple[str, int]] = {
    ast.Gt: ("only if above", 0), ast.GtE: ("only if above", 1),
    ast.LtE: ("only if not above", 0), ast.Lt: ("only if not above", 1),
}  # fmt: skip


def _whole_numbers(defaults: Value) -> bool:
    return all(type(default) is int for default in defaults)


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
    if asked is None or not is_parameter(asked) or not isinstance(asked.owner, (NodeRecord, OptionDefaults)):
        return None, ()
    defaults = asked.owner.default(asked.name)
    if asked.item is not None:
        lists = [atom.items.any_element() for atom in defaults if isinstance(atom, Sequence)]
        defaults = join_all(lists) if len(lists) == len(defaults) else ()
    return (asked, defaults) if defaults else (None, ())


def is_parameter(asked: Input) -> bool:
    """Return True if it is a parameter, an option or a part of one, with its default as far as the code gives one."""
    edited = any(method in ("unless empty", "only if set", "key") for method, _ in asked.edits)
    return not edited and type(asked.item) is not int


_READS = EDITS | {"get_parameter", "get_parameter_value", "declare_parameter"}


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
    whole = test
    cells: dict[object, Value] = {}
    key: object = None
    holds: Callable[[object], bool | None] = truth_of
    if isinstance(test, ast.Compare) and isinstance(
        test.comparators[0], ast.Constant | ast.Name | ast.Attribute | ast.Tuple
    ):
        op, other = test.ops[0], run.evaluate(test.comparators[0], frame)
        if len(test.ops) == 1:
            test, holds = test.left, lambda atom: compare_values(op, (atom,), other)
    if isinstance(test, ast.Name):
        cells, key = frame.cells, test.id
    elif isinstance(test, ast.Attribute) and isinstance(test.value, ast.Name):
        owner = frame.cells.get(test.value.id, ())
        if len(owner) == 1 and isinstance(owner[0], Instance) and not owner[0].summary:
            cells, key = owner[0].cells, test.attr
    value = cells.get(key, ())
    kept = tuple(atom for atom in value if holds(atom) in (outcome, None))
    asked = input_of(sole(kept))
    if asked is not None and is_one_of_several(asked):
        condition = condition_of(run, whole, frame)
        if condition is not None and condition.asked == asked:
            edit = condition.edit if outcome else OPPOSITE[condition.edit]
            run.state.write(cells, key, (with_edit(asked, "where", (edit, *condition.given)),))
    elif kept and len(kept) < len(value):
        run.state.write(cells, key, kept)


def only_if(condition: Guard, text: TextAtom) -> Text:
    """Return ``text`` if the condition holds, and nothing otherwise."""
    return make_text((condition.piece, *(pieces_of(text) if text else ())))


def compare(run: Run, node: ast.Compare, frame: Frame) -> Value:
    """Compare: certain for constants, else either."""
    left = run.evaluate(node.left, frame)
    results: set[bool | None] = set()
    for op, comparator in zip(node.ops, node.comparators, strict=True):
        if isinstance(op, (ast.In, ast.NotIn)) and _all_variables(run, comparator, frame):
            results.add(None)  # ``'node' in locals()``
            continue
        right = run.evaluate(comparator, frame)
        results.add(compare_values(op, left, right))
        left = right
    if results == {True}:
        return (True,)
    return (False,) if False in results else (True, False)


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
    if left is None or right is None:
        other = right if left is None else left
        own = isinstance(other, Instance) and isinstance(op, (ast.Eq, ast.NotEq))
        return not same if isinstance(other, _NEVER_NONE) and not own else None
    return None


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
