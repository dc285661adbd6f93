"""``with``: context managers of the program and of libraries."""

from __future__ import annotations

import ast
import io

from nodl.infer.interpreter import loops, special
from nodl.infer.interpreter.assign import assign
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.iterate import lose
from nodl.infer.interpreter.raising import Attempt, Raised
from nodl.infer.interpreter.run import Run
from nodl.infer.methods import BoundMethod
from nodl.infer.models.concrete import NotConcrete
from nodl.infer.values import (
    ANY,
    BOTTOM,
    NONE,
    ClassValue,
    External,
    Instance,
    NativeObject,
    Sequence,
    Unknown,
    Value,
    join,
)


def run_with(run: Run, node: ast.With | ast.AsyncWith, frame: Frame) -> bool:
    """``with``: the body, whose exceptions the managers may swallow. False: control cannot pass."""
    managers: list[Value] = []
    for item in node.items:
        manager = run.evaluate(item.context_expr, frame)
        managers.append(manager)
        entered = _entered(run, manager, node, frame)
        if item.optional_vars is not None:
            assign(run, item.optional_vars, entered, frame)
    if any(_may_swallow(atom) for manager in managers for atom in manager):
        return _swallowing(run, node, managers, frame)
    before = frame.raised
    frame.raised = False
    mark = run.state.mark()
    passes = run.execute(node.body, frame)
    if not passes and frame.raised and any(_is_unknown(atom) for manager in managers for atom in manager):
        run.state.join_seen(mark)  # a manager that is not known may swallow an exception
        passes = True
    frame.raised = before or frame.raised
    _exited(run, managers, node, frame)
    return passes


def _is_unknown(atom: object) -> bool:
    return not isinstance(atom, External) or not atom.path.startswith(_PLAIN_MANAGERS)


_PLAIN_MANAGERS = ("threading.", "builtins.open", "rclpy.", "multiprocessing.")


def _may_swallow(atom: object) -> bool:
    if isinstance(atom, Instance) and isinstance(atom.cls, ClassValue):
        leave = special.method(atom, "__exit__")
        nodes = [each.function.node for each in leave if isinstance(each, BoundMethod)]
        return any(isinstance(part, ast.Return) and part.value for each in nodes for part in ast.walk(each))
    return isinstance(atom, Unknown) and "contextlib.suppress" in atom.why


def _swallowing(run: Run, node: ast.With | ast.AsyncWith, managers: list[Value], frame: Frame) -> bool:
    """``contextlib.suppress``, or a manager of the program that may return true: the body up to an exception."""
    mark = run.state.mark()
    attempt = Attempt(run, frame)
    try:
        passes = run.execute(node.body, frame)
        certain = False
    except Raised:
        passes, certain = True, run.risks - attempt.risks <= 1
    attempt.end(run, frame)
    if not certain and run.risks != attempt.risks:
        run.state.join_seen(mark)
        passes = True
    _exited(run, managers, node, frame)
    return passes


def _entered(run: Run, manager: Value, node: ast.AST, frame: Frame) -> Value:
    result: Value = ()
    for atom in manager:
        if isinstance(atom, Instance):
            enter = run.attribute((atom,), "__enter__", node, frame)
            result = join(result, run.call(enter, Arguments(), node, frame))
        elif isinstance(atom, Sequence) and atom.kind == "generator":
            result = join(result, atom.items.any_element())
        elif isinstance(atom, NativeObject) and isinstance(atom.object, io.IOBase):
            result = join(result, (atom,))
        elif isinstance(atom, NativeObject):
            result = join(result, _advanced(run, atom, node, frame) or NONE)
        else:
            result = join(result, ANY)
    return result or ANY


def _advanced(run: Run, atom: NativeObject, node: ast.AST, frame: Frame) -> Value:
    """One step of the generator behind a ``contextlib.contextmanager``."""
    try:
        return next(loops.stream(run, (atom,), Call(Arguments(), node, frame)), BOTTOM)
    except (NotConcrete, TypeError):
        return lose(run, atom)


def _exited(run: Run, managers: list[Value], node: ast.AST, frame: Frame) -> None:
    """``__exit__`` without an exception, and perhaps with one."""
    for atom in (atom for manager in reversed(managers) for atom in manager):
        leave = special.method(atom, "__exit__") or special.method(atom, "__aexit__")
        if isinstance(atom, NativeObject) and not isinstance(atom.object, io.IOBase):
            _advanced(run, atom, node, frame)
        if leave:
            run.call(leave, Arguments([NONE, NONE, NONE]), node, frame)
            run.register_callback(leave, 3)
