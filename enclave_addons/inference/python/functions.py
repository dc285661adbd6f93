"""Functions: how they are made, how arguments are bound, how their bodies run."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator

from enclave_addons.inference.kernel.machine import NEXT, RETURN, Jumps
from enclave_addons.inference.kernel.values import (
    ABSENT,
    ANY,
    BOTTOM,
    NONE,
    NUMBERS,
    Items,
    LocalCells,
    Obj,
    Unknown,
    Value,
    join,
    join_all,
    unknown,
    widen,
)
from enclave_addons.inference.python.containers import fill
from enclave_addons.inference.python.objects import (
    FUNCTION_NODES,
    Arguments,
    Bound,
    Call,
    Class,
    Frame,
    Function,
    FunctionNode,
    Partial,
    Wrapped,
)
from enclave_addons.inference.python.run import CALLS, OF_PROCESS, Run

MAX_OBJECTS = 3
MAX_COST = 20_000  # steps of a function that makes no interface, until it is run for all arguments at once


def new_function(run: Run, node: FunctionNode, frame: Frame) -> Function:
    """Return the function that ``def`` or ``lambda`` makes here."""
    arguments = node.args
    positional = [*arguments.posonlyargs, *arguments.args]
    defaults = {
        each.arg: run.evaluate(default, frame)
        for each, default in zip(reversed(positional), reversed(arguments.defaults), strict=False)
    }
    for each, keyword_default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True):
        if keyword_default is not None:
            defaults[each.arg] = run.evaluate(keyword_default, frame)
    closure = None if frame.cells is frame.module.cells else frame
    owner = frame.cls
    made: Function = run.remembered(
        node,
        "function",
        lambda: Function(node, frame.module, closure, owner, dict(defaults), _decorators(node)),
    )
    for name, value in defaults.items():
        made.defaults[name] = join(made.defaults[name], value)
    return made


def _decorators(node: FunctionNode) -> frozenset[str]:
    return frozenset() if isinstance(node, ast.Lambda) else frozenset(map(_last, node.decorator_list))


def _last(node: ast.expr) -> str:
    if isinstance(node, ast.Call):
        node = node.func
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


@functools.lru_cache(maxsize=4096)
def _makes_closures(node: FunctionNode) -> bool:
    inner = (*FUNCTION_NODES, ast.ClassDef)
    body = [node.body] if isinstance(node, ast.Lambda) else node.body
    return any(isinstance(each, inner) for statement in body for each in ast.walk(statement))


@functools.lru_cache(maxsize=4096)
def _is_generator(node: FunctionNode) -> bool:
    return not isinstance(node, ast.Lambda) and any(
        isinstance(each, (ast.Yield, ast.YieldFrom)) for each in _own(node.body)
    )


def _own(body: list[ast.stmt]) -> Iterator[ast.AST]:
    """Return the syntax of a body without that of inner functions."""
    left: list[ast.AST] = list(body)
    while left:
        node = left.pop()
        yield node
        if not isinstance(node, (*FUNCTION_NODES, ast.ClassDef)):
            left.extend(ast.iter_child_nodes(node))


def bind(run: Run, function: Function, args: Arguments, call: Call) -> dict[str, Value]:
    """Return the value of each parameter."""
    arguments = function.node.args
    names = [each.arg for each in (*arguments.posonlyargs, *arguments.args)]
    bound: dict[str, Value] = dict(zip(names, args.positional, strict=False))
    keywords = dict(args.keywords)
    for name in (*names, *(each.arg for each in arguments.kwonlyargs)):
        if name in bound:
            continue
        default = function.defaults.get(name)
        if name in keywords:
            bound[name] = keywords.pop(name)
        elif args.more and name in names:
            bound[name] = join(default or BOTTOM, args.more)
        elif args.more_keywords:
            bound[name] = join(default or BOTTOM, args.more_keywords)
        else:
            bound[name] = default if default is not None else unknown("an argument that is not given")
    if arguments.vararg is not None:
        left = args.positional[len(names) :]
        if args.more:
            bound[arguments.vararg.arg] = run.sequence(
                call.node, "list", Items(None, join_all([*left, args.more])), "*"
            )
        else:
            bound[arguments.vararg.arg] = run.tuple_of(*left)
    if arguments.kwarg is not None:
        mapping = run.allocate((call.node, function.node), "dict")
        fill(run, mapping, BOTTOM, keywords, args.more_keywords)
        bound[arguments.kwarg.arg] = (mapping,)
    return bound


def _alike(value: Value) -> Value:
    """Return ``value`` with one unknown in place of all, so that reasons make no contexts."""
    return tuple(ANY[0] if _is_of_program(atom) else atom for atom in value)


def _is_of_program(atom: object) -> bool:
    return isinstance(atom, Unknown) and atom.why not in OF_PROCESS


def _key(value: Value) -> object:
    """Return what tells contexts apart: the value, but of many objects only their classes."""
    objects = [atom for atom in value if isinstance(atom, Obj)]
    if len(objects) <= MAX_OBJECTS:
        return value
    return frozenset((each.kind, each.cls) for each in objects)


def call_function(run: Run, function: Function, call: Call) -> Value:
    """Run the body of ``function`` in the context of its arguments."""
    bound = bind(run, function, call.args, call)
    creates = run.creates(function.module.source, function.node)
    if run.cost.get(function, 0) > MAX_COST and not creates and function not in run.makers:
        bound = _with_earlier(run, function, bound)
    arguments = tuple(map(_alike, bound.values()))
    key = tuple(map(_key, arguments))
    if run.widening and run.is_new(function, key):  # a number may grow with each round
        bound = {name: _without_numbers(value) for name, value in bound.items()}
        arguments = tuple(map(_alike, bound.values()))
        key = tuple(map(_key, arguments))
    receiver = key[0] if key else None
    run.entered.add(function.node)
    value = run.in_context(
        function, receiver, key, arguments, lambda: _run_body(run, function, bound), 4 if creates else 2
    )
    if value is not None:
        return value
    if creates:
        run.not_followed(call.node, call.frame, f"{function.name}() calls itself and makes interfaces")
    return unknown("the result of a function that calls itself")


def _without_numbers(value: Value) -> Value:
    kept = tuple(atom for atom in value if type(atom) not in NUMBERS)
    return value if len(kept) == len(value) else join(kept, ANY)


def _with_earlier(run: Run, function: Function, bound: dict[str, Value]) -> dict[str, Value]:
    """Join the arguments of a call with those of earlier ones, so that the body is run for all of them at once."""
    earlier = run.joined.setdefault(function, {})
    for name, value in bound.items():
        earlier[name] = widen(earlier.get(name, BOTTOM), value, texts_too=True)
    return dict(earlier)


def _run_body(run: Run, function: Function, bound: dict[str, Value]) -> Value:
    node = function.node
    keeps = _makes_closures(node)
    cells = LocalCells(run.store.reads)
    if keeps:
        cells = run.captured.setdefault(run.context, cells)
        cells.reads = run.store.reads
    mark = run.store.mark()
    frame = Frame(function.module, cells, function.closure, Jumps(mark), function)
    frame.forks = run.forks
    for name, value in bound.items():
        run.store.write(cells, name, value)
    if isinstance(node, ast.Lambda):
        result = run.evaluate(node.body, frame)
    else:
        if _is_generator(node):
            frame.yields = []
        guards = run.guards
        ways = run.execute(node.body, frame)
        run.guards = guards
        run.land(mark, frame.jumps.exits, bool(ways & NEXT))
        run.ended = not ways & (NEXT | RETURN)
        result = join(frame.returned, NONE) if ways & NEXT else frame.returned
        if frame.yields is not None:
            run.ended = False
            result = _yielded(run, frame, node)
    cells.dead = not keeps
    return result


def _yielded(run: Run, frame: Frame, node: ast.AST) -> Value:
    assert frame.yields is not None and frame.function is not None
    if frame.function.decorated & {"contextmanager", "asynccontextmanager"}:
        return run.sequence(node, "lazy", Items(None, join_all(frame.yields)), "context")
    exact = frame.yields_known and not frame.loops
    items = Items(tuple(frame.yields)) if exact else Items(None, join_all(frame.yields))
    return run.sequence(node, "lazy", items, "yields")


def _call_bound(run: Run, method: Bound, call: Call) -> Value:
    args = call.args.preceded((method.receiver,))
    with run.under(*getattr(method.receiver, "guards", ())):
        return call_function(run, method.function, Call(args, call.node, call.frame))


def _call_partial(run: Run, partial: Partial, call: Call) -> Value:
    args = call.args.preceded(*partial.positional)
    args.keywords = {**dict(partial.keywords), **args.keywords}
    return run.call(partial.function, args, call.node, call.frame)


def _call_wrapped(run: Run, method: Wrapped, call: Call) -> Value:
    return run.call(method.function, call.args, call.node, call.frame)


def overrides(run: Run, cls: Class, name: str) -> bool:
    """Return whether a class of the program defines ``name``."""
    return any(name in each.cells and each.cells[name] != ABSENT for each in cls.classes())


CALLS.update({
    Function: call_function,
    Bound: _call_bound,
    Partial: _call_partial,
    Wrapped: _call_wrapped,
})  # fmt: skip
