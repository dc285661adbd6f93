"""Loops: followed turn by turn over known elements, else run to a fixpoint with widening."""

from __future__ import annotations

import ast
import functools
import itertools
from collections.abc import Callable, Iterator

from nodl.infer.interpreter.assign import assign
from nodl.infer.interpreter.conditions import decide, narrowed
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.iterate import elements, lose
from nodl.infer.interpreter.run import Run
from nodl.infer.models.concrete import NotConcrete, is_usable, pulled
from nodl.infer.values import Items, NativeObject, Sequence, Value, join, join_all

MAX_UNROLLED = 64  # turns, those of the loops around multiplied
MAX_UNROLLED_NUMBERS = 16  # in callbacks, where loops over numbers compute rather than name
MAX_ROUNDS = 8
WIDEN_TEXTS_FROM = 3

For = ast.For | ast.AsyncFor
Loop = ast.For | ast.AsyncFor | ast.While


def stream(run: Run, value: Value, call: Call) -> Iterator[Value]:
    """The elements of ``value`` as a loop meets them: a list may grow meanwhile, an iterator runs.

    Raises ``NotConcrete`` where that cannot be followed.
    """
    atom = value[0] if len(value) == 1 else None
    if isinstance(atom, NativeObject) and is_usable(run, atom):
        for element in pulled(run, atom, call):
            run.state.pulled += 1
            yield element
    elif isinstance(atom, Sequence) and atom.kind == "list":
        yield from _growing(atom)
    else:
        items = elements(run, value, call.node, call.frame)
        if items.exact is None:
            raise NotConcrete
        yield from items.exact


def _growing(sequence: Sequence) -> Iterator[Value]:
    for index in itertools.count():
        exact = sequence.items.exact
        if exact is None or sequence.escaped or sequence.summary:
            raise NotConcrete
        if index >= len(exact):
            return
        yield exact[index]


def _is_streamed(run: Run, value: Value) -> bool:
    atom = value[0] if len(value) == 1 else None
    if isinstance(atom, NativeObject):
        return is_usable(run, atom)
    is_list = isinstance(atom, Sequence) and atom.kind == "list" and not atom.escaped and not atom.summary
    return not run.repeated and is_list and isinstance(atom, Sequence) and atom.items.exact is not None


def run_for(run: Run, node: For, frame: Frame) -> bool:
    """``for``: turn by turn as far as elements are known, else to a fixpoint. False: control cannot pass."""
    iterated = run.evaluate(node.iter, frame)
    if _is_streamed(run, iterated):
        return _looped(run, node, frame, lambda: _streamed(run, node, iterated, frame))
    items = elements(run, iterated, node, frame)
    return _looped(run, node, frame, lambda: _for(run, node, items, frame))


def run_while(run: Run, node: ast.While, frame: Frame) -> bool:
    """``while``: turn by turn while the test is decided, then to a fixpoint. False: control cannot pass."""
    return _looped(run, node, frame, lambda: _while(run, node, frame))


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


def _streamed(run: Run, node: For, iterated: Value, frame: Frame) -> tuple[bool, bool]:
    """A loop over an iterator or a list, turn by turn; the rest at once when it cannot be followed to its end."""
    source = stream(run, iterated, Call(Arguments(), node, frame))
    seen: list[Value] = []
    broken = False
    passes, finished = True, True
    run.state.depth += 1
    start = run.state.mark()
    certain = not run.repeated and not run.state.forks
    limit = run.fuel if certain else max(1, MAX_UNROLLED // run.unrolled)
    unrolled = run.unrolled
    for index in itertools.count():
        run.unrolled = unrolled if certain else unrolled * (index + 1)
        try:
            element = next(source, None) if index < limit else _stop()
        except NotConcrete:
            _rest(run, node, iterated, seen, frame)
            break
        if element is None:
            break
        seen.append(element)
        run.turns -= 1
        passes, jumped = _followed(run, node, index, element, frame)
        broken = broken or jumped
        if not passes:
            passes, finished = broken or frame.jump == "break", broken
            break
    run.state.depth -= 1
    run.unrolled = unrolled
    if broken:
        run.state.join_seen(start)
    return passes, finished


def _stop() -> Value:
    raise NotConcrete


def _rest(run: Run, node: For, iterated: Value, seen: list[Value], frame: Frame) -> None:
    """The turns that cannot be followed: any of the elements, any number of times."""
    atom = iterated[0]
    element = join_all(seen)
    if isinstance(atom, NativeObject):
        element = join(element, lose(run, atom))
    elif isinstance(atom, Sequence):
        element = join(element, atom.items.any_element())
    if element:
        _fixpoint(run, frame, lambda: _turn(run, node.target, element, node.body, frame))


def _for(run: Run, node: For, items: Items, frame: Frame) -> tuple[bool, bool]:
    if items.exact is not None and len(items.exact) * run.unrolled <= _limit(run, items.exact, node):
        run.unrolled *= len(items.exact) or 1
        outcome = _unrolled(run, node, items.exact, frame)
        run.unrolled //= len(items.exact) or 1
        return outcome
    element = items.any_element()
    if element or items.exact is None:
        _fixpoint(run, frame, lambda: _turn(run, node.target, element, node.body, frame))
    return True, True


def _limit(run: Run, exact: tuple[Value, ...], node: For) -> int:
    numbers = all(len(element) == 1 and type(element[0]) is int for element in exact)
    if run.state.forks and not run.repeated:
        return MAX_UNROLLED
    if not run.repeated and not run.state.forks:
        followed = not numbers or len(exact) <= MAX_UNROLLED or _may_name(node)
        return run.fuel if followed else MAX_UNROLLED
    if not numbers:
        return MAX_UNROLLED
    return MAX_UNROLLED_NUMBERS if _may_name(node) else 1


@functools.lru_cache(maxsize=4096)
def _may_name(node: Loop) -> bool:
    """Whether the loop's number can become part of a text: one stands in the body, or the number is passed on."""
    counting = node.test if isinstance(node, ast.While) else node.target
    numbers = {name.id for name in ast.walk(counting) if isinstance(name, ast.Name)}
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


def _turn(run: Run, target: ast.expr, element: Value, body: list[ast.stmt], frame: Frame) -> bool:
    assign(run, target, element, frame)
    return run.execute(body, frame)


def _followed(run: Run, node: For, index: int, element: Value, frame: Frame) -> tuple[bool, bool]:
    """One turn by itself; may the next one follow, and may the loop have been left?"""
    previous = run.enter((id(node), index))
    mark = run.state.mark()
    frame.jump = ""
    passes = _turn(run, node.target, element, node.body, frame)
    run.context = previous
    if frame.unsettled:
        run.state.join_seen(mark)
        frame.unsettled = False
        return True, True
    return passes or frame.jump == "continue", False


def _unrolled(run: Run, node: For, exact: tuple[Value, ...], frame: Frame) -> tuple[bool, bool]:
    """One turn after the other; can control pass the loop, and may it have run to its end?"""
    start = run.state.mark()
    broken, outcome = False, (True, True)
    run.state.depth += 1
    for index, element in enumerate(exact):
        run.turns -= not run.repeated
        passes, jumped = _followed(run, node, index, element, frame)
        broken = broken or jumped
        if not passes:
            outcome = broken or frame.jump == "break", broken
            break
    run.state.depth -= 1
    if broken:
        run.state.join_seen(start)
    return outcome


def _while(run: Run, node: ast.While, frame: Frame) -> tuple[bool, bool]:
    """Turn by turn while the test is decided, then to a fixpoint; can control pass, and through the test?"""
    run.state.depth += 1
    start = run.state.mark()
    turn = 0
    broken = False
    while True:
        outcome = decide(run, node.test, frame)
        if outcome is False:
            run.state.depth -= 1
            return True, True
        if outcome is None or not _fuel(run, node, turn):
            break
        turn += 1
        version, mark = run.state.version(), run.state.mark()
        previous, unrolled = run.enter((id(node), turn)), run.unrolled
        run.unrolled *= MAX_UNROLLED_NUMBERS if run.repeated else 1
        frame.jump = ""
        passes = run.execute(node.body, frame)
        run.context, run.unrolled = previous, unrolled
        if frame.unsettled:
            run.state.join_seen(mark)
            frame.unsettled = False
            broken = True
            break
        if not passes and frame.jump != "continue":
            run.state.depth -= 1
            return frame.jump == "break", False
        if run.state.version() == version and run.state.unchanged_since(mark):
            break  # it would go on like this without end
    run.state.depth -= 1
    passes, finished = _repeated_while(run, node, frame, broken)
    if broken:
        run.state.join_seen(start)
    return passes, finished


def _fuel(run: Run, node: ast.While, turn: int) -> bool:
    if run.repeated:
        return turn * run.unrolled < MAX_UNROLLED_NUMBERS and _may_name(node)
    run.turns -= 1
    return run.fuel > 0


def _repeated_while(run: Run, node: ast.While, frame: Frame, broken: bool) -> tuple[bool, bool]:
    endless = isinstance(node.test, ast.Constant)

    def turn() -> bool:
        nonlocal broken
        narrowed(run, node.test, True, frame)
        passes = run.execute(node.body, frame)
        broken = broken or frame.unsettled
        if passes:
            run.evaluate(node.test, frame)
        return passes

    _fixpoint(run, frame, turn)
    if broken or not endless:
        narrowed(run, node.test, False, frame)
        return True, not endless
    return False, False  # ``while True`` without break: only return or an exception leaves it


def _fixpoint(run: Run, frame: Frame, turn: Callable[[], bool]) -> None:
    run.repeated += 1
    run.state.depth += 1
    found = 0 if run.state.forks else run.state.found()
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
    if not run.state.forks and run.state.found() != found:
        run.state.stakes += 1
    if jumped:
        run.state.join_seen(start)
