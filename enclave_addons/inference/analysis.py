"""Drives runs: a module from its start, its entry functions, then every callback until nothing changes.

Callbacks are what the world outside may call: subscriptions, timers, threads and hooks of foreign classes run in any
order and any number of times. The state after each call is joined with the one before, to a fixpoint. One is not called
again while nothing has changed since.
"""

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

from enclave_addons.inference.interpreter.attributes import ATTRIBUTES
from enclave_addons.inference.interpreter.calls import call_bound, call_function, instantiate
from enclave_addons.inference.interpreter.define import expect_methods, linearized
from enclave_addons.inference.interpreter.expressions import EXPRESSIONS
from enclave_addons.inference.interpreter.imports import execute_module
from enclave_addons.inference.interpreter.run import (
    Arguments,
    BudgetExceeded,
    Call,
    Called,
    Caller,
    Run,
    Tables,
)
from enclave_addons.inference.interpreter.statements import STATEMENTS
from enclave_addons.inference.models import foreign
from enclave_addons.inference.models.foreign import is_node_class
from enclave_addons.inference.net import unsettled_places, words_read
from enclave_addons.inference.program import Program, ProgramTarget, SourceModule
from enclave_addons.inference.results import interfaces_of
from enclave_addons.inference.start import NO_LAUNCH, InferredProgram, LaunchKey, ProgramLaunch
from enclave_addons.inference.values import (
    ANY,
    COMMAND_LINE,
    EVERY_FIELD,
    OF_A_NODE,
    TOO_MANY,
    BoundMethod,
    ClassMethod,
    ClassValue,
    External,
    ForeignMethod,
    Frame,
    FunctionValue,
    HeapObject,
    Instance,
    ModuleValue,
    NativeMethod,
    Partial,
    Unknown,
    Value,
    unknown,
)
from nodl.node_interface import Gap, NodeInterface
from nodl.source_ref import SourceRef

_OF_EXECUTORS = frozenset({"add_node", "remove_node", "wake"})  # of rclpy, whichever object it is
_CHANGES = frozenset({"append", "extend", "insert", "remove", "pop", "clear"})


def _call_partial(run: Run, partial: Partial, call: Call) -> Value:
    args = call.args.preceded(*partial.positional)
    args.keywords = {**dict(partial.keywords), **args.keywords}
    return run.call(partial.function, args, call.node, call.frame)


def _call_instance(run: Run, instance: Instance, call: Call) -> Value:
    if isinstance(instance.cls, External):
        run.escape(call.args)
        return ANY
    method = run.attribute((instance,), "__call__", call.node, call.frame)
    return run.call(method, call.args, call.node, call.frame)


def _call_unknown(run: Run, atom: Unknown, call: Call) -> Value:
    if atom.why == TOO_MANY:
        run.gap(call.node, call.frame, "one of too many functions is called here")
    function = call.node.func if isinstance(call.node, ast.Call) else None
    if atom.why == COMMAND_LINE and isinstance(function, ast.Attribute) and function.attr in _CHANGES:
        run.gap(call.node, call.frame, "the command line is changed in code")
    if isinstance(function, ast.Attribute) and function.attr in _OF_EXECUTORS:
        return (atom,)
    if isinstance(function, ast.Attribute):
        foreign.wait(run, function.attr, atom)
    if atom.why == OF_A_NODE:
        run.gap(call.node, call.frame, "a method of the node whose name is made at run time is called here")
    run.escape(call.args)
    return (atom,)


CALLABLES: dict[type, Caller] = {
    FunctionValue: call_function,
    BoundMethod: call_bound,
    Partial: _call_partial,
    Instance: _call_instance,
    ClassMethod: lambda run, method, call: run.call(method.function, call.args, call.node, call.frame),
    ClassValue: instantiate,
    Unknown: _call_unknown,
    External: foreign.call_external,
    ForeignMethod: foreign.call_foreign_method,
    NativeMethod: foreign.call_native,
}

TABLES = Tables(
    EXPRESSIONS, STATEMENTS, CALLABLES, ATTRIBUTES, foreign.keeps_off, foreign.lets_through, foreign.creates,
)  # fmt: skip


def new_run(program: Program, main: SourceModule) -> Run:
    """Return a run of ``main`` with the handlers of all concerns; nothing is executed yet."""
    return Run(program, TABLES, main)


MAX_RUNS = 5
MAX_ROUNDS = 12
WIDEN_TEXTS_FROM = 4


def settle(run: Run, at_end: bool = True) -> None:
    """Call all callbacks until neither state nor findings change; ``at_end``: the program itself has ended."""
    run.repeated += 1
    guards, run.guards = run.guards, ()
    base, run.state.base = run.state.base, run.state.forks
    outermost = run.settle is not _no_settling
    run.settle = _no_settling
    expected: set[object] = set()
    if at_end:
        _expect_escaped(run, expected)
        _call_at_any_time(run)
    for turn in range(MAX_ROUNDS):
        _expect_escaped(run, expected)
        before = run.state.version(), dict(run.callbacks)
        for callback, arity in before[1].items():
            if _may_find_more(run, callback, arity):
                if at_end:
                    run.state.forget()
                _call_back(run, callback, arity, turn >= WIDEN_TEXTS_FROM)
            elif turn == 0:  # the program may have set since then what this callback sets
                run.state.written_again(run.called_back[callback, arity].written, False)
        if before == (run.state.version(), run.callbacks) and expected.issuperset(run.escaped):
            break
    else:
        run.findings.gap(SourceRef(run.main.path), "the callbacks do not settle; names may be missing")
    run.repeated -= 1
    run.state.base = base
    run.guards = guards
    run.settle = settle_meanwhile if outermost else _no_settling


def settle_meanwhile(run: Run) -> None:
    """Call all callbacks where the program waits for them."""
    settle(run, at_end=False)


def _no_settling(run: Run) -> None:
    """Do nothing: callbacks are running already."""


def _may_find_more(run: Run, callback: object, arity: int | None) -> bool:
    """Return True unless nothing has changed that the functions in the latest call of this callback read."""
    previous = run.called_back.get((callback, arity))
    if previous is None:
        return True
    changed = run.state.changes(previous.stamp)
    if changed and EVERY_FIELD in previous.containers:
        return True
    if not changed.isdisjoint(previous.containers) or not changed.isdisjoint(_unnamed_cells(run)):
        return True
    words = (words_read(each.module.source)[each.node] for each in previous.functions)
    return bool(changed) and any(not (changed | _READ_UNNAMED).isdisjoint(each) for each in words)


def _unnamed_cells(run: Run) -> set[str | int]:
    """Return what models read where the text does not name it."""
    return {id(run.environment), *(id(node.cells) for node in run.findings.nodes)}


_READ_UNNAMED = frozenset({"getattr", "setattr", "vars", "globals", "locals", "__dict__"})


def _call_back(run: Run, callback: object, arity: int | None, widen_texts: bool) -> None:
    """Call it once. What it made stands for what each of its calls makes."""
    run.born = []
    run.state.fresh.clear()
    HeapObject.looked_into = set()
    run.running = set()
    stamp, looked_into = run.state.now(), HeapObject.looked_into
    written = run.state.repeatedly(_called_from_outside(run, callback, arity), widen_texts)
    run.called_back[callback, arity] = Called(stamp, run.running, looked_into, written)
    for made in run.born:
        made.summary = True


def _call_at_any_time(run: Run) -> None:
    """Call what other code may have called while the program ran: variables hold any of their values since then."""
    for since, callbacks in itertools.groupby(list(run.at_any_time), key=run.at_any_time.__getitem__):
        if run.state.changed_since(since):
            calls = [_called_from_outside(run, each, run.callbacks[each]) for each in callbacks]
            mix = functools.partial(run.state.join_seen, since, mixed=True)
            run.state.aside(mix, functools.partial(run.state.branches, (*calls, lambda: True)))


def _expect_escaped(run: Run, expected: set[object]) -> None:
    """Expect that code which was handed a class or an object makes objects of it and calls its methods, in
    any order.
    """
    for atom, since in list(run.escaped.items()):
        if atom in expected:
            continue
        expected.add(atom)
        if isinstance(atom, ClassValue):
            run.callbacks.setdefault(atom, None)
        else:
            expect_methods(run, (atom,), since)


def _called_from_outside(run: Run, callback: object, arity: int | None) -> Callable[[], bool]:
    made = unknown("an argument given by code that is not analysed")
    args = Arguments(more=made) if arity is None else Arguments([made] * arity)
    module = next(iter(run.modules.values()))

    def call() -> bool:
        mark = run.state.mark()
        made = call_from_outside(run, module, callback, args)
        if callback in run.at_any_time:
            run.changes_at_any_time(run.state.seen(mark))
        if isinstance(callback, ClassValue):
            run.escape_value(made)
        return True

    return call


def call_from_outside(run: Run, module: ModuleValue, atom: object, args: Arguments) -> tuple[object, ...]:
    """Call ``atom`` as nobody in the program does; returns what it gives."""
    frame = Frame(module, {}, None, run.state.depth)
    return run.swallowed(lambda: run.call_atom(atom, Call(args, module.source.tree, frame)))


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


def start(
    program: Program,
    main: SourceModule,
    functions: Iterable[str] = (),
    launch: ProgramLaunch = NO_LAUNCH,
) -> Run:
    """Run ``main`` as a script, then ``functions`` of it (``main`` if the script itself starts nothing)."""
    named = tuple(functions)
    return _followed(program, main, launch, lambda run: _start(run, main, named))


def start_function(
    program: Program,
    module: SourceModule,
    path: list[str],
    launch: ProgramLaunch = NO_LAUNCH,
) -> Run:
    """Import ``module`` and call ``path`` in it (``main``, ``Class.method``), as an entry point does."""
    return _followed(program, module, launch, lambda run: _start_function(run, module, path))


def _followed(
    program: Program, main: SourceModule, launch: ProgramLaunch, body: Callable[[Run], None]
) -> Run:
    """Run until it is known from the start on what code that runs at any time changes."""
    changed = set[str | int]()
    for _ in range(MAX_RUNS):
        run = new_run(program, main)
        run.launch = launch
        run.state.changed_meanwhile = changed
        _guarded(run, functools.partial(body, run))
        if run.gave_up or run.meanwhile <= changed:
            return run
        changed |= run.meanwhile
    run.findings.gap(SourceRef(main.path), "what code changes that runs at any time is not known")
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
        record = run.findings.node_of.get(instance)
        if record is not None and record.created:
            record.gaps.setdefault((source, "the node is handed to code that is not analysed"))


def failure(error: Exception) -> str:
    """Says that the analysis of a program failed, where in our code, and what to do."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f"{os.path.basename(frames[-1].filename)}:{frames[-1].lineno}" if frames else "an unknown place"
    return (
        f"the analysis failed ({type(error).__name__} at {place}); any interface is possible: "
        "give the node a manifest, and please report this line with the program"
    )


def infer_program(
    program: Program,
    target: ProgramTarget,
    path: str,
    origin: LaunchKey,
    launch: ProgramLaunch = NO_LAUNCH,
    lost: tuple[Gap, ...] | None = None,
) -> InferredProgram:
    """Return the nodes that the program behind ``path`` creates.

    Under a ``launch`` tests of parameters are decided: then the net has nothing to
    look at on the other side, and ``lost`` is what it found where both sides were followed.
    """
    try:
        with without_collector():
            run = _run(program, target, path, launch)
            interfaces = interfaces_of(run.findings, origin)
            found = (*unsettled_places(run),) if lost is None else lost
            for gap in found:
                run.findings.gap(gap.source, gap.why)
    except Exception as error:  # a mistake of ours in one program must not end the plan of all
        return InferredProgram((), f"{path}: {failure(error)}")
    if interfaces:
        answer = InferredProgram(
            _with_gaps(interfaces, run), "", run.asks_launch, found, tuple(run.options.names)
        )
        return answer._replace(asks_launch=run.asks_launch or answer.open_places > 0)
    reasons = "; ".join(f"{source}: {why}" for source, why in run.findings.gaps)
    return InferredProgram((), f"no node was found in {path}" + (f" ({reasons})" if reasons else ""))


def _run(program: Program, target: ProgramTarget, path: str, launch: ProgramLaunch) -> Run:
    source = program.load(target.file, target.module)
    if target.function:
        return start_function(program, source, list(target.function), launch)
    run = start(program, source, launch=launch)
    if target.missing:
        run.findings.gap(SourceRef(path), target.missing)
    return run


def _with_gaps(interfaces: list[NodeInterface], run: Run) -> tuple[NodeInterface, ...]:
    """Give gaps that belong to the whole program to its first node, so that nobody overlooks them."""
    gaps = tuple(Gap(source, why) for source, why in run.findings.gaps)
    first = interfaces[0]
    return (first._replace(gaps=(*first.gaps, *gaps)), *interfaces[1:])
