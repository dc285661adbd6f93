"""Statements: sequencing, branches, exceptions, definitions. Each handler: can control pass it?"""

from __future__ import annotations

import ast
import io
from collections.abc import Callable
from typing import Any

from nodl.infer.interpreter import imports, loops, patterns, special
from nodl.infer.interpreter.assign import assign, assign_unknown, delete
from nodl.infer.interpreter.conditions import decide, forked, narrowed
from nodl.infer.interpreter.define import define_class, define_function
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.iterate import lose
from nodl.infer.interpreter.operators import binary_operation
from nodl.infer.interpreter.raising import (
    Raised,
    Unwinding,
    catches,
    handled_value,
    throw,
    throw_value,
)
from nodl.infer.interpreter.run import Executor, Run
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
    sole,
)


def _expression(run: Run, node: ast.Expr, frame: Frame) -> bool:
    if type(node.value) is not ast.Constant:
        run.evaluate(node.value, frame)
        if type(node.value) is ast.Call and _never_returns(run, node.value.func, frame):
            throw(run, SystemExit)
            _leave(run, frame)
            return False
    return True


_ENDS = frozenset({"sys.exit", "os._exit", "builtins.exit", "builtins.quit"})


def _never_returns(run: Run, function: ast.expr, frame: Frame) -> bool:
    name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    if name not in ("exit", "_exit", "quit"):
        return False
    atom = sole(run.evaluate(function, frame))
    return isinstance(atom, External) and atom.path in _ENDS


def _assignment(run: Run, node: ast.Assign, frame: Frame) -> bool:
    value = run.evaluate(node.value, frame)
    for target in node.targets:
        assign(run, target, value, frame)
    return True


def _annotated(run: Run, node: ast.AnnAssign, frame: Frame) -> bool:
    if node.value is not None:
        assign(run, node.target, run.evaluate(node.value, frame), frame)
    return True


def _augmented(run: Run, node: ast.AugAssign, frame: Frame) -> bool:
    old = run.evaluate(_as_load(node.target), frame)
    added = run.evaluate(node.value, frame)
    if special.has_own(old):
        changed = special.in_place(run, old, node.op, added, node, frame)
        if changed:
            assign(run, node.target, changed, frame)
            return True
    if isinstance(node.op, ast.Add | ast.BitOr):
        mutated = [atom for atom in old if isinstance(atom, Sequence) and atom.kind in ("list", "set")]
        for atom in mutated:
            run.call(
                run.attribute((atom,), "extend" if atom.kind == "list" else "update", node, frame),
                Arguments([added]),
                node,
                frame,
            )
        if mutated and len(mutated) == len(old):
            return True
    assign(run, node.target, binary_operation(run, node, old, node.op, added, frame), frame)
    return True


def _as_load(target: ast.expr) -> ast.expr:
    if isinstance(target, ast.Name):
        return ast.copy_location(ast.Name(target.id, ast.Load()), target)
    return target  # attributes and subscripts are read by the same handlers whatever their context


def _if(run: Run, node: ast.If, frame: Frame) -> bool:
    outcome = decide(run, node.test, frame)
    if outcome is None:
        outcome = forked(run, node.test, frame)
    if outcome is not None:
        return run.execute(node.body if outcome else node.orelse, frame)

    def taken() -> bool:
        narrowed(run, node.test, True, frame)
        return run.execute(node.body, frame)

    def other() -> bool:
        narrowed(run, node.test, False, frame)
        return run.execute(node.orelse, frame)

    return run.state.branches((taken, other))


def _return(run: Run, node: ast.Return, frame: Frame) -> bool:
    value = NONE if node.value is None else run.evaluate(node.value, frame)
    frame.returned = join(frame.returned, value)
    _leave(run, frame)
    return False


def _leave(run: Run, frame: Frame) -> None:
    frame.jump = ""
    if run.state.forks > frame.forks:
        frame.early = True
        run.state.stakes += not run.repeated


def _raise(run: Run, node: ast.Raise, frame: Frame) -> bool:
    frame.raised = True
    value = run.evaluate(node.exc, frame) if node.exc is not None else frame.cells.get("[exception]", ANY)
    if node.cause is not None:
        run.evaluate(node.cause, frame)
    if len(value) == 1 and isinstance(value[0], ClassValue):
        value = run.call(value, Arguments(), node, frame)
    throw_value(run, value)
    _leave(run, frame)
    return False


def _jump(run: Run, node: ast.Break | ast.Continue, frame: Frame) -> bool:
    if run.state.forks == frame.loop_forks:
        frame.jump = "break" if isinstance(node, ast.Break) else "continue"
    else:
        frame.unsettled = True
        run.state.stakes += not run.repeated
    return False


def _try(run: Run, node: Any, frame: Frame) -> bool:
    """Handlers run after a certain exception, or after any prefix of a body that may have raised one."""
    mark = run.state.mark()
    before = Unwinding(run, frame)
    risks = run.risks
    raised = None
    run.state.depth += 1
    run.tries += 1
    run.try_forks = run.state.forks
    tries = run.tries
    try:
        passes = run.execute(node.body, frame)
    except Raised as found:
        raised, passes = found, False
    jump = frame.jump
    before.restore(run, frame)
    frame.jump = jump if raised is None else ""
    run.tries = tries - 1
    if passes and node.orelse:
        passes = run.execute(node.orelse, frame)
    try:
        if raised is not None and run.risks - risks <= raised_risks(raised):
            passes = _handled(run, node.handlers, raised, frame)
        elif raised is not None or run.risks != risks:
            passes = _perhaps_handled(run, node, passes, mark, frame)
    except Raised:
        if node.finalbody:
            run.execute(node.finalbody, frame)
        raise
    if node.finalbody:
        if not passes:
            jump = frame.jump
            run.state.join_seen(mark)
            done = run.execute(node.finalbody, frame)
            frame.jump = jump if done else frame.jump
            return False
        passes = run.execute(node.finalbody, frame)
    return passes


def raised_risks(raised: Raised) -> int:
    """A certain exception is itself one risk."""
    return 1


def _handled(run: Run, handlers: list[ast.ExceptHandler], raised: Raised, frame: Frame) -> bool:
    """The handler that certainly catches the exception, or the exception again."""
    for handler in handlers:
        outcome = catches(handled_value(run, handler, frame), raised)
        if outcome is None:
            break
        if outcome:
            return _run_handler(run, handler, raised.value, frame)
    else:
        raise raised
    return run.state.branches([_handler_of(run, handler, raised.value, frame) for handler in handlers])


def _handler_of(run: Run, handler: ast.ExceptHandler, value: Value, frame: Frame) -> Callable[[], bool]:
    return lambda: _run_handler(run, handler, value, frame)


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

    def no_exception() -> bool:
        return passes

    def handler_of(handler: ast.ExceptHandler) -> Any:
        def handle() -> bool:
            run.state.join_seen(mark)
            return _run_handler(run, handler, ANY, frame)

        return handle

    if not node.handlers:
        return passes
    jump = frame.jump
    result = run.state.branches([no_exception, *(handler_of(handler) for handler in node.handlers)])
    if not passes:
        if jump:
            frame.unsettled = True  # the jump of the body may happen, or a handler runs instead
        else:
            frame.early = True
    return result


def _with(run: Run, node: ast.With | ast.AsyncWith, frame: Frame) -> bool:
    managers: list[Value] = []
    for item in node.items:
        manager = run.evaluate(item.context_expr, frame)
        managers.append(manager)
        entered = _entered(run, manager, node, frame)
        if item.optional_vars is not None:
            assign(run, item.optional_vars, entered, frame)
    swallows = any(_may_swallow(atom) for manager in managers for atom in manager)
    if swallows:
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
    before = Unwinding(run, frame)
    risks = run.risks
    run.tries += 1
    run.try_forks = run.state.forks
    tries = run.tries
    run.state.depth += 1
    try:
        passes = run.execute(node.body, frame)
        certain = False
    except Raised:
        passes, certain = True, run.risks - risks <= 1
    before.restore(run, frame)
    run.tries = tries - 1
    if not certain and run.risks != risks:
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


def _match(run: Run, node: ast.Match, frame: Frame) -> bool:
    return _cases(run, node.cases, run.evaluate(node.subject, frame), frame)


def _cases(run: Run, cases: list[ast.match_case], subject: Value, frame: Frame) -> bool:
    """The first case that fits; from the first one of which that is not known on, any of them."""
    for index, case in enumerate(cases):
        outcome = patterns.matches(run, case.pattern, subject, frame)
        if outcome is not False and case.guard is not None:
            outcome = patterns.both(outcome, decide(run, case.guard, frame))
        if outcome:
            return run.execute(case.body, frame)
        if outcome is None:
            return run.state.branches(
                (_body_of(run, case.body, frame), _cases_of(run, cases[index + 1 :], subject, frame))
            )
    return True


def _body_of(run: Run, body: list[ast.stmt], frame: Frame) -> Callable[[], bool]:
    return lambda: run.execute(body, frame)


def _cases_of(run: Run, cases: list[ast.match_case], subject: Value, frame: Frame) -> Callable[[], bool]:
    return lambda: _cases(run, cases, subject, frame)


def _global(run: Run, node: ast.Global, frame: Frame) -> bool:
    frame.globals.update(node.names)
    return True


def _nonlocal(run: Run, node: ast.Nonlocal, frame: Frame) -> bool:
    frame.nonlocals.update(node.names)
    return True


def _assert(run: Run, node: ast.Assert, frame: Frame) -> bool:
    if decide(run, node.test, frame) is not True and node.msg is not None:
        message = node.msg
        run.state.maybe(lambda: bool(run.evaluate(message, frame)) or True)
    return True


def _delete(run: Run, node: ast.Delete, frame: Frame) -> bool:
    for target in node.targets:
        delete(run, target, frame)
    return True


STATEMENTS: dict[type, Executor] = {
    ast.Expr: _expression,
    ast.Assign: _assignment,
    ast.AnnAssign: _annotated,
    ast.AugAssign: _augmented,
    ast.If: _if,
    ast.For: loops.run_for,
    ast.AsyncFor: loops.run_for,
    ast.While: loops.run_while,
    ast.Return: _return,
    ast.Raise: _raise,
    ast.Break: _jump,
    ast.Continue: _jump,
    ast.Try: _try,
    ast.With: _with,
    ast.AsyncWith: _with,
    ast.Match: _match,
    ast.Global: _global,
    ast.Nonlocal: _nonlocal,
    ast.Assert: _assert,
    ast.Delete: _delete,
    ast.FunctionDef: define_function,
    ast.AsyncFunctionDef: define_function,
    ast.ClassDef: define_class,
    ast.Import: imports.run_import,
    ast.ImportFrom: imports.run_import_from,
}
if hasattr(ast, "TryStar"):  # Python 3.11
    STATEMENTS[ast.TryStar] = _try

__all__ = ["STATEMENTS", "assign_unknown"]
