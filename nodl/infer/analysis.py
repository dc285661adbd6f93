"""Drives runs: a module from its start, its entry functions, then every callback until nothing changes.

What the world outside may call (subscriptions, timers, threads, hooks of foreign classes) is called in any
order and any number of times: the state after each call is joined with the one before, to a fixpoint.
"""

from __future__ import annotations

import ast
import functools
import re
import sys
from bisect import bisect_left
from collections.abc import Callable, Iterable

from nodl.infer.interpreter.decisions import Decisions
from nodl.infer.interpreter.define import linearized, methods_in
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.imports import execute_module
from nodl.infer.interpreter.raising import Raised
from nodl.infer.interpreter.run import BudgetExceeded, Run
from nodl.infer.interpreter.tables import new_run
from nodl.infer.models.foreign import is_node_class
from nodl.infer.paths import refine
from nodl.infer.program import Program, SourceModule
from nodl.infer.values import (
    ANY,
    ClassValue,
    External,
    FunctionValue,
    Instance,
    ModuleValue,
    unknown,
)
from nodl.source_ref import SourceRef

MAX_NESTING = 6_000  # Python calls of the interpreter
MAX_ROUNDS = 12
WIDEN_TEXTS_FROM = 4

# A function or class whose text has none of these creates nothing by itself.
_CREATING = re.compile(
    r"create_|ActionClient|ActionServer|Subscriber\(|Broadcaster\(|TransformListener\(|Node\(|Node\.__init__"
    r"|ParameterClient\(|wait_for_message|Updater\("
)


def start(program: Program, main: SourceModule, functions: Iterable[str] = ()) -> Run:
    """Run ``main`` as a script, then ``functions`` of it (``main`` if the script itself starts nothing)."""
    named = tuple(functions)

    def follow(decisions: Decisions | None) -> Run:
        run = new_run(program, main)
        run.decisions = decisions
        _guarded(run, lambda: _start(run, main, named))
        return run

    run = follow(None)
    refine(run, follow)
    return run


def _start(run: Run, main: SourceModule, functions: tuple[str, ...]) -> None:
    _completed(run, lambda: execute_module(run, main, "__main__"))
    module = run.modules["__main__"]
    for name in functions or ("main",):
        for atom in module.cells.get(name, ()):
            if isinstance(atom, FunctionValue) and (functions or atom.node not in run.called):
                _call(run, module, atom, _defaults_only(atom))
    settle(run)


def start_function(program: Program, module: SourceModule, path: list[str]) -> Run:
    """Import ``module`` and call ``path`` in it (``main``, ``Class.method``), as an entry point does."""

    def follow(decisions: Decisions | None) -> Run:
        run = new_run(program, module)
        run.decisions = decisions
        _guarded(run, lambda: _start_function(run, module, path))
        return run

    run = follow(None)
    refine(run, follow)
    return run


def _start_function(run: Run, module: SourceModule, path: list[str]) -> None:
    def body() -> None:
        _completed(run, lambda: execute_module(run, module, module.name))
        imported = run.modules[module.name]
        value = imported.cells.get(path[0], ())
        frame = Frame(imported, {}, None, 0)
        for step in path[1:]:
            value = run.attribute(value, step, module.tree, frame)
        if not value:
            run.findings.gap(SourceRef(module.path), f"the entry point {'.'.join(path)} is not defined here")
        for atom in value:
            _call(run, imported, atom, Arguments())
        settle(run)

    body()


def analyse_rest(run: Run, called: set[ast.AST], instantiated: set[ast.AST]) -> None:
    """What no analysed program uses: node classes and creating functions, with unknown arguments."""
    _guarded(run, lambda: _analyse_rest(run, called, instantiated))


def _analyse_rest(run: Run, called: set[ast.AST], instantiated: set[ast.AST]) -> None:
    main = run.modules.get("__main__")
    if main is None or any(
        record.created and record.source.file == main.source.path for record in run.findings.nodes
    ):
        return  # a program, not a library: what it does not use stays unused
    missing = unknown("an argument that nothing analysed gives")
    found = False
    for cls in list(run.classes.values()):
        if cls.module is main and cls.node not in instantiated and _creates(run, cls.node, cls):
            found = True
            instantiated.add(cls.node)
            value = _call(run, main, cls, Arguments(more=missing))
            if not is_node(cls):
                _expect_methods(run, value)
    for value in list(main.cells.values()):
        for atom in value:
            if not isinstance(atom, FunctionValue) or atom.module is not main or atom.node in called:
                continue
            if not isinstance(atom.node, ast.Lambda) and _creates(run, atom.node, None):
                found = True
                called.add(atom.node)
                _call(run, main, atom, Arguments(more=missing))
    if found:
        settle(run)


def _expect_escaped(run: Run, expected: set[object]) -> None:
    """Code that was handed a class or an object may make objects of it and call its methods, in any order."""
    for atom in list(run.escaped):
        if atom in expected:
            continue
        expected.add(atom)
        if isinstance(atom, ClassValue):
            run.callbacks.setdefault(atom, None)
        else:
            _expect_methods(run, (atom,))


def _expect_methods(run: Run, value: Iterable[object]) -> None:
    for instance in value:
        if not isinstance(instance, Instance) or not isinstance(instance.cls, ClassValue):
            continue
        for base in linearized(instance.cls):
            if not isinstance(base, ClassValue):
                continue
            for name in list(base.cells):
                if isinstance(name, str) and name not in _NOT_CALLED and not name.startswith("["):
                    bound = methods_in(base.cells.get(name, ()), instance, instance.cls)
                    run.register_callback(bound, None)


_NOT_CALLED = frozenset({"__init__", "__new__", "__init_subclass__", "__class_getitem__", "__set_name__"})


def is_node(cls: ClassValue) -> bool:
    """Whether rclpy's node classes are among its bases."""
    return any(isinstance(base, External) and is_node_class(base.path) for base in linearized(cls))


def _creates(run: Run, node: ast.AST, cls: ClassValue | None) -> bool:
    if cls is not None and is_node(cls):
        return True
    first, last = node.lineno, node.end_lineno or node.lineno  # type: ignore[attr-defined]
    places = _creating_lines(run.main)
    index = bisect_left(places, first)
    return index < len(places) and places[index] <= last


@functools.lru_cache(maxsize=4)
def _creating_lines(module: SourceModule) -> list[int]:
    """The numbers of the lines with one of ``_CREATING``, in order."""
    return module.lines_with(_CREATING)


def settle(run: Run, at_end: bool = True) -> None:
    """Call all callbacks until neither state nor findings change; ``at_end``: the program itself has ended."""
    run.repeated += 1
    outermost = run.settle is not _no_settling
    run.settle = _no_settling
    tries, run.tries = (
        run.tries,
        0,
    )  # what a callback raises ends it, or the call that waits: one risk of a ``try``
    in_vain = run.in_vain
    expected: set[object] = set()
    for turn in range(MAX_ROUNDS):
        _expect_escaped(run, expected)
        before = run.state.version(), dict(run.callbacks)
        for callback, arity in before[1].items():
            version = run.state.version()
            if in_vain.get((callback, arity)) == version:
                continue
            if at_end:
                run.state.forget()
            run.state.repeatedly(_called_back(run, callback, arity), turn >= WIDEN_TEXTS_FROM)
            if run.state.version() == version:
                in_vain[callback, arity] = version
        if before == (run.state.version(), run.callbacks) and expected.issuperset(run.escaped):
            break
    else:
        run.findings.gap(SourceRef(run.main.path), "the callbacks do not settle; names may be missing")
    run.repeated -= 1
    run.tries = tries
    run.risks += 1
    run.settle = _settle_meanwhile if outermost else _no_settling


def _settle_meanwhile(run: Run) -> None:
    settle(run, at_end=False)


def _no_settling(run: Run) -> None:
    """Callbacks are running already."""


def _called_back(run: Run, callback: object, arity: int | None) -> Callable[[], bool]:
    made = unknown("an argument given by code that is not analysed")
    args = Arguments(more=made) if arity is None else Arguments([made] * arity)
    module = next(iter(run.modules.values()))

    def call() -> bool:
        made = _call(run, module, callback, args)
        if isinstance(callback, ClassValue):
            run.escape_value(made)
        return True

    return call


def _defaults_only(function: FunctionValue) -> Arguments:
    """An entry function gets no arguments; parameters without a default are unknown."""
    count = len(function.node.args.args) - len(function.defaults)
    return Arguments([ANY] * max(0, count))


def _call(run: Run, module: ModuleValue, atom: object, args: Arguments) -> tuple[object, ...]:
    frame = Frame(module, {}, None, run.state.depth)
    results: list[tuple[object, ...]] = []
    _completed(run, lambda: results.append(run.call_atom(atom, Call(args, module.source.tree, frame))))
    return results[0] if results else ()


def _completed(run: Run, body: Callable[[], object]) -> None:
    """Run ``body`` to its end, or to the exception that ends the program there; what it registered stays."""
    state = run.state
    before = len(run.stack), run.context, state.depth, run.unrolled
    try:
        body()
    except Raised:
        size, run.context, state.depth, run.unrolled = before
        del run.stack[size:]
        run.tries = 0
        run.try_forks = 0


def _guarded(run: Run, body: Callable[[], None]) -> None:
    run.settle = _settle_meanwhile
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(max(limit, MAX_NESTING))
    try:
        body()
    except BudgetExceeded as error:
        run.gave_up = True
        run.findings.gap(SourceRef(run.main.path), f"the analysis was given up: {error}")
    except RecursionError:
        run.findings.gap(SourceRef(run.main.path), "the analysis was given up: nested too deep")
    finally:
        sys.setrecursionlimit(limit)
    for instance, source in run.handed.items():
        if instance.node is not None and instance.node.created:
            instance.node.gaps.setdefault((source, "the node is handed to code that is not analysed"))
