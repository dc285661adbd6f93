"""Comprehensions: over known elements exactly what they give, else any number of any element."""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import partial

from nodl.infer.interpreter.assign import assign, store_item
from nodl.infer.interpreter.conditions import decide, narrowed
from nodl.infer.interpreter.frames import Frame
from nodl.infer.interpreter.iterate import elements
from nodl.infer.interpreter.loops import may_unroll
from nodl.infer.interpreter.run import Run
from nodl.infer.values import Dictionary, Items, LocalCells, Value, join_all

Emit = Callable[[], None]


def comprehension(run: Run, node: ast.ListComp | ast.SetComp | ast.GeneratorExp, frame: Frame) -> Value:
    """A list (a set for a set comprehension), exact only where iterables and conditions are decided."""
    inner = _inner_frame(run, frame)
    collected: list[Value] = []

    def emit() -> None:
        collected.append(run.evaluate(node.elt, inner))

    exact = _generate(run, node.generators, inner, emit, frame)
    _leave(inner)
    kind = "set" if isinstance(node, ast.SetComp) else "list"
    return run.sequence(node, kind, Items(tuple(collected)) if exact else Items(None, join_all(collected)))


def dict_comprehension(run: Run, node: ast.DictComp, frame: Frame) -> Value:
    """A dictionary with the entries of all turns whose conditions are not certainly false."""
    inner = _inner_frame(run, frame)
    result = run.allocate(node, "dict", Dictionary)

    def add() -> None:
        key = run.evaluate(node.key, inner)
        value = run.evaluate(node.value, inner)
        store_item(run, result, key, value)

    _generate(run, node.generators, inner, add, frame)
    _leave(inner)
    return (result,)


def _inner_frame(run: Run, frame: Frame) -> Frame:
    """Of a comprehension in ``frame``; in a class body it does not see the names of the class (reference, 4.2.2)."""
    closure = frame.closure if frame.is_class else frame
    inner = Frame(frame.module, LocalCells(), closure, run.state.depth)
    inner.function = frame.function
    inner.entry = frame.entry
    inner.is_comprehension = True
    return inner


def _leave(inner: Frame) -> None:
    """The variables of a comprehension die with it, unless a function made in it lives on."""
    if type(inner.cells) is LocalCells and not inner.cells.shared:
        inner.cells.dead = True


def _generate(
    run: Run, generators: list[ast.comprehension], frame: Frame, emit: Emit, around: Frame | None = None
) -> bool:
    """Bind the targets for every combination and ``emit``. True: exactly the emitted elements, in order.

    ``around``: where the first of all iterables is evaluated.
    """
    if not generators:
        emit()
        return True
    generator = generators[0]

    def one(element: Value) -> bool:
        run.spend(1)
        assign(run, generator.target, element, frame)
        return _where(run, generators[1:], generator.ifs, frame, emit)

    iterated = run.evaluate(generator.iter, around or frame)
    items = elements(run, iterated, generator.iter, frame)
    if items.exact is None or not may_unroll(run, len(items.exact)):
        run.repeated += 1
        for _ in range(2):  # the second time with what the first one left behind
            element = elements(run, iterated, generator.iter, frame).any_element()
            if element:
                run.state.maybe(partial(_surely, one, element))
        run.repeated -= 1
        return False
    exact = True
    for turn, element in enumerate(items.exact):
        previous = run.enter((id(generator), turn))
        exact = one(element) and exact
        run.context = previous
    return exact


def _surely(one: Callable[[Value], bool], element: Value) -> bool:
    one(element)
    return True


def _where(
    run: Run, generators: list[ast.comprehension], tests: list[ast.expr], frame: Frame, emit: Emit
) -> bool:
    """The inner ``generators`` where all ``tests`` hold; what an undecided one lets through may be there or not."""
    if not tests:
        return _generate(run, generators, frame, emit)
    outcome = decide(run, tests[0], frame)
    if outcome is False:
        return True

    def go_on() -> bool:
        narrowed(run, tests[0], True, frame)
        return _where(run, generators, tests[1:], frame, emit)

    if outcome is True:
        return go_on()
    run.state.maybe(lambda: go_on() or True)
    return False
