"""Statements: sequencing, branches, exceptions, definitions. Each handler: can control pass it?"""

from __future__ import annotations

import ast
from functools import partial

from nodl.infer.interpreter import imports, loops, patterns, special
from nodl.infer.interpreter.assign import assign, delete
from nodl.infer.interpreter.conditions import decide, forked, narrowed
from nodl.infer.interpreter.define import define_class, define_function
from nodl.infer.interpreter.frames import Arguments, Frame
from nodl.infer.interpreter.handling import run_try
from nodl.infer.interpreter.managers import run_with
from nodl.infer.interpreter.operators import binary_operation
from nodl.infer.interpreter.raising import throw, throw_value
from nodl.infer.interpreter.run import Executor, Run
from nodl.infer.values import ANY, NONE, ClassValue, External, Sequence, Value, join, sole


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
            method = run.attribute((atom,), "extend" if atom.kind == "list" else "update", node, frame)
            run.call(method, Arguments([added]), node, frame)
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

    def side(body: list[ast.stmt], holds: bool) -> bool:
        narrowed(run, node.test, holds, frame)
        return run.execute(body, frame)

    return run.state.branches((lambda: side(node.body, True), lambda: side(node.orelse, False)))


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
            rest = partial(_cases, run, cases[index + 1 :], subject, frame)
            return run.state.branches((partial(run.execute, case.body, frame), rest))
    return True


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
    ast.Try: run_try,
    ast.With: run_with,
    ast.AsyncWith: run_with,
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
    STATEMENTS[ast.TryStar] = run_try
