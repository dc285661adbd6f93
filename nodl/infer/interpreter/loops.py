"""Loops: turn by turn over elements that are known, else to a fixpoint with widening."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable

from nodl.infer.interpreter.assign import assign
from nodl.infer.interpreter.conditions import decide
from nodl.infer.interpreter.frames import Frame
from nodl.infer.interpreter.iterate import elements
from nodl.infer.interpreter.run import Run
from nodl.infer.values import Value

MAX_UNROLLED = 64  # turns, those of the loops around multiplied
MAX_UNROLLED_AGAIN = 16  # in what is repeated itself
MAX_ROUNDS = 8
WIDEN_TEXTS_FROM = 3

For = ast.For | ast.AsyncFor
Loop = ast.For | ast.AsyncFor | ast.While


def run_for(run: Run, node: For, frame: Frame) -> bool:
    """``for``: turn by turn if all elements are known, else to a fixpoint. False: control cannot pass."""
    iterated = run.evaluate(node.iter, frame)
    return _looped(run, node, frame, lambda: _for(run, node, iterated, frame))


def run_while(run: Run, node: ast.While, frame: Frame) -> bool:
    """``while``: to a fixpoint, unless the test is false at once. False: control cannot pass."""
    return _looped(run, node, frame, lambda: _while(run, node, frame))


def may_unroll(run: Run, count: int) -> bool:
    """Whether so many turns are followed one by one here."""
    return count * run.unrolled <= (MAX_UNROLLED_AGAIN if run.repeated else MAX_UNROLLED)


def _looped(run: Run, node: Loop, frame: Frame, turns: Callable[[], tuple[bool, bool]]) -> bool:
    """The ``turns`` of a loop, which tell whether control can pass it, and whether at its end; then its ``else``."""
    before, loop_forks = frame.unsettled, frame.loop_forks
    frame.unsettled = False
    frame.loop_forks = run.state.forks
    passes, finished = turns()
    frame.unsettled, frame.loop_forks = before, loop_forks
    frame.jump = ""
    if passes and finished and node.orelse:
        return run.execute(node.orelse, frame)
    return passes


def _for(run: Run, node: For, iterated: Value, frame: Frame) -> tuple[bool, bool]:
    passes = finished = True
    items = elements(run, iterated, node, frame)
    exact = items.exact or ()
    counts = all(len(each) == 1 and type(each[0]) is int for each in exact) and not _may_name(node)
    if items.exact is not None and may_unroll(run, len(exact)) and not (exact and counts):
        run.unrolled *= len(exact) or 1
        passes, finished = _unrolled(run, node, exact, frame)
        run.unrolled //= len(exact) or 1
        if not passes or elements(run, iterated, node, frame) == items:
            return passes, finished

    def turn() -> bool:  # what is iterated over may change meanwhile
        element = elements(run, iterated, node, frame).any_element()
        if not element:
            return True
        assign(run, node.target, element, frame)
        return run.execute(node.body, frame)

    fixpoint(run, frame, turn)
    return True, finished


@functools.lru_cache(maxsize=4096)
def _may_name(node: For) -> bool:
    """Whether the loop's number can become part of a text: one stands in the body, or the number is passed on."""
    numbers = {name.id for name in ast.walk(node.target) if isinstance(name, ast.Name)}
    for part in (inner for statement in node.body for inner in ast.walk(statement)):
        if isinstance(part, ast.JoinedStr) or (
            isinstance(part, ast.Constant) and isinstance(part.value, str)
        ):
            return True
        if isinstance(part, ast.Call):
            given = (*part.args, *(keyword.value for keyword in part.keywords))
            if any(isinstance(argument, ast.Name) and argument.id in numbers for argument in given):
                return True
    return False


def _unrolled(run: Run, node: For, exact: tuple[Value, ...], frame: Frame) -> tuple[bool, bool]:
    """One turn after the other; can control pass the loop, and may it have run to its end?"""
    start = run.state.mark()
    broken, outcome = False, (True, True)
    run.state.depth += 1
    for index, element in enumerate(exact):
        passes, jumped = _followed(run, node, index, element, frame)
        broken = broken or jumped
        if not passes:
            outcome = broken or frame.jump == "break", broken
            break
    run.state.depth -= 1
    if broken:
        run.state.join_seen(start)
    return outcome


def _followed(run: Run, node: For, index: int, element: Value, frame: Frame) -> tuple[bool, bool]:
    """One turn by itself; may the next one follow, and may the loop have been left?"""
    previous = run.enter((id(node), index))
    mark = run.state.mark()
    frame.jump = ""
    assign(run, node.target, element, frame)
    passes = run.execute(node.body, frame)
    run.context = previous
    if frame.unsettled:
        run.state.join_seen(mark)
        frame.unsettled = False
        return True, True
    return passes or frame.jump == "continue", False


def _while(run: Run, node: ast.While, frame: Frame) -> tuple[bool, bool]:
    if decide(run, node.test, frame) is False:
        return True, True
    broken = False

    def turn() -> bool:
        nonlocal broken
        passes = run.execute(node.body, frame)
        broken = broken or frame.unsettled
        run.evaluate(node.test, frame)
        return passes

    fixpoint(run, frame, turn)
    endless = isinstance(node.test, ast.Constant)
    return (
        broken or not endless,
        not endless,
    )  # without a break only return or an exception leaves ``while True``


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
            frame.unsettled = False
            run.state.join_seen(mark)
        if run.state.join_head(mark, count >= WIDEN_TEXTS_FROM):
            break
    else:
        frame_source = frame.function.node if frame.function else frame.module.source.tree
        run.gap(frame_source, frame, "a loop whose values do not settle; names made in it may be missing")
    run.state.depth -= 1
    run.state.forks -= 1
    run.repeated -= 1
    if jumped:
        run.state.join_seen(start)
