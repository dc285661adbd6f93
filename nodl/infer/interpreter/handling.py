"""``try``: handlers run after a certain exception, or where one may have been raised."""

from __future__ import annotations

import ast
from functools import partial
from typing import Any

from nodl.infer.interpreter.frames import Frame
from nodl.infer.interpreter.iterate import elements
from nodl.infer.interpreter.raising import Attempt, Raised, catches
from nodl.infer.interpreter.run import Run
from nodl.infer.values import ANY, Sequence, Value, external, join


def run_try(run: Run, node: Any, frame: Frame) -> bool:
    """Handlers run after a certain exception, or after any prefix of a body that may have raised one."""
    mark = run.state.mark()
    attempt, returned = Attempt(run, frame), frame.returned
    raised = None
    try:
        passes = run.execute(node.body, frame)
    except Raised as found:
        raised, passes = found, False
    jump = frame.jump
    attempt.end(run, frame)
    frame.jump = jump if raised is None else ""
    if passes and node.orelse:
        passes = run.execute(node.orelse, frame)
    try:
        if raised is not None and run.risks - attempt.risks <= 1:
            passes = _handled(run, node.handlers, raised, frame)
        elif raised is not None or run.risks != attempt.risks:
            passes = _perhaps_handled(run, node, passes, mark, frame)
    except Raised:
        if node.finalbody and swallows(run, node.finalbody, frame):
            return False
        raise
    if node.finalbody:
        return _finally(run, node.finalbody, returned, passes, mark, frame)
    return passes


def swallows(run: Run, body: list[ast.stmt], frame: Frame) -> bool:
    """Whether a ``finally`` that runs for an exception returns or jumps, perhaps: the exception is gone then."""
    before = frame.returned
    if not run.execute(body, frame):
        return True
    if frame.returned == before:
        return False
    run.risks += 1  # it may still be on its way
    return True


def _finally(run: Run, body: list[ast.stmt], returned: Value, passes: bool, mark: int, frame: Frame) -> bool:
    """``finally`` after what did not raise. Where it returns itself, what the statement returned is replaced by that;
    ``returned``: by what stands before the statement."""
    jump, within = frame.jump, frame.returned
    frame.returned = returned
    if not passes:
        run.state.join_seen(mark)
    done = run.execute(body, frame)
    if done:
        frame.returned = join(within, frame.returned)
        frame.jump = frame.jump if passes else jump
    return done and passes


def _handled(run: Run, handlers: list[ast.ExceptHandler], raised: Raised, frame: Frame) -> bool:
    """The handler that certainly catches the exception, or the exception again."""
    for handler in handlers:
        outcome = catches(_classes_of(run, handler, frame), raised)
        if outcome is None:
            break
        if outcome:
            return _run_handler(run, handler, raised.value, frame)
    else:
        raise raised
    return run.state.branches([partial(_run_handler, run, each, raised.value, frame) for each in handlers])


def _classes_of(run: Run, handler: ast.ExceptHandler, frame: Frame) -> Value:
    """The classes that a handler names, as one alternative each; all exceptions for a bare ``except``."""
    if handler.type is None:
        return external("builtins.BaseException")
    value = run.evaluate(handler.type, frame)
    if len(value) == 1 and isinstance(value[0], Sequence):
        return elements(run, value, handler, frame).any_element()
    return value


def _run_handler(run: Run, handler: ast.ExceptHandler, value: Value, frame: Frame) -> bool:
    if handler.name:
        run.assign_name(handler.name, value, frame)
    outer = frame.cells.get("[exception]")
    run.assign_name("[exception]", value, frame)
    passes = run.execute(handler.body, frame)
    if outer is not None:
        run.assign_name("[exception]", outer, frame)
    return passes


def _perhaps_handled(run: Run, node: Any, passes: bool, mark: int, frame: Frame) -> bool:
    """Each handler may run: it sees every value written on the way through the body."""

    def handle(handler: ast.ExceptHandler) -> bool:
        run.state.join_seen(mark)
        return _run_handler(run, handler, ANY, frame)

    if not node.handlers:
        return passes
    jump = frame.jump
    result = run.state.branches([lambda: passes, *(partial(handle, handler) for handler in node.handlers)])
    if not passes:
        if jump:
            frame.unsettled = True  # the jump of the body may happen, or a handler runs instead
        else:
            frame.early = True
    return result
