"""Generators of the program, run step by step as they are consumed.

``steps`` is a Python generator that executes the body of the program's generator up to its next ``yield``. It handles
``yield`` as a statement, as the value of an assignment, and inside decided branches and loops; what it cannot follow
raises ``NotConcrete``, and the body is then run as a whole, its yields joined.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Generator
from types import GeneratorType
from typing import Any

from nodl.infer.interpreter import loops
from nodl.infer.interpreter.assign import assign
from nodl.infer.interpreter.conditions import decide
from nodl.infer.interpreter.frames import Call, Frame
from nodl.infer.interpreter.handling import swallows
from nodl.infer.interpreter.raising import Raised
from nodl.infer.interpreter.run import Run
from nodl.infer.models.concrete import NotConcrete, from_python, to_python
from nodl.infer.values import NONE, FunctionValue, LocalCells, NativeObject, Value

Steps = Generator[Any, Any, bool]


def is_generator(function: FunctionValue) -> bool:
    """Whether a function's own body has a ``yield``."""
    return function.module.source.has_yield and _is_generator(function.node)


@functools.lru_cache(maxsize=8192)
def _is_generator(node: ast.AST) -> bool:
    body = [node.body] if isinstance(node, ast.Lambda) else getattr(node, "body", [])
    return any(_yields(statement) for statement in body)


@functools.lru_cache(maxsize=8192)
def _yields(node: ast.AST) -> bool:
    left = [node]
    while left:
        part = left.pop()
        if isinstance(part, ast.Yield | ast.YieldFrom):
            return True
        if not isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef):
            left.extend(ast.iter_child_nodes(part))
    return False


def steps(run: Run, function: FunctionValue, cells: LocalCells, call: Call) -> Generator[Any, Any, None]:
    """The elements that a call of ``function`` yields, as real objects."""
    closure = function.closure
    assert closure is None or isinstance(closure, Frame)
    frame = Frame(function.module, cells, closure, run.state.depth)
    frame.function = function
    assert not isinstance(function.node, ast.Lambda)
    inner = _body(run, function.node.body, frame, call)
    place = ("generator", id(call.node), next(run.callback_count))
    sent: Any = None
    while True:
        frame.forks = frame.loop_forks = run.state.forks
        frame.depth = run.state.depth
        run.stack.append(function.node)
        previous = run.enter(place)
        try:
            element = inner.send(sent)
        except StopIteration:
            return
        finally:
            if run.stack and run.stack[-1] is function.node:
                run.stack.pop()
            run.context = previous
        sent = yield element


def _body(run: Run, body: list[ast.stmt], frame: Frame, call: Call) -> Steps:
    for statement in body:
        if _yields(statement):
            run.executed.add(statement)
            passes = yield from _statement(run, statement, frame, call)
        else:
            passes = run.execute([statement], frame)
        if frame.early or frame.unsettled:
            raise NotConcrete
        if not passes:
            return False
    return True


def _statement(run: Run, node: ast.stmt, frame: Frame, call: Call) -> Steps:
    if isinstance(node, ast.Expr | ast.Assign | ast.AnnAssign | ast.Return):
        value = yield from _value(run, node.value, frame, call)
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for target in targets:
            if target is not None:
                assign(run, target, value, frame)
        return not isinstance(node, ast.Return)
    if isinstance(node, ast.If):
        outcome = decide(run, node.test, frame)
        if outcome is None:
            raise NotConcrete
        return (yield from _body(run, node.body if outcome else node.orelse, frame, call))
    if isinstance(node, ast.For):
        return (yield from _for(run, node, frame, call))
    if isinstance(node, ast.While):
        return (yield from _while(run, node, frame, call))
    if isinstance(node, ast.Try) and not node.handlers:
        return (yield from _try_finally(run, node, frame, call))
    raise NotConcrete


def _value(run: Run, node: ast.expr | None, frame: Frame, call: Call) -> Generator[Any, Any, Value]:
    if isinstance(node, ast.Yield):
        given = NONE if node.value is None else run.evaluate(node.value, frame)
        sent = yield to_python(run, given, call, level=1)
        return from_python(run, sent, call)
    if isinstance(node, ast.YieldFrom):
        iterated = run.evaluate(node.value, frame)
        atom = iterated[0] if len(iterated) == 1 else None
        if isinstance(atom, NativeObject) and isinstance(atom.object, GeneratorType):
            yield from atom.object
            return NONE
        for element in loops.stream(run, iterated, Call(call.args, node, frame)):
            yield to_python(run, element, call, level=1)
        return NONE
    raise NotConcrete


def _for(run: Run, node: ast.For, frame: Frame, call: Call) -> Steps:
    elements = loops.stream(run, run.evaluate(node.iter, frame), Call(call.args, node, frame))
    for index, element in enumerate(elements):
        previous = run.enter((id(node), index))
        assign(run, node.target, element, frame)
        run.context = previous
        ended = yield from _turn(run, node.body, frame, call)
        if ended is not None:
            return ended
    return (yield from _body(run, node.orelse, frame, call))


def _while(run: Run, node: ast.While, frame: Frame, call: Call) -> Steps:
    while True:
        outcome = decide(run, node.test, frame)
        if outcome is None or run.fuel <= 0:
            raise NotConcrete
        if not outcome:
            return (yield from _body(run, node.orelse, frame, call))
        run.turns -= 1
        ended = yield from _turn(run, node.body, frame, call)
        if ended is not None:
            return ended


def _turn(run: Run, body: list[ast.stmt], frame: Frame, call: Call) -> Generator[Any, Any, bool | None]:
    """One turn of a loop. ``None``: the next one follows; else whether control passes the loop."""
    frame.jump = ""
    passes = yield from _body(run, body, frame, call)
    jump, frame.jump = frame.jump, ""
    if passes or jump == "continue":
        return None
    return jump == "break"


def _try_finally(run: Run, node: ast.Try, frame: Frame, call: Call) -> Steps:
    try:
        passes = yield from _body(run, [*node.body, *node.orelse], frame, call)
    except Raised:
        if swallows(run, node.finalbody, frame):
            return False
        raise
    return run.execute(node.finalbody, frame) and passes
