"""Loops and comprehensions: turn by turn over elements that are known, else to a fixpoint with widening."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable

from enclave_addons.inference.interpreter.conditions import decide, narrowed
from enclave_addons.inference.interpreter.elements import assign, elements, store_item
from enclave_addons.inference.interpreter.run import Run
from enclave_addons.inference.values import LAZY, Dictionary, Frame, Items, LocalCells, Value, join_all

MAX_UNROLLED = 64  # turns, those of the loops around multiplied
MAX_UNROLLED_AGAIN = 16  # in what is repeated itself
MAX_ROUNDS = 8
WIDEN_TEXTS_FROM = 3

For = ast.For | ast.AsyncFor
Loop = ast.For | ast.AsyncFor | ast.While
Comprehension = ast.ListComp | ast.SetComp | ast.GeneratorExp | ast.DictComp


def run_for(run: Run, node: For, frame: Frame) -> bool:
    """Run ``for``: turn by turn if all elements are known, else to a fixpoint. Return False if control cannot pass."""
    iterated = run.evaluate(node.iter, frame)
    return _looped(run, node, frame, lambda: _for(run, node, iterated, frame))


def run_while(run: Run, node: ast.While, frame: Frame) -> bool:
    """Run ``while``: to a fixpoint, unless the test is false at once. Return False if control cannot pass."""
    return _looped(run, node, frame, lambda: _while(run, node, frame))


def may_unroll(run: Run, count: int) -> bool:
    """Return True if so many turns are followed one by one here."""
    return count * run.unrolled <= (MAX_UNROLLED_AGAIN if run.repeated else MAX_UNROLLED)


def _looped(run: Run, node: Loop, frame: Frame, turns: Callable[[], bool]) -> bool:
    """Run the ``turns`` of a loop, then perhaps its ``else``. Return False if control cannot pass."""
    before, loop_forks = frame.unsettled, frame.loop_forks
    frame.unsettled = ""
    frame.loop_forks = run.state.forks
    passes = turns()
    left = frame.jump == "break"
    frame.unsettled, frame.loop_forks = before, loop_forks
    frame.jump = ""
    if passes and node.orelse and not _breaks(node):
        return run.execute(node.orelse, frame)
    if passes and node.orelse and not left:
        run.state.maybe(lambda: run.execute(node.orelse, frame))
    return passes


@functools.lru_cache(maxsize=4096)
def _breaks(node: Loop) -> bool:
    return any(isinstance(inner, ast.Break) for inner in ast.walk(node))


def _for(run: Run, node: For, iterated: Value, frame: Frame) -> bool:
    items = elements(run, iterated, node, frame)
    exact = items.exact or ()
    if items.exact is not None and may_unroll(run, len(exact)):
        run.unrolled *= len(exact) or 1
        passes = _unrolled(run, node, exact, frame)
        run.unrolled //= len(exact) or 1
        if not passes or elements(run, iterated, node, frame) == items:
            return passes

    def turn() -> bool:  # what is iterated over may change meanwhile
        element = elements(run, iterated, node, frame).any_element()
        if not element:
            return True
        assign(run, node.target, element, frame)
        return run.execute(node.body, frame)

    fixpoint(run, frame, turn)
    return True


def _unrolled(run: Run, node: For, exact: tuple[Value, ...], frame: Frame) -> bool:
    """Run one turn after the other. Return False if control cannot pass; ``break`` is the jump if it certainly ran."""
    start, guards = run.state.mark(), run.guards
    broken, passes = False, True
    run.state.depth += 1
    for index, element in enumerate(exact):
        passes, jumped = _followed(run, node, index, element, frame)
        broken = broken or jumped
        if not passes:
            break
    run.state.depth -= 1
    left = broken or (not passes and frame.jump == "break")
    if broken:
        run.state.join_seen(start, mixed=True)
    if left:
        run.guards = guards
    frame.jump = "break" if left and not broken else ""
    return passes or left


def _followed(run: Run, node: For, index: int, element: Value, frame: Frame) -> tuple[bool, bool]:
    """Run one turn by itself; may the next one follow, and may the loop have been left?"""
    previous = run.enter((id(node), index))
    mark = run.state.mark()
    frame.jump = ""
    assign(run, node.target, element, frame)
    passes = run.execute(node.body, frame)
    run.context = previous
    jumped, frame.unsettled = frame.unsettled, ""
    if jumped:
        run.state.join_seen(mark, mixed=True)
    if passes and jumped != "continue":
        run.guards = run.guards_at_end  # what a test of a parameter let through comes to the next turn
    return passes or bool(jumped) or frame.jump == "continue", bool(jumped)


def _while(run: Run, node: ast.While, frame: Frame) -> bool:
    if decide(run, node.test, frame) is False:
        return True
    broken = False

    def turn() -> bool:
        nonlocal broken
        narrowed(run, node.test, True, frame)
        passes = run.execute(node.body, frame)
        broken = broken or bool(frame.unsettled)
        run.evaluate(node.test, frame)
        return passes

    fixpoint(run, frame, turn)
    if not _breaks(node):
        narrowed(run, node.test, False, frame)
    endless = isinstance(node.test, ast.Constant)  # only break, return or an exception leaves ``while True``
    return broken or not endless


def fixpoint(run: Run, frame: Frame, turn: Callable[[], bool]) -> None:
    """Run ``turn`` as something that happens any number of times, until it changes nothing."""
    run.repeated += 1
    run.state.depth += 1
    run.state.forks += 1
    start = run.state.mark()
    jumped = False
    for count in range(MAX_ROUNDS):
        mark = run.state.mark()
        passes = turn()
        if frame.unsettled or not passes:
            jumped = True
            frame.unsettled = ""
            run.state.join_seen(mark, mixed=True)
        if run.state.join_head(mark, count >= WIDEN_TEXTS_FROM):
            break
    else:
        frame_source = frame.function.node if frame.function else frame.module.source.tree
        run.gap(frame_source, frame, "a loop whose values do not settle; names made in it may be missing")
    run.state.depth -= 1
    run.state.forks -= 1
    run.repeated -= 1
    frame.jump = ""
    if jumped:
        run.state.join_seen(start, mixed=True)


class Element(ast.stmt):
    """Stands in the innermost loop that a comprehension is read as, for what an element is made of."""


@functools.cache
def _as_loop(node: Comprehension) -> ast.For:
    """Return the loops and tests that a comprehension stands for (language reference, 6.2.4)."""
    body: list[ast.stmt] = [Element()]
    for generator in reversed(node.generators):
        for test in reversed(generator.ifs):
            body = [ast.If(test, body, [])]
        body = [ast.For(generator.target, generator.iter, body, [])]
    loop = ast.fix_missing_locations(ast.copy_location(body[0], node))
    assert isinstance(loop, ast.For)
    return loop


def _each_element(run: Run, node: Comprehension, frame: Frame, make: Callable[[Frame], None]) -> bool:
    """Call ``make`` for each element, in the frame of the comprehension. True: exactly these, in this order."""
    inner = _inner_frame(run, frame)
    forks, exact = run.state.forks, True

    def element() -> None:
        nonlocal exact
        exact = exact and run.state.forks == forks
        run.spend(1)
        make(inner)

    inner.element = element
    loop = _as_loop(node)
    iterated = run.evaluate(loop.iter, frame)
    _looped(run, loop, inner, lambda: _for(run, loop, iterated, inner))
    if type(inner.cells) is LocalCells and not inner.cells.shared:
        inner.cells.dead = True  # no function made in it lives on
    return exact


def run_element(run: Run, node: Element, frame: Frame) -> bool:
    """Make one element of the comprehension that ``frame`` belongs to."""
    assert frame.element is not None
    frame.element()
    return True


def comprehension(run: Run, node: ast.ListComp | ast.SetComp | ast.GeneratorExp, frame: Frame) -> Value:
    """Return a list (a set for a set comprehension), exact only where iterables and conditions are decided."""
    lazy = isinstance(node, ast.GeneratorExp)
    run.state.depth += lazy
    collected: list[Value] = []
    mark = run.state.mark()
    exact = _each_element(run, node, frame, lambda inner: collected.append(run.evaluate(node.elt, inner)))
    run.state.depth -= lazy
    if lazy:
        run.changes_at_any_time(run.state.seen(mark), certainly=True)
        run.state.join_seen(mark, mixed=True)  # it may be asked for some of its elements only
    kind = {ast.SetComp: "set", ast.GeneratorExp: LAZY}.get(type(node), "list")
    return run.sequence(node, kind, Items(tuple(collected)) if exact else Items(None, join_all(collected)))


def dict_comprehension(run: Run, node: ast.DictComp, frame: Frame) -> Value:
    """Return a dictionary with the entries of all turns whose conditions are not certainly false."""
    result = run.allocate(node, "dict", Dictionary)
    _each_element(
        run, node, frame,
        lambda inner: store_item(run, result, run.evaluate(node.key, inner), run.evaluate(node.value, inner)),
    )  # fmt: skip
    return (result,)


def _inner_frame(run: Run, frame: Frame) -> Frame:
    """Make the frame of a comprehension; in a class body it does not see the names of the class (reference, 4.2.2)."""
    closure = frame.closure if frame.is_class else frame
    inner = Frame(frame.module, LocalCells(), closure, run.state.depth)
    inner.function = frame.function
    inner.entry = frame.entry
    inner.is_comprehension = True
    return inner
