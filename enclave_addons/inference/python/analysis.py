"""Drives runs: a module from its start, its entry functions, then every callback until nothing changes."""

from __future__ import annotations

import ast
import gc
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from enclave_addons.inference.kernel.machine import Jumps, StepLimitExceeded
from enclave_addons.inference.kernel.results import interfaces_of
from enclave_addons.inference.kernel.values import Obj, Value, sole, unknown
from enclave_addons.inference.packages import find_package, manifest_places
from enclave_addons.inference.python import expressions, libraries, statements
from enclave_addons.inference.python.check import unsettled_places
from enclave_addons.inference.python.objects import (
    Arguments,
    Bound,
    Call,
    Class,
    Frame,
    Function,
    Module,
    Property,
)
from enclave_addons.inference.python.program import Program, ProgramTarget, SourceModule
from enclave_addons.inference.python.rclpy_models import is_node_class
from enclave_addons.inference.python.run import Run
from enclave_addons.inference.start import NO_LAUNCH, InferredProgram, LaunchKey, ProgramLaunch
from enclave_common.source_location import SourceLocation
from nodl.node_interface import ClientLibrary, Gap, NodeInterface

MAX_NESTING = 9_000  # Python calls of the interpreter
HANDLERS = (expressions, libraries, statements)  # fill the tables of ``run``
_MISSING = unknown("an argument that nothing analysed gives")


@contextmanager
def without_collector() -> Iterator[None]:
    """Analyse without garbage collection: the many small objects of a run stay alive to its end."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def start(
    program: Program, main: SourceModule, functions: Iterable[str] = (), launch: ProgramLaunch = NO_LAUNCH
) -> Run:
    """Run ``main`` as a script, then ``functions`` of it (``main`` if the script itself starts nothing)."""
    run, named = _new_run(program, main, launch), tuple(functions)

    def body() -> None:
        module = run.execute_module(main, "__main__")
        for name in named or ("main",):
            function = sole(module.cells.get(name))
            if isinstance(function, Function) and (named or function.node not in run.entered):
                run.from_outside(function, Arguments(), _call(module))
        run.settle()

    _guarded(run, body)
    return run


def start_function(
    program: Program, main: SourceModule, path: Iterable[str], launch: ProgramLaunch = NO_LAUNCH
) -> Run:
    """Import ``main`` and call ``path`` in it (``main``, ``Class.method``), as an entry point does."""
    run = _new_run(program, main, launch)

    def body() -> None:
        module = run.execute_module(main, main.name)
        value: Value = (module,)
        for step in path:
            found = value == (module,) and step not in module.cells
            if found:
                run.gap(SourceLocation(main.path), f"the entry point {step} is not defined here")
                return
            value = run.attribute(value, step, main.tree, _call(module).frame)
        for atom in value:
            run.from_outside(atom, Arguments(), _call(module))
        run.settle()

    _guarded(run, body)
    return run


def _new_run(program: Program, main: SourceModule, launch: ProgramLaunch) -> Run:
    run = Run(program, main, launch)
    for manifest in manifest_places(main.path):
        program.ask("file", str(manifest))
    package = find_package(main.path)
    run.dependencies = package.dependencies if package else frozenset()
    return run


def _call(module: Module) -> Call:
    return Call(Arguments(), module.source.tree, Frame(module, module.cells, None, Jumps(0)))


def _guarded(run: Run, body: Callable[[], None]) -> None:
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(max(limit, MAX_NESTING))
    before, run.given_up = run.given_up, True
    try:
        body()
        run.given_up = before
    except StepLimitExceeded:
        why = f"this program was given up after {run.steps} steps; any interface beside those listed is possible"
        run.gap(SourceLocation(run.main.path), why)
    except RecursionError:
        run.gap(SourceLocation(run.main.path), "this program was given up: it is nested too deep")
    except Exception as error:
        run.gap(SourceLocation(run.main.path), failure(error))
    finally:
        sys.setrecursionlimit(limit)


def failure(error: Exception) -> str:
    """Say that the analysis of a program failed, where in our code, and what to do."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f"{os.path.basename(frames[-1].filename)}:{frames[-1].lineno}" if frames else "an unknown place"
    return (
        f"the analysis failed ({type(error).__name__} at {place}); any interface is possible: "
        "give the node a manifest, and please report this line with the program"
    )


# --- libraries of nodes -------------------------------------------------------------------------------------


def analyse_rest(run: Run, entered: set[ast.AST]) -> None:
    """Analyse what no analysed program uses: node classes and functions that make interfaces."""
    if not run.given_up:
        _guarded(run, lambda: _analyse_rest(run, entered))


def _analyse_rest(run: Run, entered: set[ast.AST]) -> None:
    main = run.modules.get("__main__")
    if main is None or any(
        n.created and n.source.file == main.source.path for n in run.findings.nodes.values()
    ):
        return  # a program, not a library: what it does not use stays unused
    call, args = _call(main), Arguments(more=_MISSING)
    for cls in list(run.classes):
        if (
            cls.module is main
            and cls.node not in entered
            and (is_node(cls) or run.creates(main.source, cls.node))
        ):
            entered.add(cls.node)
            made = run.from_outside(cls, args, call)
            for obj in made if not is_node(cls) else ():
                _expect_methods(run, cls, obj, call)
    for value in list(main.cells.values()):
        for atom in value:
            if not isinstance(atom, Function) or atom.module is not main or atom.node in entered:
                continue
            if not isinstance(atom.node, ast.Lambda) and run.creates(main.source, atom.node):
                entered.add(atom.node)
                run.from_outside(atom, args, call)
    run.settle()


def _expect_methods(run: Run, cls: Class, obj: object, call: Call) -> None:
    for base in cls.classes():
        for name, value in list(base.cells.items()):
            for each in value:
                getters = each.getter if isinstance(each, Property) else (each,)
                for method in getters if isinstance(obj, Obj) and name != "__init__" else ():
                    if isinstance(method, Function):
                        run.call_later((Bound(method, obj),), Arguments(more=_MISSING), call)


def is_node(cls: Class) -> bool:
    """Return whether rclpy's node classes are among its bases."""
    return any(map(is_node_class, cls.foreign()))


# --- programs -----------------------------------------------------------------------------------------------


def infer_program(
    program: Program,
    target: ProgramTarget,
    path: str,
    origin: LaunchKey,
    launch: ProgramLaunch = NO_LAUNCH,
    lost: tuple[Gap, ...] | None = None,
) -> InferredProgram:
    """Return the nodes that the program behind ``path`` creates.

    Args:
        launch: What a launch gives: tests of parameters are then decided.
        lost: What the check found where both sides of such tests were followed.
    """
    try:
        with without_collector():
            run = _run(program, target, path, launch)
            found = tuple(unsettled_places(run, run.entered)) if lost is None else lost
            run.findings.gaps.include(found)
            interfaces = interfaces_of(run.findings, origin, ClientLibrary.RCLPY)
    except Exception as error:  # a mistake of ours in one program must not end the plan of all
        return InferredProgram((), f"{path}: {failure(error)}")
    gaps = run.findings.gaps.listed()
    if interfaces:
        inputs = tuple(run.findings.options.defaults)
        answer = InferredProgram(_with_gaps(interfaces, gaps), "", run.asks_launch, found, inputs)
        return answer._replace(asks_launch=run.asks_launch or answer.open_places > 0)
    reasons = "; ".join(f"{gap.source}: {gap.why}" for gap in gaps)
    return InferredProgram((), f"no node was found in {path}" + (f" ({reasons})" if reasons else ""))


def _run(program: Program, target: ProgramTarget, path: str, launch: ProgramLaunch) -> Run:
    source = program.load(target.file, target.module)
    if target.function:
        return start_function(program, source, target.function, launch)
    run = start(program, source, launch=launch)
    if target.missing:
        run.gap(SourceLocation(path), target.missing)
    return run


def _with_gaps(interfaces: list[NodeInterface], gaps: list[Gap]) -> tuple[NodeInterface, ...]:
    """Give gaps of the whole program to its first node, so that nobody overlooks them."""
    first = interfaces[0]
    return (first._replace(gaps=(*first.gaps, *gaps)), *interfaces[1:])
