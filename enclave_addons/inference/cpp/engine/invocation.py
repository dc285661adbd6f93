"""How functions, methods and closures of the program are called, once for each way to them up to a limit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from enclave_addons.inference.cpp.engine.frames import NEXT, Frame, Variable
from enclave_addons.inference.cpp.engine.machine import ALLOWANCE, MAX_DEPTH, AllowanceExceeded, Machine
from enclave_addons.inference.cpp.engine.objects import before_body, converted, copied
from enclave_addons.inference.cpp.engine.overloads import candidates
from enclave_addons.inference.cpp.engine.places import declared_type, local, places_of, write
from enclave_addons.inference.cpp.engine.store import Changes, Footprint
from enclave_addons.inference.cpp.engine.values import (
    Bound,
    Group,
    Lambda,
    Map,
    Obj,
    Param,
    Place,
    Pointer,
    Seq,
    Text,
    Value,
    is_open,
    join,
    unknown,
)
from enclave_addons.inference.cpp.reading.declarations import Function, parameters_of
from enclave_addons.inference.cpp.reading.type_names import NO_TYPE, Type
from enclave_addons.inference.cpp.syntax import Node, field_of, text

_CLOSURE = re.compile(r"\[[^\[\]]*\]\s*(?:\(|\{|mutable\b)")
REPEATS = 3
"""Calls of a function with the same arguments that run in full; later ones repeat what one of them did."""
MAX_CONTEXTS = 48
"""Calls of a function with different arguments; of later ones the texts and numbers are not known."""
MAX_CLOSURE_CALLS = 200
"""Calls of one closure; whatever later ones call is not known."""
HOOKS = ("on_configure", "on_activate", "on_deactivate", "on_cleanup", "on_shutdown", "on_error")
"""Transitions of a lifecycle node; the first two are run before anything that they have prepared."""


@dataclass
class Ran:
    """What a call with certain arguments did."""

    record: Footprint
    changes: Changes
    returned: Value


@dataclass
class History:
    """The calls of one function."""

    counts: dict[object, int] = field(default_factory=dict)  # by arguments
    ran: dict[object, Ran] = field(default_factory=dict)
    steps: int = 0
    written: frozenset[str] | None = None
    keeps: bool | None = None


def history_of(run: Machine, function: Function) -> History:
    """Return what is known of earlier calls of a function."""
    found = run.histories.setdefault(function, History())
    assert isinstance(found, History)
    return found


def invoke(
    run: Machine, function: Function, this: Obj | None, values: Sequence[Value], node: Node, frame: Frame,
    types: Sequence[Type] = (), given: Sequence[Node] = (),
) -> Value:  # fmt: skip
    """Call a function of the program; return what it gives."""
    run.handle(node, frame)
    if function in run.active or len(run.active) > MAX_DEPTH:
        if len(run.active) > MAX_DEPTH:
            run.lost(node, frame)
        return unknown(f"what {function.name}() gives while it runs")
    leads = run.leading.function(function)
    history = history_of(run, function)
    if not leads and history.steps > ALLOWANCE:
        return _skipped(run, function, this, given, frame)
    run.called.add(function)
    inner = Frame(function.file, function.scope, function, this)
    inner.path = run.path(frame.path, node.start_byte, frame.file.file, function)
    inner.conditional = run.is_conditional(node, frame)
    inner.bindings = _bindings(run, function, this, types, values, given, frame)
    places = [
        _referred(run, p.written_back, given[i : i + 1], frame) for i, p in enumerate(function.parameters)
    ]
    key: object = (
        this,
        *(place or value for place, value in zip(places, values, strict=False)),
        bool(run.undecided),
    )
    if key not in history.counts and len(history.counts) >= MAX_CONTEXTS:
        values = [_widened(value) for value in values]
        key = (this, *values, "many")
    history.counts[key] = history.counts.get(key, 0) + 1
    if history.counts[key] <= REPEATS:
        return _limited(
            run, function, history, leads, lambda: _body(run, function, inner, values, places, node)
        )
    ran = history.ran.get(key)
    if ran is not None and run.store.holds(ran.record):
        for cell, value in ran.changes.items():
            run.store.set(cell, value)
        return ran.returned
    run.store.begin_record()
    mark = run.store.mark()
    try:
        found = _limited(
            run, function, history, leads, lambda: _body(run, function, inner, values, places, node)
        )
        changes = run.store.changes(mark)
    finally:
        record = run.store.end_record()
    history.ran[key] = Ran(record, changes, found)
    return found


def _limited(run: Machine, function: Function, history: History, leads: bool, body: object) -> Value:
    """Run a body; one that leads to no interface gets a number of steps, and what it gives is not known behind them."""
    assert callable(body)
    started, limit, depth = run.steps, run.limit, len(run.active)
    undecided, repeated, skips = run.undecided, run.repeated, run.skips
    if not leads:
        run.limit = min(limit, run.steps + max(0, ALLOWANCE - history.steps))
    try:
        found: Value = body()
        return found
    except AllowanceExceeded:
        if leads or limit < run.steps:
            raise
        del run.active[depth:]
        run.undecided, run.repeated, run.skips = undecided, repeated, skips
        _forget_written(run, function)
        return unknown(f"what {function.name}() gives, which takes long")
    finally:
        run.limit = limit
        if not leads:
            history.steps += run.steps - started


def _body(
    run: Machine,
    function: Function,
    frame: Frame,
    values: Sequence[Value],
    places: Sequence[Place | None],
    node: Node,
) -> Value:
    run.active.append(function)
    frame.mark = run.store.mark()
    _bind_parameters(run, function, frame, values, places)
    if frame.this is not None and function.name == function.owner.rpartition("::")[2]:
        before_body(run, function, frame.this, frame, node)
    skips = run.skips
    outcome = run.execute(function.body, frame)
    run.skips = skips
    run.store.settle(frame.mark, frame.exits, bool(outcome & NEXT))
    if not _keeps_variables(run, function):
        run.store.forget_locals(frame.mark)
    run.active.pop()
    return frame.returned


def _keeps_variables(run: Machine, function: Function) -> bool:
    """Return whether variables of a function may be used after it: by a closure, or from ``main``."""
    history = history_of(run, function)
    if history.keeps is None:
        history.keeps = function.name == "main" or bool(_CLOSURE.search(text(function.node)))
    return history.keeps


def _bind_parameters(
    run: Machine, function: Function, frame: Frame, values: Sequence[Value], places: Sequence[Place | None]
) -> None:
    last = len(function.parameters) - 1
    for index, parameter in enumerate(function.parameters):
        if not parameter.name:
            continue
        place = places[index] if index < len(places) else None
        if (
            index == last
            and function.variadic
            and "..." in text(function.node)[:2000]
            and len(values) != last + 1
        ):
            local(run, frame, parameter.name, function.node, (Group(tuple(values[last:])),), parameter.type)
        elif place is not None and index < len(values):
            frame.variables[parameter.name] = Variable(place, parameter.type)
        else:
            if index < len(values):
                value = values[index]
                if not parameter.type.rstrip().endswith(("&", "*")):
                    value = copied(
                        run, value, function.node, replace(frame, path=run.path(frame.path, parameter.name))
                    )
                value = converted(run, value, run.type_of(parameter.type, frame), function.node, frame)
            else:
                value = run.evaluate(parameter.default, frame)
            local(run, frame, parameter.name, function.node, value, parameter.type)


def _referred(run: Machine, written_back: bool, given: Sequence[Node], frame: Frame) -> Place | None:
    """Return the variable of the caller that a reference parameter stands for."""
    found = places_of(run, given[0], frame) if written_back and given else []
    if len(found) != 1 or any(isinstance(atom, Pointer) for atom in run.store.get(found[0].cell)):
        return None
    return found[0]


def _bindings(
    run: Machine, function: Function, this: Obj | None, types: Sequence[Type], values: Sequence[Value],
    given: Sequence[Node], frame: Frame,
) -> dict[str, Type]:  # fmt: skip
    found: dict[str, Type] = {}
    for cls in run.names.ancestry(this.cls) if this is not None else ():
        found |= this.bindings.get(cls, {}) if this is not None else {}
    if not function.templates:
        return found
    found |= dict(zip(function.templates, types, strict=False))
    for index, parameter in enumerate(function.parameters):
        words = re.findall(r"\w+", parameter.type)
        name = next((each for each in function.templates if each in words and each not in found), None)
        if name is None or index >= len(values):
            continue
        kind = declared_type(run, given[index], frame) if index < len(given) else NO_TYPE
        first = next((atom for atom in values[index] if isinstance(atom, Obj)), None)
        if f"<{name}>" in parameter.type.replace(" ", ""):
            if (
                kind.name.endswith(("Publisher", "Subscription", "Client", "Service", "Server"))
                and kind.arguments
            ):
                found[name] = kind.arguments[0]
            elif kind.name:
                found[name] = (
                    kind._replace(pointer=False)
                    if "ptr" in parameter.type
                    else kind.arguments[0]
                    if kind.arguments
                    else kind
                )
            elif first is not None:
                found[name] = first.type
        elif first is not None:
            found[name] = first.type
        elif kind.name:
            found[name] = kind
    return found


def _widened(value: Value) -> Value:
    why = "one of many values that the function is called with"
    return join(
        *(unknown(why) if isinstance(a, Text | Param | Seq | Map | int | float) else (a,) for a in value)
    )


_ASSIGNED = re.compile(
    r"\b([A-Za-z_]\w*)\s*(?:\[[^\]]*\]\s*)?(?:=(?!=)|\+=|\.(?:push_back|emplace\w*|insert\w*|clear|erase|assign|append|resize)\b)"
)


def assigned_in(code: str) -> frozenset[str]:
    """Return the names that code may change, by its text."""
    return frozenset(_ASSIGNED.findall(code))


def written_names(run: Machine, function: Function) -> frozenset[str]:
    """Return the names that a function may change."""
    history = history_of(run, function)
    if history.written is None:
        history.written = assigned_in(text(function.node))
    return history.written


def _forget_written(run: Machine, function: Function) -> None:
    """Know nothing of the texts and numbers that code may have changed which was not followed to its end."""
    for cell in run.store.cells_named(written_names(run, function)):
        held = run.store.get(cell)
        known = any(isinstance(atom, Text | int | float | Seq | Map) for atom in held)
        if known and not is_open(held):
            run.store.set(cell, join(held, unknown(f"what {function.name}() writes, which takes long")))


def _skipped(
    run: Machine, function: Function, this: Obj | None, given: Sequence[Node], frame: Frame
) -> Value:
    run.called.add(function)
    for index, parameter in enumerate(function.parameters):
        place = _referred(run, parameter.written_back, given[index : index + 1], frame)
        if place is not None:
            held = run.store.get(place.cell)
            if any(isinstance(atom, Text | int | float | Seq | Map) for atom in held):
                write(run, place, join(held, unknown(f"what {function.name}() writes")))
    _forget_written(run, function)
    return unknown(f"what {function.name}() gives, which takes long")


# --- closures and functions as values -------------------------------------------------------------------------------


def call_value(run: Machine, value: Value, values: Sequence[Value], node: Node, frame: Frame,
               given: Sequence[Node] = ()) -> Value | None:  # fmt: skip
    """Call what a variable holds; ``None`` if it holds nothing that can be called."""
    callables = [atom for atom in value if isinstance(atom, Lambda | Bound)]
    operators = [(each, found) for each in value if isinstance(each, Obj)
                 if (found := run.names.find_methods(each.cls, "operator()"))]  # fmt: skip
    if not callables and not operators:
        return None
    run.handle(node, frame)

    def one(way: Lambda | Bound | tuple[Obj, list[Function]]) -> Value:
        if isinstance(way, Lambda | Bound):
            return call_callable(run, way, values, node, frame, given)
        return call_methods(run, way[1], way[0], values, node, frame, (), given)

    return run.each_way(one, [*callables, *operators][:12])


def call_callable(
    run: Machine,
    atom: Lambda | Bound,
    values: Sequence[Value],
    node: Node,
    frame: Frame,
    given: Sequence[Node] = (),
) -> Value:
    """Call a closure, or a function with the arguments that are bound to it."""
    if isinstance(atom, Lambda):
        return call_lambda(run, atom, values, node, frame, given)
    this, rest = atom.this, [*atom.fixed, *values] if not atom.fixed else list(atom.fixed)
    function = atom.function
    if this is None and function.owner and not function.static and rest:
        objects = [
            a
            for a in rest[0]
            if isinstance(a, Obj) and function in run.names.find_methods(a.cls, function.name)
        ]
        if objects:
            this, rest = objects[0], rest[1:]
    rest = rest[: len(function.parameters)] if not function.variadic else rest
    rest += [unknown(f"the argument {p.name}") for p in function.parameters[len(rest) :] if p.default is None]
    return invoke(run, function, this, rest, node, frame, (), () if atom.fixed else given)


def call_lambda(
    run: Machine, atom: Lambda, values: Sequence[Value], node: Node, frame: Frame, given: Sequence[Node] = ()
) -> Value:
    """Call a closure."""
    if atom.key in run.active or len(run.active) > MAX_DEPTH:
        return unknown("what a closure gives while it runs")
    run.closures[atom.key] = run.closures.get(atom.key, 0) + 1
    if run.closures[atom.key] > MAX_CLOSURE_CALLS:
        run.lost(atom.node, atom.frame)
        return unknown("what a closure gives that is called very often")
    outer = atom.frame
    inner = Frame(outer.file, outer.scope, outer.function, atom.this, outer.bindings)
    inner.path = run.path(outer.path, atom.key, frame.path, node.start_byte)
    inner.conditional = outer.conditional
    for name, what in atom.captured:
        if isinstance(what, Place):
            inner.variables[name] = Variable(
                what, outer.variables[name].type if name in outer.variables else ""
            )
        else:
            local(run, inner, name, atom.node, what)
    declarator = field_of(atom.node, "declarator")
    listed = parameters_of(declarator) if declarator is not None else []
    for index, parameter in enumerate(listed):
        places = places_of(run, given[index], frame) if parameter.written_back and index < len(given) else []
        if len(places) == 1:
            inner.variables[parameter.name] = Variable(places[0], parameter.type)
        elif parameter.name:
            value = values[index] if index < len(values) else unknown(f"the argument {parameter.name}")
            local(run, inner, parameter.name, atom.node, value, parameter.type)
    run.active.append(atom.key)
    inner.mark = run.store.mark()
    skips = run.skips
    outcome = run.execute(field_of(atom.node, "body"), inner)
    run.skips = skips
    run.store.settle(inner.mark, inner.exits, bool(outcome & NEXT))
    run.active.pop()
    return inner.returned


def call_methods(
    run: Machine, methods: Sequence[Function], this: Obj | None, values: Sequence[Value], node: Node, frame: Frame,
    types: Sequence[Type], given: Sequence[Node] = (),
) -> Value:  # fmt: skip
    """Call the overload that the arguments mean; all of them where their looks do not tell them apart."""
    fitting = candidates(methods, values)
    if not fitting:
        run.lost(node, frame)
        return unknown(f"the result of {methods[0].name}()" if methods else "a result")

    def one(each: Function) -> Value:
        return invoke(run, each, _this_of(run, each, this), values, node, frame, types, given)

    return run.each_way(one, fitting[:3])


def _this_of(run: Machine, function: Function, this: Obj | None) -> Obj | None:
    return None if function.static else this
