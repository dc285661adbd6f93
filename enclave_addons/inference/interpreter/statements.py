"""Statements: sequencing, branches, exceptions, definitions. Each handler: can control pass it?"""

from __future__ import annotations

import ast
from functools import cache, partial
from typing import Any

from enclave_addons.inference.interpreter import imports, loops
from enclave_addons.inference.interpreter.conditions import (
    decide,
    only_if,
    sides_of,
    where_either,
)
from enclave_addons.inference.interpreter.define import define_class, define_function, program_classes
from enclave_addons.inference.interpreter.elements import assign, delete
from enclave_addons.inference.interpreter.expressions import binary_operation
from enclave_addons.inference.interpreter.run import Arguments, Executor, Run
from enclave_addons.inference.models import foreign
from enclave_addons.inference.text import Guard, Text
from enclave_addons.inference.values import (
    ANY,
    LAZY,
    NONE,
    ClassValue,
    External,
    Frame,
    Instance,
    Sequence,
    Unknown,
    Value,
    join,
    sole,
)


def _expression(run: Run, node: ast.Expr, frame: Frame) -> bool:
    if type(node.value) is not ast.Constant:
        value = run.evaluate(node.value, frame)
        if type(node.value) is ast.Call and (not value or _never_returns(run, node.value.func, frame)):
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
    made = run.findings.made
    value = run.evaluate(node.value, frame)
    if run.findings.made > made and any(isinstance(atom, Sequence) and atom.kind == LAZY for atom in value):
        run.gap(node, frame, "interfaces are made where this is iterated over later, which is not followed")
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
    if isinstance(node.op, (ast.Add, ast.BitOr)):
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
    if outcome is not None:
        return run.execute(node.body if outcome else node.orelse, frame)
    passing: list[tuple[Guard, ...]] = []

    def side(holds: bool) -> bool:
        passes = run.execute(node.body if holds else node.orelse, frame)
        if passes:
            passing.append(run.guards_at_end)
        return passes

    joined, sides = sides_of(run, node.test, frame, side)
    passes = run.state.branches(sides, joined)
    if passing:
        run.guards = where_either(passing[0], passing[-1])  # to the end of this block
    return passes


def _return(run: Run, node: ast.Return, frame: Frame) -> bool:
    value = NONE if node.value is None else run.evaluate(node.value, frame)
    for condition in run.guards[frame.guards :]:
        value = tuple(only_if(condition, atom) if isinstance(atom, (str, Text)) else atom for atom in value)
    frame.returned = join(frame.returned, value)
    _leave(run, frame)
    return False


def _leave(run: Run, frame: Frame) -> None:
    frame.jump = ""
    if run.state.forks > frame.forks:
        frame.early = True


def _raise(run: Run, node: ast.Raise, frame: Frame) -> bool:
    """End the path; a handler of any ``try`` around it may run."""
    value = NONE if node.exc is None else run.evaluate(node.exc, frame)
    if node.cause is not None:
        run.evaluate(node.cause, frame)
    if len(value) == 1 and isinstance(value[0], ClassValue):
        run.call(value, Arguments(), node, frame)
    frame.jump = ""
    run.raised = True
    return False


def _jump(run: Run, node: ast.Break | ast.Continue, frame: Frame) -> bool:
    jump = "break" if isinstance(node, ast.Break) else "continue"
    if run.state.forks == frame.loop_forks:
        frame.jump = jump
    elif frame.unsettled != "continue":
        frame.unsettled = jump
    return False


def _match(run: Run, node: ast.Match, frame: Frame) -> bool:
    """Run the cases as the tests that they are; if they take the subject apart, any of them, or none."""
    tests = _as_tests(node)
    if tests is not None:
        return run.execute(tests, frame)
    subject = run.evaluate(node.subject, frame)
    if not any(isinstance(atom, (Unknown, External)) for atom in subject):
        run.gap(node, frame, "which case of this match statement is taken is not followed")
    last = node.cases[-1]
    everything = isinstance(last.pattern, ast.MatchAs) and last.pattern.pattern is None and last.guard is None
    sides = [partial(_case, run, case, subject, frame) for case in node.cases]
    return run.state.branches(sides if everything else [*sides, lambda: True])


@cache
def _as_tests(node: ast.Match) -> list[ast.stmt] | None:
    """Return ``if``, ``elif`` and ``else`` that do the same; None if a pattern is more than constants and names.

    The subject is read by each test, or once before them if a guard may change it.
    """
    subject, before = node.subject, list[ast.stmt]()
    guards = [case.guard for case in node.cases if case.guard is not None]
    calls = any(isinstance(part, ast.Call | ast.NamedExpr) for guard in guards for part in ast.walk(guard))
    if calls or not isinstance(subject, ast.Name | ast.Attribute):
        before = [ast.Assign([ast.Name("the subject", ast.Store())], subject)]
        subject = ast.Name("the subject", ast.Load())
    rest: list[ast.stmt] = []
    for case in reversed(node.cases):
        test = _as_test(subject, case.pattern)
        if test is None:
            return None
        if case.guard is not None:
            test = ast.BoolOp(ast.And(), [test, case.guard])
        rest = [ast.copy_location(ast.If(test, case.body, rest), case.pattern)]
    return [ast.fix_missing_locations(ast.copy_location(each, node)) for each in (*before, *rest)]


def _as_test(subject: ast.expr, pattern: ast.pattern) -> ast.expr | None:
    match pattern:
        case ast.MatchValue(value):
            return ast.Compare(subject, [ast.Eq()], [value])
        case ast.MatchSingleton(constant):
            return ast.Compare(subject, [ast.Is()], [ast.Constant(constant)])
        case ast.MatchAs(None, None):
            return ast.Constant(True)
        case ast.MatchOr(patterns):
            tests = [_as_test(subject, each) for each in patterns]
            known = [each for each in tests if each is not None]
            return ast.BoolOp(ast.Or(), known) if len(known) == len(tests) else None
    return None


def _case(run: Run, case: ast.match_case, subject: Value, frame: Frame) -> bool:
    for part in ast.walk(case.pattern):
        name = getattr(part, "name", None) or getattr(part, "rest", None)
        if isinstance(name, str):
            run.assign_name(name, join(subject, ANY), frame)
    if case.guard is not None:
        run.evaluate(case.guard, frame)
    return run.execute(case.body, frame)


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


# --- exceptions ---------------------------------------------------------------------------------------------


def run_try(run: Run, node: Any, frame: Frame) -> bool:
    """Run each handler after any part of the body; it sees every value written on the way, as ``finally`` does."""
    mark, returned = run.state.mark(), frame.returned
    run.state.depth += 1
    passes = run.execute(node.body, frame)
    run.state.depth -= 1
    if node.handlers:
        passes = _perhaps_handled(run, node, passes, mark, frame)
    elif passes:
        passes = run.execute(node.orelse, frame)
    if not node.finalbody:
        return passes
    jump, within = frame.jump, frame.returned
    frame.returned = returned  # where ``finally`` returns, what the statement returned is replaced by that
    run.state.join_seen(mark, mixed=True)
    done = run.execute(node.finalbody, frame)
    if done:
        frame.returned = join(within, frame.returned)
        frame.jump = jump
    return done and passes


def _perhaps_handled(run: Run, node: Any, passes: bool, mark: int, frame: Frame) -> bool:
    """Run a handler, or what follows the body (``passes``: if control reaches its end)."""

    def handle(handler: ast.ExceptHandler) -> bool:
        run.state.join_seen(mark, mixed=True)
        if handler.type is not None:
            run.evaluate(handler.type, frame)
        if handler.name:
            run.assign_name(handler.name, ANY, frame)
        return run.execute(handler.body, frame)

    if not passes and frame.jump:
        frame.unsettled = frame.jump  # the jump of the body may happen, or a handler runs instead
    elif not passes:
        frame.early = True
    handled = [partial(handle, handler) for handler in node.handlers]
    return run.state.branches([*handled, lambda: passes and run.execute(node.orelse, frame)])


def run_with(run: Run, node: ast.With | ast.AsyncWith, frame: Frame) -> bool:
    """Run ``with``: the body, whose exceptions the managers may swallow. Return False if control cannot pass."""
    managers: list[object] = []
    for item in node.items:
        manager = run.evaluate(item.context_expr, frame)
        managers.extend(manager)
        entered = _entered(run, manager, node, frame)
        if item.optional_vars is not None:
            assign(run, item.optional_vars, entered, frame)
    mark = run.state.mark()
    run.state.depth += 1
    passes = run.execute(node.body, frame)
    run.state.depth -= 1
    if not all(_lets_through(run, atom) for atom in managers):
        for atom in managers:
            foreign.wait(run, "__exit__", atom)
        run.state.join_seen(mark, mixed=True)  # after any part of the body
        passes = True
    for atom in reversed(managers):
        if isinstance(atom, Instance) and isinstance(atom.cls, ClassValue):
            leave = run.attribute((atom,), "__exit__", node, frame)
            run.call(leave, Arguments([NONE, NONE, NONE]), node, frame)
            run.register_callback(leave, 3)
    return passes


def _lets_through(run: Run, manager: object) -> bool:
    """Return whether exceptions pass this context manager, one of a library."""
    of = manager.cls if isinstance(manager, Instance) else manager
    return isinstance(of, External) and run.tables.lets_through(of.path)


def _entered(run: Run, manager: Value, node: ast.AST, frame: Frame) -> Value:
    result: Value = ()
    for atom in manager:
        if isinstance(atom, Instance) and _enters(atom):
            enter = run.attribute((atom,), "__enter__", node, frame)
            result = join(result, run.call(enter, Arguments(), node, frame))
        else:
            result = join(result, ANY)
    return result or ANY


def _enters(atom: Instance) -> bool:
    """Return whether ``with`` calls the object's ``__enter__``, or what only a library knows."""
    classes = program_classes(atom.cls) if isinstance(atom.cls, ClassValue) else []
    return isinstance(atom.cls, External) or any("__enter__" in each.cells for each in classes)


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
    loops.Element: loops.run_element,
    ast.Import: imports.run_import,
    ast.ImportFrom: imports.run_import_from,
}
if hasattr(ast, "TryStar"):  # Python 3.11
    STATEMENTS[ast.TryStar] = run_try
