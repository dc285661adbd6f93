"""Calls of analysed functions and classes: binding arguments, running bodies, recursion, memory."""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass, field

from nodl.infer.interpreter import generators
from nodl.infer.interpreter.define import foreign_bases, linearized, methods_in
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.iterate import elements, enum_members
from nodl.infer.interpreter.run import MAX_DEPTH, Caller, Run
from nodl.infer.methods import BoundMethod, ClassMethod, ForeignMethod, Getter, NativeMethod, Partial
from nodl.infer.models import foreign
from nodl.infer.values import (
    ANY,
    BOTTOM,
    COMMAND_LINE,
    NONE,
    OF_A_NODE,
    OTHER,
    TOO_MANY,
    ClassValue,
    Dictionary,
    External,
    FunctionValue,
    Instance,
    Items,
    Key,
    LocalCells,
    NativeObject,
    Unknown,
    Value,
    join,
    unknown,
)
from nodl.infer.widening import widen

MAX_ROUNDS = 8
MAX_RECURSION = 24  # calls of a function inside itself that are followed one by one
_OF_EXECUTORS = frozenset({"add_node", "remove_node", "wake"})  # of rclpy, whichever object it is
_CHANGES = frozenset({"append", "extend", "insert", "remove", "pop", "clear"})
_MISSING = unknown("an argument that the caller does not give")


Body = Callable[[Run, FunctionValue, LocalCells, Call], Value]


@dataclass
class Summary:
    """A function that calls itself: its joined parameters and result, run to a fixpoint.

    ``active``: its body is running; a call of it then adds to the parameters and gets the result so far.
    """

    parameters: dict[object, Value] = field(default_factory=dict)
    result: Value = BOTTOM
    active: bool = False
    widened: int = 0


def call_function(run: Run, function: FunctionValue, call: Call) -> Value:
    node = function.node
    if len(run.stack) >= MAX_DEPTH:
        run.gap(call.node, call.frame, "calls are nested too deep to be followed")
        return unknown("the result of a deeply nested call")
    cells = bind(run, function, call)
    run.called.setdefault(node)
    run.understood.add(call.node)
    if function.cached and not function.shared:
        return _cached(run, function, cells, call)
    if generators.is_generator(function):
        return _generator(run, function, cells, call)
    if node not in run.stack and not (run.repeated and node in run.recursive):
        return _remembered(run, function, cells, call)
    if node not in run.stack:
        return _remembered(run, function, cells, call, _summarised)
    if _decided_recursion(run, node, call.frame):
        return _remembered(run, function, cells, call)
    return _summarised(run, function, cells, call)


def _summarised(run: Run, function: FunctionValue, cells: LocalCells, call: Call) -> Value:
    """One of the calls that a function which calls itself gets: all of them together are one."""
    node = function.node
    run.recursive.add(node)
    summary = run.summaries.setdefault(node, Summary())
    _widen_parameters(run, summary, cells)
    if not summary.active:
        _run_recursive(run, function, summary, call)
    result: Value = summary.result
    return result  # nothing yet: this path ends in a call that has not come back so far


def _cached(run: Run, function: FunctionValue, cells: LocalCells, call: Call) -> Value:
    """``functools.cache``: the same constant arguments give the first result again."""
    key = ("cached", *cells.values())
    constant = all(len(value) == 1 and isinstance(value[0], str | int | float) for value in cells.values())
    held = function.attributes.get(key)
    if constant and held and not run.repeated:
        return held
    if function.node in run.stack:
        return (
            _remembered(run, function, cells, call)
            if _decided_recursion(run, function.node, call.frame)
            else ANY
        )
    result = _remembered(run, function, cells, call)
    if constant:
        run.state.write(function.attributes, key, result)
    return result


def _generator(run: Run, function: FunctionValue, cells: LocalCells, call: Call) -> Value:
    """An iterator that runs the body step by step; where that is not possible the body is run as a whole."""
    given = dict(cells)
    made = NativeObject(generators.steps(run, function, cells, call), run.state.forks, tuple(given.values()))

    def as_a_whole() -> Value:
        again = LocalCells()
        again.update(given)
        found = _run_body(run, function, again, call) if function.node not in run.stack else ANY
        return elements(run, found, call.node, call.frame).any_element()

    made.fallback = as_a_whole
    run.state.pulled += 1
    return (made,)


def _decided_recursion(run: Run, node: ast.AST, caller: Frame) -> bool:
    """Whether a function calls itself without an undecided test in between: it is followed as it runs."""
    if run.entries.get(node) != (run.state.forks, run.repeated) or node in run.summaries or caller.early:
        return False
    run.turns -= 1
    level = run.stack.count(node)
    if level > MAX_RECURSION:
        run.entries[node] = (-1, -1)  # it may never end: from here on its calls are joined
    return run.fuel > 0 and level <= MAX_RECURSION and len(run.stack) < MAX_DEPTH - 8


def _remembered(
    run: Run, function: FunctionValue, cells: LocalCells, call: Call, body: Body | None = None
) -> Value:
    """A call that leaves the state as it found it gives the same again while the state is the same."""
    key = (function, tuple(cells.values()), id(call.node) if run.context else 0)
    known = run.memo.get(key)
    version = (*run.state.version(), run.state.pulled, run.rounds)
    if known is not None and known[0] == version:
        return known[1]
    result = (body or _run_body)(run, function, cells, call)
    if (*run.state.version(), run.state.pulled, run.rounds) == version:
        run.memo[key] = (version, result)
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
    frame.forks = frame.loop_forks = run.state.forks
    entry = run.entries.get(function.node)
    if entry is None or entry[0] >= 0:
        run.entries[function.node] = (run.state.forks, run.repeated)
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
    if entry is not None and entry[0] >= 0:
        run.entries[function.node] = entry
    run.context = previous
    if frame.yielded is not None:
        return run.sequence(node, "generator", Items(None, frame.yielded or ANY))
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


# --- binding ----------------------------------------------------------------------------------------------


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
    return more or _MISSING


def _keywords(run: Run, node: ast.AST, given: Arguments, used: set[str]) -> Value:
    obj = run.allocate(node, "dict", Dictionary)
    for name, value in given.keywords.items():
        if name not in used:
            run.state.store(obj, Key(name), value)
    if given.more_keywords:
        run.state.store(obj, OTHER, given.more_keywords)
    return (obj,)


# --- callables --------------------------------------------------------------------------------------------


def _call_bound(run: Run, method: BoundMethod, call: Call) -> Value:
    shifted = Call(call.args.preceded((method.receiver,)), call.node, call.frame)
    return call_function(run, method.function, shifted)


def _call_partial(run: Run, partial: Partial, call: Call) -> Value:
    args = call.args.preceded(*partial.positional)
    args = Arguments(
        args.positional, {**dict(partial.keywords), **args.keywords}, args.more, args.more_keywords
    )
    return run.call(partial.function, args, call.node, call.frame)


def _call_getter(run: Run, getter: Getter, call: Call) -> Value:
    """``operator.methodcaller('m', ...)(x)`` is ``x.m(...)``."""
    owner = call.args.at(0) or ANY
    found: list[Value] = []
    for given in getter.positional[: 1 if getter.kind == "methodcaller" else None]:
        if getter.kind == "itemgetter":
            item = run.attribute(owner, "__getitem__", call.node, call.frame)
            found.append(run.call(item, Arguments([given]), call.node, call.frame))
            continue
        text = given[0] if len(given) == 1 and isinstance(given[0], str) else None
        if text is None:
            run.gap(call.node, call.frame, "an attribute whose name is made at run time is used")
            return ANY
        value = owner
        for step in text.split("."):
            value = run.attribute(value, step, call.node, call.frame)
        found.append(value)
    if getter.kind == "methodcaller":
        args = Arguments(list(getter.positional[1:]), dict(getter.keywords))
        return run.call(found[0], args, call.node, call.frame)
    return found[0] if len(found) == 1 else run.tuple_of(tuple(found))


def _call_instance(run: Run, instance: Instance, call: Call) -> Value:
    if isinstance(instance.cls, External):
        run.escape(call.args)
        return ANY
    return run.call(
        run.attribute((instance,), "__call__", call.node, call.frame), call.args, call.node, call.frame
    )


def _call_class_method(run: Run, method: ClassMethod, call: Call) -> Value:
    return run.call(method.function, call.args, call.node, call.frame)


def _call_unknown(run: Run, atom: Unknown, call: Call) -> Value:
    if atom.why == TOO_MANY:
        run.gap(call.node, call.frame, "one of too many functions is called here")
    function = call.node.func if isinstance(call.node, ast.Call) else None
    if atom.why == COMMAND_LINE and isinstance(function, ast.Attribute) and function.attr in _CHANGES:
        run.gap(call.node, call.frame, "the command line is changed in code")
    if isinstance(function, ast.Attribute) and function.attr in _OF_EXECUTORS:
        return (atom,)
    if atom.why == OF_A_NODE:
        run.gap(call.node, call.frame, "a method of the node whose name is made at run time is called here")
    run.escape(call.args)
    return (atom,)


def instantiate(run: Run, cls: ClassValue, call: Call) -> Value:
    """A new object: its constructor is the first one in the method resolution order."""
    for base in linearized(cls):
        if isinstance(base, ClassValue):
            run.instantiated.setdefault(base.node)
    found = _member_by_value(run, cls, call)
    if found:
        return found
    made = _made_by_new(run, cls, call)
    if made is not None:
        return made
    return (initialise(run, cls, new_instance(run, cls, call), call),)


def _member_by_value(run: Run, cls: ClassValue, call: Call) -> Value:
    """``Side('l')`` of an enumeration: the member with this value; nothing where that is not known."""
    if not any(isinstance(base, External) and base.path.startswith("enum.") for base in linearized(cls)):
        return BOTTOM
    wanted = call.args.at(0)
    members = enum_members(run, cls, call.node, call.frame).exact
    if wanted is None or len(wanted) != 1 or members is None or len(call.args.positional) != 1:
        return BOTTOM
    for member in members:
        atom = member[0]
        if (
            isinstance(atom, Instance)
            and atom.cells.get("_value_") == wanted
            and isinstance(wanted[0], str | int)
        ):
            return member
    return BOTTOM


def _made_by_new(run: Run, cls: ClassValue, call: Call) -> Value | None:
    """What the program's own ``__new__`` gives, initialised where it is an object of the class."""
    for base in linearized(cls):
        if isinstance(base, ClassValue) and "__new__" in base.cells:
            constructors = tuple(
                each
                for atom in base.cells["__new__"]
                for each in (atom.function if isinstance(atom, ClassMethod) else (atom,))
            )
            shifted = call.args.preceded((cls,))
            made = run.call(constructors, shifted, call.node, call.frame)
            for atom in made:
                if (
                    isinstance(atom, Instance)
                    and isinstance(atom.cls, ClassValue)
                    and cls in linearized(atom.cls)
                ):
                    initialise(run, atom.cls, atom, call)
            return made
    return None


def new_instance(run: Run, cls: ClassValue, call: Call) -> Instance:
    """``object.__new__(cls)``."""
    site = (call.frame.module.source.path, getattr(call.node, "lineno", 0))
    instance = run.allocate(call.node, f"instance {id(cls)}", lambda: Instance(cls, site))
    assert isinstance(instance, Instance)
    return instance


def initialise(run: Run, cls: ClassValue, instance: Instance, call: Call) -> Instance:
    """Call the constructor: the first one in the method resolution order."""
    _expect_callbacks(run, cls, instance)
    for base in linearized(cls):
        if isinstance(base, ClassValue):
            if "__del__" in base.cells:
                run.register_callback(run.attribute((instance,), "__del__", call.node, call.frame), 0)
            if base.fields is not None and "__init__" not in base.cells:
                _fill_fields(run, base, instance, call)
                break
            constructor = base.cells.get("__init__")
            if constructor:
                for atom in constructor:
                    if isinstance(atom, FunctionValue):
                        _call_bound(run, BoundMethod(atom, instance), call)
                break
        else:
            if isinstance(base, External) and base.path in ("builtins.object", "typing.Generic", "abc.ABC"):
                continue
            path = base.path if isinstance(base, External) else ""
            run.call_atom(ForeignMethod(path, instance, "__init__"), call)
            break
    return instance


def _fill_fields(run: Run, cls: ClassValue, instance: object, call: Call) -> None:
    assert isinstance(instance, Instance)
    for index, (name, default) in enumerate(cls.fields or ()):
        value = call.args.at(index, name)
        run.state.store(instance, name, value if value is not None else default or _MISSING)
    after = run.attribute((instance,), "__post_init__", call.node, call.frame)
    if isinstance(after[0], BoundMethod):
        run.call(after, Arguments(), call.node, call.frame)


def _expect_callbacks(run: Run, cls: ClassValue, instance: object) -> None:
    """A foreign base class calls the methods that override its own; which ones, only its model knows."""
    seen: set[object] = set()
    bases = foreign_bases(cls)
    hooks = [foreign.hooks_of(base) for base in bases]
    if not hooks:
        return
    every = any(names is None for names in hooks)
    wanted = frozenset().union(*(names for names in hooks if names is not None))
    for base in linearized(cls):
        if not isinstance(base, ClassValue):
            continue
        for name, value in list(base.cells.items()):
            if name in seen or name == "__init__" or not isinstance(name, str):
                continue
            if every or name in wanted:
                seen.add(name)
                run.register_callback(methods_in(value, instance, cls), None)


CALLABLES: dict[type, Caller] = {
    FunctionValue: call_function,
    BoundMethod: _call_bound,
    Partial: _call_partial,
    Getter: _call_getter,
    Instance: _call_instance,
    ClassMethod: _call_class_method,
    ClassValue: instantiate,
    Unknown: _call_unknown,
    External: foreign.call_external,
    ForeignMethod: foreign.call_foreign_method,
    NativeMethod: foreign.call_native,
}
