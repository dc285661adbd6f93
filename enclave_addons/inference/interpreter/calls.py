"""Calls of functions and classes of the program: arguments, bodies, generators, recursion, constructors."""

from __future__ import annotations

import ast
import functools

from enclave_addons.inference.interpreter.conditions import is_of_launch, under
from enclave_addons.inference.interpreter.define import (
    expect_operators,
    foreign_bases,
    functions_of,
    is_enumeration,
    linearized,
    member_with_value,
    methods_in,
    new_instance,
    program_classes,
)
from enclave_addons.inference.interpreter.run import MAX_DEPTH, Arguments, Call, Run
from enclave_addons.inference.models import foreign
from enclave_addons.inference.values import (
    ANY,
    BOTTOM,
    NONE,
    OF_LAUNCH,
    OTHER,
    BoundMethod,
    ClassValue,
    DataField,
    Dictionary,
    External,
    ForeignMethod,
    Frame,
    FunctionEntry,
    FunctionValue,
    Instance,
    Items,
    Key,
    LocalCells,
    Partial,
    Value,
    join,
    sole,
    unknown,
)

MISSING = unknown("an argument that the caller does not give")
EARLIER = unknown("what a cached function gave before")
GIVEN = unknown("what a generator gives")


def call_function(run: Run, function: FunctionValue, call: Call) -> Value:
    """Return what a call gives: nothing if no path comes back, unknown (and a gap) if calls nest too deep.

    A call of a function that is running is not followed: what it gives, and what it changes, is unknown.
    """
    node = function.node
    if len(run.stack) >= MAX_DEPTH:
        run.gap(call.node, call.frame, "calls are nested too deep to be followed")
        return unknown("the result of a deeply nested call")
    cells = bind(run, function, call)
    run.called.setdefault(node)
    if node in run.stack:  # what it would make is a gap: the call counts as not understood
        run.recursive.add(node)
        return unknown("the result of a function that is calling itself")
    run.understood.add(call.node)
    mark, born = run.state.mark(), len(run.born)
    result = _run_body(run, function, cells, call)
    if node in run.recursive:  # nobody knows what the inner calls changed
        run.state.unsettle(mark)
        objects = [
            each if isinstance(sole(each), (Instance, ClassValue)) else ANY for each in call.args.positional
        ]
        inner = bind(run, function, Call(Arguments(objects, more_keywords=ANY), call.node, call.frame))
        result = join(result, run.state.perhaps(lambda: _run_body(run, function, inner, call)))
        run.recursive.discard(node)
        run.state.unsettle(mark)
        for made in run.born[born:]:
            made.summary = True
    if is_generator(function) or _runs_later(run, function, call):  # its body may go on at any time
        later = Partial((function,), tuple(call.args.positional), tuple(call.args.keywords.items()))
        run.register_callback((later,), 0, mark)
        run.state.join_seen(mark, mixed=True)
    if is_generator(function):
        result = GIVEN
    return join(result, EARLIER) if function.cached else result


def _runs_later(run: Run, function: FunctionValue, call: Call) -> bool:
    """Return True for a coroutine that is not awaited where it is called."""
    return (
        isinstance(function.node, ast.AsyncFunctionDef)
        and isinstance(call.node, ast.Call)
        and call.node not in run.awaited
    )


def is_generator(function: FunctionValue) -> bool:
    """Return True if a function's own body has a ``yield``."""
    return function.module.source.has_yield and has_yield(function.node)


@functools.lru_cache(maxsize=8192)
def has_yield(node: ast.AST | None) -> bool:
    """Return True if the own body of a function has a ``yield``."""
    left = [node.body] if isinstance(node, ast.Lambda) else list(getattr(node, "body", []))
    while left:
        part = left.pop()
        if isinstance(part, (ast.Yield, ast.YieldFrom)):
            return True
        if not isinstance(part, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)):
            left.extend(ast.iter_child_nodes(part))
    return False


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
    frame.look_into()
    frame.again = earlier is not None
    frame.function = function
    frame.entry = FunctionEntry(call.node, run.context)
    frame.forks = frame.loop_forks = run.state.forks
    frame.guards = len(run.guards)
    run.entries.setdefault(function.node, {})[frame.entry] = None
    run.running.add(function)
    run.stack.append(function.node)
    mark = run.state.mark()
    node = function.node
    if isinstance(node, ast.Lambda):
        frame.returned = run.evaluate(node.body, frame)
    else:
        passes = run.execute(node.body, frame)
        if frame.early:
            run.state.join_seen(mark, None if frame.captured else cells, mixed=True)
        if passes:
            frame.returned = join(frame.returned, NONE)
    if cells.shared:
        run.captured_cells[key] = cells
    else:
        cells.dead = True
    run.stack.pop()
    run.context = previous
    return frame.returned  # nothing, if no path comes back


def call_bound(run: Run, method: BoundMethod, call: Call) -> Value:
    """Call the method's function with the receiver as its first argument."""
    shifted = Call(call.args.preceded((method.receiver,)), call.node, call.frame)
    guards = method.receiver.guards if isinstance(method.receiver, Instance) else ()
    return under(run, guards, lambda: call_function(run, method.function, shifted))


# --- arguments ----------------------------------------------------------------------------------------------


def bind(run: Run, function: FunctionValue, call: Call) -> LocalCells:
    """Return the parameters' values; what the caller does not give takes its default."""
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
        cells[parameters.vararg.arg] = run.sequence(call.node, "tuple", items, "positional arguments")
    if parameters.kwarg:
        cells[parameters.kwarg.arg] = _keywords(run, call.node, given, used)
    return cells


def _named(name: str, given: Arguments, default: Value | None, more: Value) -> Value:
    if name in given.keywords:
        return given.keywords[name]
    if default is not None:
        return join(default, more)
    return more or MISSING


def _keywords(run: Run, node: ast.AST, given: Arguments, used: set[str]) -> Value:
    obj = run.allocate(node, "keyword arguments", Dictionary)
    for name, value in given.keywords.items():
        if name not in used:
            run.state.store(obj, Key(name), value)
    if given.more_keywords:
        run.state.store(obj, OTHER, given.more_keywords)
    return (obj,)


def instantiate(run: Run, cls: ClassValue, call: Call) -> Value:
    """Return a new object: its constructor is the first one in the method resolution order."""
    for base in program_classes(cls):
        run.instantiated.setdefault(base.node)
    if is_enumeration(cls):
        run.register_callback(run.attribute((cls,), "_missing_", call.node, call.frame), 1, run.state.mark())
        value = call.args.at(0, "value") or ANY
        return OF_LAUNCH if any(map(is_of_launch, value)) else member_with_value(run, cls, value)
    made = _made_by_new(run, cls, call)
    if made is not None:
        return made
    instance = new_instance(run, cls, call)
    initialise(run, cls, instance, call)
    return (instance,)


def _made_by_new(run: Run, cls: ClassValue, call: Call) -> Value | None:
    """Return what the program's own ``__new__`` gives, initialised where it is an object of the class."""
    for base in program_classes(cls):
        if "__new__" in base.cells:
            constructors = functions_of(base.cells["__new__"])
            made = run.call(constructors, call.args.preceded((cls,)), call.node, call.frame)
            for atom in (each for each in made if isinstance(each, Instance)):
                if isinstance(atom.cls, ClassValue) and cls in linearized(atom.cls):
                    initialise(run, atom.cls, atom, call)
            return made
    return None


def initialise(run: Run, cls: ClassValue, instance: Instance, call: Call) -> None:
    """Call the constructor: the first one in the method resolution order."""
    _expect_callbacks(run, cls, instance)
    expect_operators(run, cls, instance)
    for base in linearized(cls):
        if isinstance(base, ClassValue):
            if base.fields is not None and "__init__" not in base.cells:
                _fill_fields(run, base, instance, call)
                break
            constructor = base.cells.get("__init__")
            if constructor:
                for atom in constructor:
                    if isinstance(atom, FunctionValue):
                        call_bound(run, BoundMethod(atom, instance), call)
                break
        else:
            if isinstance(base, External) and base.path in ("builtins.object", "typing.Generic", "abc.ABC"):
                continue
            path = base.path if isinstance(base, External) else ""
            run.call_atom(ForeignMethod(path, instance, "__init__"), call)
            break


def _fill_fields(run: Run, cls: ClassValue, instance: Instance, call: Call) -> None:
    index = 0
    for name, field in (cls.fields or {}).items():
        place = index if field.by_position else -1
        value = call.args.at(place, name) if field.by_keyword else None
        index += field.by_position
        run.state.store(instance, name, value if value is not None else _default(run, field, call))
    after = run.attribute((instance,), "__post_init__", call.node, call.frame)
    if isinstance(after[0], BoundMethod):
        run.call(after, Arguments(), call.node, call.frame)


def _default(run: Run, field: DataField, call: Call) -> Value:
    if field.factory is None:
        return field.default or MISSING
    factory, node, frame = field.factory
    previous = run.enter(id(call.node))  # what the factory makes is of this object
    made = run.call(factory, Arguments(), node, frame)
    run.context = previous
    return made


def _expect_callbacks(run: Run, cls: ClassValue, instance: Instance) -> None:
    """Expect a foreign base class to call the methods that override its own; which ones, only its model knows."""
    seen: set[object] = set()
    hooks = [foreign.hooks_of(base) for base in foreign_bases(cls)]
    if not hooks:
        return
    every = any(names is None for names in hooks)
    wanted = frozenset().union(*(names for names in hooks if names is not None))
    for base in program_classes(cls):
        for name, value in list(base.cells.items()):
            if (
                name not in seen
                and name != "__init__"
                and isinstance(name, str)
                and (every or name in wanted)
            ):
                seen.add(name)
                since = None if instance in run.findings.node_of else run.state.mark()
                run.register_callback(methods_in(value, instance, cls), None, since)
