"""Drives runs: a module from its start, its entry functions, then every callback until nothing changes."""

from __future__ import annotations

import ast
import functools
import gc
import itertools
import os
import re
import sys
import traceback
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from nodl.infer.callbacks import call_from_outside, settle, settle_meanwhile
from nodl.infer.interpreter.define import expect_methods, linearized
from nodl.infer.interpreter.frames import Arguments, Frame
from nodl.infer.interpreter.imports import execute_module
from nodl.infer.interpreter.run import BudgetExceeded, Run
from nodl.infer.interpreter.tables import new_run
from nodl.infer.models.foreign import is_node_class
from nodl.infer.paths import Decisions, refine
from nodl.infer.program import Program, SourceModule
from nodl.infer.values import ANY, ClassValue, External, FunctionValue, unknown
from nodl.source_ref import SourceRef

_ANALYSES_A_COLLECTION = 100
_analyses = itertools.count(1)
MAX_NESTING = 6_000  # Python calls of the interpreter

# A function or class whose text has none of these creates nothing by itself.
_CREATING = re.compile(
    r"create_|ActionClient|ActionServer|Subscriber\(|Broadcaster\(|TransformListener\(|Node\(|Node\.__init__"
    r"|ParameterClient\(|wait_for_message|Updater\("
)


@contextmanager
def without_collector() -> Iterator[None]:
    """Analyse without garbage collection: the many small objects of an analysis stay alive to its end.

    What is left then counts as old, or the next new object would have all of it searched; now and then it is
    searched.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled and next(_analyses) % _ANALYSES_A_COLLECTION:
            gc.freeze()
            gc.unfreeze()  # puts everything into the oldest generation
            gc.enable()
        elif enabled:
            gc.enable()
            gc.collect()


def start(program: Program, main: SourceModule, functions: Iterable[str] = ()) -> Run:
    """Run ``main`` as a script, then ``functions`` of it (``main`` if the script itself starts nothing)."""
    named = tuple(functions)
    return _followed(program, main, lambda run: _start(run, main, named))


def start_function(program: Program, module: SourceModule, path: list[str]) -> Run:
    """Import ``module`` and call ``path`` in it (``main``, ``Class.method``), as an entry point does."""
    return _followed(program, module, lambda run: _start_function(run, module, path))


def _followed(program: Program, main: SourceModule, body: Callable[[Run], None]) -> Run:
    def follow(decisions: Decisions | None) -> Run:
        run = new_run(program, main)
        run.decisions = decisions
        _guarded(run, lambda: body(run))
        return run

    run = follow(None)
    refine(run, follow)
    return run


def _start(run: Run, main: SourceModule, functions: tuple[str, ...]) -> None:
    module = execute_module(run, main, "__main__")
    for name in functions or ("main",):
        for atom in module.cells.get(name, ()):
            if isinstance(atom, FunctionValue) and (functions or atom.node not in run.called):
                call_from_outside(run, module, atom, _defaults_only(atom))
    settle(run)


def _start_function(run: Run, module: SourceModule, path: list[str]) -> None:
    imported = execute_module(run, module, module.name)
    value = imported.cells.get(path[0], ())
    frame = Frame(imported, {}, None, 0)
    for step in path[1:]:
        value = run.attribute(value, step, module.tree, frame)
    if not value:
        run.findings.gap(SourceRef(module.path), f"the entry point {'.'.join(path)} is not defined here")
    for atom in value:
        call_from_outside(run, imported, atom, Arguments())
    settle(run)


def analyse_rest(run: Run, called: set[ast.AST], instantiated: set[ast.AST]) -> None:
    """Analyse what no analysed program uses: node classes and creating functions, with unknown arguments."""
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
            value = call_from_outside(run, main, cls, Arguments(more=missing))
            if not is_node(cls):
                expect_methods(run, value)
    for value in list(main.cells.values()):
        for atom in value:
            if not isinstance(atom, FunctionValue) or atom.module is not main or atom.node in called:
                continue
            if not isinstance(atom.node, ast.Lambda) and _creates(run, atom.node, None):
                found = True
                called.add(atom.node)
                call_from_outside(run, main, atom, Arguments(more=missing))
    if found:
        settle(run)


def is_node(cls: ClassValue) -> bool:
    """Return True if rclpy's node classes are among its bases."""
    return any(isinstance(base, External) and is_node_class(base.path) for base in linearized(cls))


def _creates(run: Run, node: ast.stmt, cls: ClassValue | None) -> bool:
    if cls is not None and is_node(cls):
        return True
    first, last = node.lineno, node.end_lineno or node.lineno
    places = _creating_lines(run.main)
    index = bisect_left(places, first)
    return index < len(places) and places[index] <= last


@functools.lru_cache(maxsize=4)
def _creating_lines(module: SourceModule) -> list[int]:
    """Return the numbers of the lines with one of ``_CREATING``, in order."""
    return module.lines_with(_CREATING)


def _defaults_only(function: FunctionValue) -> Arguments:
    """Return the arguments of an entry function: none; parameters without a default are unknown."""
    count = len(function.node.args.args) - len(function.defaults)
    return Arguments([ANY] * max(0, count))


def _guarded(run: Run, body: Callable[[], None]) -> None:
    run.settle = settle_meanwhile
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(max(limit, MAX_NESTING))
    try:
        body()
    except BudgetExceeded as error:
        run.gave_up = True
        why = f"the analysis was given up: {error}; any interface beside those listed is possible"
        run.findings.gap(SourceRef(run.main.path), why)
    except RecursionError:
        run.gave_up = True
        run.findings.gap(SourceRef(run.main.path), "the analysis was given up: nested too deep")
    except Exception as error:
        run.gave_up = True
        run.findings.gap(SourceRef(run.main.path), failure(error))
    finally:
        sys.setrecursionlimit(limit)
    for instance, source in run.handed.items():
        if instance.node is not None and instance.node.created:
            instance.node.gaps.setdefault((source, "the node is handed to code that is not analysed"))


def failure(error: Exception) -> str:
    """Says that the analysis of a program failed, where in our code, and what to do."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f"{os.path.basename(frames[-1].filename)}:{frames[-1].lineno}" if frames else "an unknown place"
    return (
        f"the analysis failed ({type(error).__name__} at {place}); any interface is possible: "
        "give the node a manifest, and please report this line with the program"
    )
