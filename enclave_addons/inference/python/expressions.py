"""Expressions: what each kind of syntax gives."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable
from typing import Any

from enclave_addons.inference.kernel.machine import NEXT, Jumps
from enclave_addons.inference.kernel.texts import AnyText, Text, concatenations
from enclave_addons.inference.kernel.values import (
    ANY,
    BOTTOM,
    NONE,
    OF_LAUNCH,
    External,
    Items,
    LocalCells,
    Obj,
    Unknown,
    Value,
    boolean,
    external,
    join,
    join_all,
    sole,
    unknown,
)
from enclave_addons.inference.python.arithmetic import binary
from enclave_addons.inference.python.classes import super_of
from enclave_addons.inference.python.conditions import compare, guard_of, narrow, read_truth
from enclave_addons.inference.python.containers import (
    SEQUENCES,
    elements,
    fill,
    from_dictionary,
    store_item,
    subscript,
)
from enclave_addons.inference.python.formatting import as_texts, formatted, hole, text_value
from enclave_addons.inference.python.functions import new_function
from enclave_addons.inference.python.objects import Arguments, Bound, Class, Frame, Function
from enclave_addons.inference.python.run import EXPRESSIONS, MAX_EXACT, Run
from enclave_addons.inference.python.statements import assign_target


def _constant(run: Run, node: ast.Constant, frame: Frame) -> Value:
    return unknown("...") if node.value is Ellipsis else (node.value,)


def _name(run: Run, node: ast.Name, frame: Frame) -> Value:
    return run.look_up(node.id, frame)


def _attribute(run: Run, node: ast.Attribute, frame: Frame) -> Value:
    return run.attribute(run.evaluate(node.value, frame), node.attr, node, frame)


def _subscript(run: Run, node: ast.Subscript, frame: Frame) -> Value:
    owner = run.evaluate(node.value, frame)
    if isinstance(node.slice, ast.Slice):
        bounds = [
            run.evaluate(each, frame) if each else NONE
            for each in (node.slice.lower, node.slice.upper, node.slice.step)
        ]
        return _sliced(run, owner, bounds, node)
    key = run.evaluate(node.slice, frame)
    atom = sole(owner)
    if isinstance(atom, External) and atom.path == "os.environ":
        return run.call(external("os.environ.__getitem__"), Arguments([key]), node, frame)
    own = (
        run.class_attribute(atom.cls, "__getitem__")
        if isinstance(atom, Obj) and isinstance(atom.cls, Class)
        else ()
    )
    bound = tuple(Bound(each, atom) for each in own if isinstance(each, Function))
    if bound:
        return run.call(bound, Arguments([key]), node, frame)
    return subscript(run, owner, key)


def _sliced(run: Run, owner: Value, bounds: list[Value], node: ast.AST) -> Value:
    atom = sole(owner)
    ends = [sole(each) for each in bounds]
    numbers = [each for each in ends if each is None or isinstance(each, int)]
    place = slice(*numbers) if len(numbers) == len(ends) else None
    if isinstance(atom, str) and place is not None:
        return (atom[place],)
    if isinstance(atom, Obj) and atom.kind in SEQUENCES:
        items = run.items_of(atom)
        if items.exact is not None and place is not None:
            return run.sequence(node, atom.kind, Items(items.exact[place]), "slice")
        return run.sequence(node, "list", Items(None, items.any_element()), "slice")
    if isinstance(atom, Text):
        first, last = atom.pieces[0], atom.pieces[-1]
        if ends == [1, None, None] and isinstance(first, str):
            return text_value(concatenations([[first[1:]], [Text(atom.pieces[1:])]]))
        return OF_LAUNCH if not isinstance(last, str) else unknown("a part of a text")
    return (atom,) if isinstance(atom, Unknown) else unknown("a part of something")


def _binary(run: Run, node: ast.BinOp, frame: Frame) -> Value:
    return binary(run, node.op, run.evaluate(node.left, frame), run.evaluate(node.right, frame), node)


def _unary(run: Run, node: ast.UnaryOp, frame: Frame) -> Value:
    value = run.evaluate(node.operand, frame)
    if isinstance(node.op, ast.Not):
        outcome = read_truth(run, value)
        return boolean(None if outcome is None else not outcome)
    atom = sole(value)
    if isinstance(node.op, ast.USub) and type(atom) in (int, float):
        return (-atom,)  # type: ignore[operator]
    return value if isinstance(node.op, ast.UAdd) else ANY


def _connection(run: Run, node: ast.BoolOp, frame: Frame) -> Value:
    """Run the first operand, and each further one where those before do not decide."""
    stops = isinstance(node.op, ast.Or)
    value = run.evaluate(node.values[0], frame)
    outcome = read_truth(run, value)
    rest = node.values[1:]
    if outcome is stops:
        run.dead.update(rest)
        return value
    narrower = ast.BoolOp(op=node.op, values=rest) if len(rest) > 1 else rest[0]
    if outcome is not None:
        return run.evaluate(narrower, frame)
    kept = tuple(atom for atom in value if read_truth(run, (atom,)) is not (not stops))
    found: list[Value] = []

    def side() -> int:
        narrow(run, node.values[0], not stops, frame)
        with run.under(guard_of(run, node.values[0], not stops)):
            found.append(run.evaluate(narrower, frame))
        return NEXT

    run.branch([side, lambda: NEXT])
    if not stops:
        kept = tuple(atom for atom in value if read_truth(run, (atom,)) is not True)
        kept = (False,) if any(not isinstance(atom, (bool, type(None))) for atom in kept) else kept
    return join(kept, found[0])


def _comparison(run: Run, node: ast.Compare, frame: Frame) -> Value:
    left = run.evaluate(node.left, frame)
    outcomes: list[bool | None] = []
    for op, other in zip(node.ops, node.comparators, strict=True):
        right = run.evaluate(other, frame)
        outcomes.append(compare(run, op, left, right))
        left = right
    if False in outcomes:
        return (False,)
    return boolean(None if None in outcomes else True)


def _conditional(run: Run, node: ast.IfExp, frame: Frame) -> Value:
    outcome = read_truth(run, run.evaluate(node.test, frame))
    if outcome is not None:
        run.dead.add(node.orelse if outcome else node.body)
        return run.evaluate(node.body if outcome else node.orelse, frame)
    found: list[Value] = []

    def side(expression: ast.expr, holds: bool) -> int:
        narrow(run, node.test, holds, frame)
        with run.under(guard_of(run, node.test, holds)):
            found.append(run.evaluate(expression, frame))
        return NEXT

    run.branch([lambda: side(node.body, True), lambda: side(node.orelse, False)])
    return join_all(found)


def _lambda(run: Run, node: ast.Lambda, frame: Frame) -> Value:
    return (new_function(run, node, frame),)


def _display(kind: str) -> Callable[[Run, Any, Frame], Value]:
    def handler(run: Run, node: ast.List | ast.Tuple | ast.Set, frame: Frame) -> Value:
        parts: list[Value] = []
        known = True
        for each in node.elts:
            if isinstance(each, ast.Starred):
                items = elements(run, run.evaluate(each.value, frame))
                known = known and items.exact is not None
                parts.extend(items.exact if items.exact is not None else (items.rest,))
            else:
                parts.append(run.evaluate(each, frame))
        items = Items(tuple(parts)) if known and len(parts) <= MAX_EXACT * 4 else Items(None, join_all(parts))
        return run.sequence(node, kind, items)

    return handler


def _dictionary(run: Run, node: ast.Dict, frame: Frame) -> Value:
    obj = run.allocate(node, "dict")
    for key, value in zip(node.keys, node.values, strict=True):
        if key is None:
            fill(run, obj, run.evaluate(value, frame), {})
        else:
            store_item(run, (obj,), run.evaluate(key, frame), run.evaluate(value, frame))
    return (obj,)


@functools.lru_cache(maxsize=4096)
def _has_lambda(node: ast.expr) -> bool:
    return any(isinstance(each, ast.Lambda) for each in ast.walk(node))


def _comprehension(run: Run, node: Any, frame: Frame) -> Value:
    """Run a comprehension as the loops that it stands for, in a scope of its own."""
    cells = LocalCells(run.store.reads)
    inner = Frame(frame.module, cells, frame, frame.jumps, frame.function, is_comprehension=True)
    found: list[Value] = []
    pairs: list[tuple[Value, Value]] = []
    known = True

    def make() -> int:
        if isinstance(node, ast.DictComp):
            pairs.append((run.evaluate(node.key, inner), run.evaluate(node.value, inner)))
        else:
            found.append(run.evaluate(node.elt, inner))
        return NEXT

    def level(index: int) -> int:
        nonlocal known
        if index == len(node.generators):
            return make()
        generator = node.generators[index]
        items = elements(run, run.evaluate(generator.iter, inner if index else frame))

        def body(element: Value) -> int:
            nonlocal known
            assign_target(run, generator.target, element, inner)
            open_tests: list[ast.expr] = []
            for position, test in enumerate(generator.ifs):
                outcome = read_truth(run, run.evaluate(test, inner))
                if outcome is False:
                    run.dead.update(generator.ifs[position + 1 :])
                    return NEXT
                if outcome is None:
                    open_tests.append(test)
            if not open_tests:
                return level(index + 1)
            known = False

            def taken() -> int:
                for test in open_tests:
                    narrow(run, test, True, inner)
                with run.under(*(guard_of(run, test, True) for test in open_tests)):
                    return level(index + 1)

            return run.branch([taken, lambda: NEXT])

        jumps = Jumps(run.store.mark())
        exact = items.exact
        if exact is not None and len(exact) <= MAX_EXACT:
            return run.each_element(len(exact), jumps, lambda number: body(exact[number]))
        known = False
        return run.repeat(jumps, lambda: body(items.any_element() or ANY))

    level(0)
    cells.dead = not _has_lambda(node)
    if isinstance(node, ast.DictComp):
        obj = run.allocate(node, "dict")
        for key, value in pairs:
            if known:
                store_item(run, (obj,), key, value)
            else:
                fill(run, obj, BOTTOM, {}, value)
        return (obj,)
    kind = {ast.ListComp: "list", ast.SetComp: "set"}.get(type(node), "lazy")
    return run.sequence(node, kind, Items(tuple(found)) if known else Items(None, join_all(found)))


def _f_string(run: Run, node: ast.JoinedStr, frame: Frame) -> Value:
    operands: list[list[AnyText]] = []
    for part in node.values:
        if isinstance(part, ast.Constant):
            operands.append([str(part.value)])
        elif isinstance(part, ast.FormattedValue):
            operands.append(_formatted(run, part, frame))
    return text_value(concatenations(operands))


def _formatted(run: Run, part: ast.FormattedValue, frame: Frame) -> list[AnyText]:
    value = run.evaluate(part.value, frame)
    if part.conversion not in (-1, 115):
        return [hole("text made with !r")]
    if part.format_spec is None:
        return as_texts(value)
    spec = sole(run.evaluate(part.format_spec, frame))
    return formatted(value, spec if isinstance(spec, str) else None)


def _await(run: Run, node: ast.Await, frame: Frame) -> Value:
    return run.evaluate(node.value, frame)


def _yield(run: Run, node: ast.Yield, frame: Frame) -> Value:
    value = run.evaluate(node.value, frame) if node.value else NONE
    if frame.yields is not None:
        frame.yields.append(value)
        frame.yields_known = frame.yields_known and run.forks == frame.forks
    return unknown("what is sent to a generator")


def _yield_from(run: Run, node: ast.YieldFrom, frame: Frame) -> Value:
    items = elements(run, run.evaluate(node.value, frame))
    if frame.yields is not None:
        frame.yields.extend(items.exact if items.exact is not None else (items.rest,))
        frame.yields_known = frame.yields_known and items.exact is not None and run.forks == frame.forks
    return unknown("what a generator returns")


def _named(run: Run, node: ast.NamedExpr, frame: Frame) -> Value:
    value = run.evaluate(node.value, frame)
    run.assign(node.target.id, value, frame, outward=True)
    return value


def _starred(run: Run, node: ast.Starred, frame: Frame) -> Value:
    return run.evaluate(node.value, frame)


def call_of(run: Run, node: ast.Call, frame: Frame) -> tuple[Value, Arguments]:
    """Evaluate what is called and the arguments."""
    if isinstance(node.func, ast.Attribute):
        callee = run.attribute(
            run.evaluate(node.func.value, frame), node.func.attr, node.func, frame, called=True
        )
    else:
        callee = run.evaluate(node.func, frame)
    args = Arguments()
    for each in node.args:
        if not isinstance(each, ast.Starred):
            args.positional.append(run.evaluate(each, frame))
            continue
        items = elements(run, run.evaluate(each.value, frame))
        if items.exact is not None and not args.more:
            args.positional.extend(items.exact)
        else:
            args.more = join(args.more, items.any_element() or ANY)
    for keyword in node.keywords:
        value = run.evaluate(keyword.value, frame)
        if keyword.arg is not None:
            args.keywords[keyword.arg] = value
            continue
        atom = sole(value)
        if isinstance(atom, Obj) and atom.kind == "dict":
            from_dictionary(run, atom, args)
        elif value != NONE:
            args.more_keywords = join(args.more_keywords, ANY)
    return callee, args


def _call(run: Run, node: ast.Call, frame: Frame) -> Value:
    if isinstance(node.func, ast.Name) and node.func.id == "super":
        return super_of(run, node, frame)
    callee, args = call_of(run, node, frame)
    run.visited.add(node)
    return run.call(callee, args, node, frame)


EXPRESSIONS.update({
    ast.Constant: _constant,
    ast.Name: _name,
    ast.Attribute: _attribute,
    ast.Subscript: _subscript,
    ast.BinOp: _binary,
    ast.UnaryOp: _unary,
    ast.BoolOp: _connection,
    ast.Compare: _comparison,
    ast.IfExp: _conditional,
    ast.Lambda: _lambda,
    ast.List: _display("list"),
    ast.Tuple: _display("tuple"),
    ast.Set: _display("set"),
    ast.Dict: _dictionary,
    ast.ListComp: _comprehension,
    ast.SetComp: _comprehension,
    ast.DictComp: _comprehension,
    ast.GeneratorExp: _comprehension,
    ast.JoinedStr: _f_string,
    ast.Await: _await,
    ast.Yield: _yield,
    ast.YieldFrom: _yield_from,
    ast.NamedExpr: _named,
    ast.Starred: _starred,
    ast.Call: _call,
})  # fmt: skip
