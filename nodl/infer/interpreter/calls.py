"""Calls of analysed functions: binding arguments, running bodies, generators, recursion, memory."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable

from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.run import MAX_DEPTH, Run
from nodl.infer.methods import BoundMethod
from nodl.infer.values import (
    ANY,
    BOTTOM,
    NONE,
    OTHER,
    Dictionary,
    FunctionValue,
    GeneratorValue,
    Items,
    Key,
    LocalCells,
    Value,
    join,
    present,
    unknown,
    widen,
)

MISSING = unknown("an argument that the caller does not give")
MAX_ROUNDS = 8


Body = Callable[[Run, FunctionValue, LocalCells, Call], Value]


class Summary:
    """A function that calls itself: its joined parameters and result, run to a fixpoint.

    ``active``: its body is running; a call of it then adds to the parameters and gets the result so far.
    """

    def __init__(self) -> None:
        self.parameters: dict[object, Value] = {}
        self.result: Value = BOTTOM
        self.active = False
        self.widened = 0


def call_function(run: Run, function: FunctionValue, call: Call) -> Value:
    """What a call gives: nothing if no path comes back, unknown (and a gap) if calls nest too deep."""
    node = function.node
    if len(run.stack) >= MAX_DEPTH:
        run.gap(call.node, call.frame, "calls are nested too deep to be followed")
        return unknown("the result of a deeply nested call")
    cells = bind(run, function, call)
    run.called.setdefault(node)
    run.understood.add(call.node)
    if is_generator(function):
        kind = f"generator {id(function)}"
        made = run.allocate(call.node, kind, lambda: GeneratorValue(function, call.node))
        for name, value in cells.items():
            run.state.store(made, name, value)
        return (made,)
    if function.cached and node not in run.stack:
        return _cached(run, function, cells, call)
    if node not in run.stack and not (run.repeated and node in run.recursive):
        return _remembered(run, function, cells, call)
    if node not in run.stack:
        return _remembered(run, function, cells, call, _summarised)
    return _summarised(run, function, cells, call)


def run_generator(run: Run, made: GeneratorValue, call: Call) -> Value:
    """Whatever the body yields, now or when it was run before; nobody knows how far others let it run."""
    if made.function.node in run.stack:
        return unknown("what a generator yields that calls itself")
    cells = LocalCells()
    cells.update((name, present(value)) for name, value in made.cells.items() if name != _YIELDED)
    found = _run_body(run, made.function, cells, Call(call.args, made.node, call.frame))
    found = join(present(made.cells.get(_YIELDED, BOTTOM)), found)
    run.state.write(made.cells, _YIELDED, found)
    return found


_YIELDED = "[yielded]"


def is_generator(function: FunctionValue) -> bool:
    """Whether a function's own body has a ``yield``."""
    return function.module.source.has_yield and _is_generator(function.node)


@functools.lru_cache(maxsize=8192)
def _is_generator(node: ast.AST) -> bool:
    left = [node.body] if isinstance(node, ast.Lambda) else list(getattr(node, "body", []))
    while left:
        part = left.pop()
        if isinstance(part, ast.Yield | ast.YieldFrom):
            return True
        if not isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef):
            left.extend(ast.iter_child_nodes(part))
    return False


def _cached(run: Run, function: FunctionValue, cells: LocalCells, call: Call) -> Value:
    """``functools.cache``: the body may run, or the earlier result for these arguments is taken."""
    key = ("cached", *cells.values())
    held = function.attributes.get(key, BOTTOM)
    result = join(held, run.state.perhaps(lambda: _remembered(run, function, cells, call)))
    if held and result is not held:
        result = join(result, ANY)
    run.state.write(function.attributes, key, result)
    return result


def _summarised(run: Run, function: FunctionValue, cells: LocalCells, call: Call) -> Value:
    """One of the calls that a function which calls itself gets: all of them together are one."""
    node = function.node
    run.recursive.add(node)
    run.joined.add((node, call.node))
    summary = run.summaries.setdefault(node, Summary())
    _widen_parameters(run, summary, cells)
    if not summary.active:
        _run_recursive(run, function, summary, call)
    result: Value = summary.result
    return result  # nothing yet: this path ends in a call that has not come back so far


def _remembered(
    run: Run, function: FunctionValue, cells: LocalCells, call: Call, body: Body | None = None
) -> Value:
    """A call that leaves the state as it found it gives the same again while the state is the same."""
    key = (function, tuple(cells.values()), id(call.node))
    known = run.memo.get(key)
    version = (*run.state.version(), run.rounds)
    if known is not None and known[0] == version:
        run.state.reads.attributes |= known[2]
        return known[1]
    reads = run.state.reads
    around, reads.attributes = reads.attributes, set()
    before = run.steps if function.node not in run.stack else None  # a call inside itself counts already
    try:
        result = (body or _run_body)(run, function, cells, call)
        if (*run.state.version(), run.rounds) == version:
            run.memo[key] = (version, result, reads.attributes)
    finally:
        around |= reads.attributes
        reads.attributes = around
        if before is not None:
            run.cost[function] = run.cost.get(function, 0) + run.steps - before
    return result


def _run_body(run: Run, function: FunctionValue, cells: LocalCells, call: Call) -> Value:
    closure = function.closure
    assert closure is None or isinstance(closure, Frame)
    previous = run.enter(id(call.node))
    key = (run.context, id(function.node))
    earlier = run.captured_cells.get(key)
    if earlier is not None:  # inner functions of an earlier call live on: both calls share the variables
        for name, value in cells.items():
            run.state.write(earlier, name, join(earlier.get(name, BOTTOM), value))
        cells = earlier
    frame = Frame(function.module, cells, closure, run.state.depth)
    frame.again = earlier is not None
    frame.function = function
    frame.entry = call.node
    frame.forks = frame.loop_forks = run.state.forks
    run.entries.setdefault(function.node, {})[call.node] = None
    run.stack.append(function.node)
    mark = run.state.mark()
    node = function.node
    if isinstance(node, ast.Lambda):
        frame.returned = run.evaluate(node.body, frame)
    else:
        passes = run.execute(node.body, frame)
        if frame.early:
            run.state.join_seen(mark, None if cells.shared else cells)
        if passes:
            frame.returned = join(frame.returned, NONE)
    if cells.shared:
        run.captured_cells[key] = cells
    else:
        cells.dead = True
    run.stack.pop()
    run.context = previous
    if frame.yielded is not None:
        return frame.yielded or ANY
    return frame.returned  # nothing, if no path comes back


def _run_recursive(run: Run, function: FunctionValue, summary: Summary, call: Call) -> None:
    """Run the body with the joined parameters; the outermost recursion repeats until nothing changes."""
    outermost = not any(other.active for other in run.summaries.values())
    summary.active = True
    run.repeated += 1
    run.state.forks += 1
    for _ in range(MAX_ROUNDS if outermost else 1):
        run.unstable = False if outermost else run.unstable
        cells = LocalCells()
        cells.update(summary.parameters)
        result = join(summary.result, _run_body(run, function, cells, call))
        if result is not summary.result:
            run.unstable = True
            run.rounds += 1
        summary.result = result
        if not run.unstable:
            break
    else:
        if outermost:
            run.gap(call.node, call.frame, f"the recursion of {function.name} does not settle")
    run.repeated -= 1
    run.state.forks -= 1
    summary.active = False
    if outermost:
        run.summaries.clear()


def _widen_parameters(run: Run, summary: Summary, cells: LocalCells) -> None:
    for key, value in cells.items():
        old = summary.parameters.get(key, BOTTOM)
        new = widen(old, value, summary.widened > 2)
        if new is not old:
            summary.parameters[key] = new
            summary.widened += 1
            run.unstable = True
            run.rounds += 1


def call_bound(run: Run, method: BoundMethod, call: Call) -> Value:
    """Call the method's function with the receiver as its first argument."""
    shifted = Call(call.args.preceded((method.receiver,)), call.node, call.frame)
    return call_function(run, method.function, shifted)


# --- arguments ----------------------------------------------------------------------------------------------


def bind(run: Run, function: FunctionValue, call: Call) -> LocalCells:
    """The parameters' values; what the caller does not give takes its default."""
    given, parameters = call.args, function.node.args
    names = [parameter.arg for parameter in (*parameters.posonlyargs, *parameters.args)]
    cells = LocalCells()
    first_default = len(names) - len(function.defaults)
    used: set[str] = set()
    for index, name in enumerate(names):
        default = function.defaults[index - first_default] if index >= first_default else None
        if index < len(given.positional):
            cells[name] = given.positional[index]
        else:
            cells[name] = _named(name, given, default, join(given.more, given.more_keywords))
            used.add(name)
    for parameter, default in zip(parameters.kwonlyargs, function.kw_defaults, strict=True):
        cells[parameter.arg] = _named(parameter.arg, given, default, given.more_keywords)
        used.add(parameter.arg)
    if parameters.vararg:
        rest = tuple(given.positional[len(names) :])
        items = Items(None, join(given.more, Items(rest).any_element())) if given.more else Items(rest)
        cells[parameters.vararg.arg] = run.sequence(parameters.vararg, "tuple", items)
    if parameters.kwarg:
        cells[parameters.kwarg.arg] = _keywords(run, parameters.kwarg, given, used)
    return cells


def _named(name: str, given: Arguments, default: Value | None, more: Value) -> Value:
    if name in given.keywords:
        return given.keywords[name]
    if default is not None:
        return join(default, more)
    return more or MISSING


def _keywords(run: Run, node: ast.AST, given: Arguments, used: set[str]) -> Value:
    obj = run.allocate(node, "dict", Dictionary)
    for name, value in given.keywords.items():
        if name not in used:
            run.state.store(obj, Key(name), value)
    if given.more_keywords:
        run.state.store(obj, OTHER, given.more_keywords)
    return (obj,)
