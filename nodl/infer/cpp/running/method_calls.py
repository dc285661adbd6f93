"""Calls on an object: by its own class, by the table of libraries, or of something that is not known."""

from __future__ import annotations

from collections.abc import Sequence

from nodl.infer.cpp.ledger import CREATES
from nodl.infer.cpp.libraries import LIBRARY_METHODS, NODE_METHODS, Call
from nodl.infer.cpp.reading.declarations import Function
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.callees import callee_name, is_only_declared, types_of
from nodl.infer.cpp.running.containers import CONTAINER_METHODS, container_call, is_standard
from nodl.infer.cpp.running.contents import handed_over
from nodl.infer.cpp.running.hiding import class_of_member, lexical_class
from nodl.infer.cpp.running.invocation import call_methods, call_values
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.own_operators import pointed_to
from nodl.infer.cpp.running.unknown_calls import unknown_call, without_source
from nodl.infer.cpp.running.values import (
    BOTTOM,
    Bound,
    Const,
    Group,
    Lambda,
    Map,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    join,
    unknown,
)
from nodl.infer.cpp.running.variables import declared_type, member
from nodl.infer.cpp.syntax import Node, field_of, text, unwrapped


def is_library_method(this_object: Obj, name: str) -> bool:
    """Whether the tables have this method for the object: as a node, by its class or its library base."""
    if this_object.is_node and name in NODE_METHODS:
        return True
    return (this_object.foreign_base, name) in LIBRARY_METHODS or (
        this_object.type.name,
        name,
    ) in LIBRARY_METHODS


def method_call(run: Machine, node: Node, callee: Node, given: list[Node], frame: Frame) -> Value:
    """``x.f(...)`` for each thing that ``x`` may be, results joined; ``BOTTOM`` where ``x`` holds nothing."""
    receiver_node = field_of(callee, "argument")
    field = unwrapped(field_of(callee, "field"))
    name = callee_name(field) if field is not None else ""
    if field is not None and field.type == "qualified_identifier":
        name = name.rpartition("::")[2]
    receiver = run.evaluate(receiver_node, frame)
    if text(field_of(callee, "operator")) == "->":
        receiver = pointed_to(run, receiver, "operator->", callee, frame)
    if (
        name in ("get", "lock", "value", "release")
        and not given
        and any(isinstance(a, Obj) for a in receiver)
    ):
        kept = tuple(a for a in receiver if not run.methods_of(a, name))
        if kept == receiver:
            return receiver
    if name == "reset" and _is_pointer(run, receiver_node, frame, receiver):
        return _reset(run, receiver_node, node, given, frame)
    if not receiver:
        values = [run.evaluate(each, frame) for each in given]
        run.later(values, frame)
        if receiver_node is not None and _could_make(run, receiver_node, name, frame):
            run.unset[(frame.file.file, node.start_byte)] = (
                run.place(node, frame),
                text(receiver_node)[:40],
                name,
            )
        return BOTTOM
    found: list[Value] = []
    before = run.store.mark()
    alternatives = []
    for atom in receiver:
        found.append(_on_atom(run, atom, name, node, callee, receiver_node, given, frame))
        if len(receiver) > 1:
            alternatives.append(run.store.changes(before))
            run.store.undo(before)
    if alternatives:
        run.store.merge(alternatives)
        run.left = None
    return join(*found)


def _could_make(run: Machine, receiver: Node, name: str, frame: Frame) -> bool:
    """Whether the method, of an object that was not seen to be made, would make interfaces."""
    written = declared_type(run, receiver, frame)
    cls = run.names.class_of(written[0], frame.scope, frame.file) if written is not None else None
    if cls is not None:
        return any(map(run.makes_interfaces, run.names.find_methods(cls, name)))
    if CREATES.fullmatch(name):
        return True
    if written is not None and written[0].name not in ("", "auto"):
        return False
    return any(run.makes_interfaces(f) for table in run.names.methods.values() for f in table.get(name, ()))


def _is_pointer(run: Machine, receiver_node: Node | None, frame: Frame, receiver: Value) -> bool:
    if receiver_node is None or any(
        isinstance(a, Obj)
        and a.cls
        and run.names.find_methods(a.cls, "reset")
        and not _declared_pointer(run, receiver_node, frame)
        for a in receiver
    ):
        return False
    return _declared_pointer(run, receiver_node, frame)


def _declared_pointer(run: Machine, node: Node, frame: Frame) -> bool:
    if node.parent is not None and "->" in text(node.parent)[len(text(node)) : len(text(node)) + 3]:
        return False
    found = declared_type(run, node, frame)
    return found is not None and found[1]


def _reset(run: Machine, receiver_node: Node | None, node: Node, given: list[Node], frame: Frame) -> Value:
    """``pointer.reset(new Foo(...))``."""
    value = run.evaluate(given[0], frame) if given else BOTTOM
    if receiver_node is not None:
        assign(run, receiver_node, value, frame)
    return BOTTOM


def _on_atom(
    run: Machine,
    atom: object,
    name: str,
    node: Node,
    callee: Node,
    receiver_node: Node | None,
    given: list[Node],
    frame: Frame,
) -> Value:
    if isinstance(atom, Obj):
        return on_object(run, atom, name, node, callee, given, frame)
    if isinstance(atom, Lambda | Bound):
        values = [run.evaluate(each, frame) for each in given]
        return call_values(run, (atom,), values, node, frame) if name == "operator()" else BOTTOM
    if isinstance(atom, Text | Seq | Map | Group | Param | bool | int | float | Const) or (
        isinstance(atom, Unknown) and name in CONTAINER_METHODS
    ):
        return container_call(run, atom, name, node, receiver_node, given, frame)
    values = [run.evaluate(each, frame) for each in given]
    why = atom.why if isinstance(atom, Unknown) else "not known"
    return _on_unknown(run, name, values, node, receiver_node, given, frame, why)


def on_object(
    run: Machine, atom: Obj, name: str, node: Node, callee: Node, given: list[Node], frame: Frame
) -> Value:
    """A method of one object: its source, else a closure in a member, else the tables, else unknown code."""
    types = types_of(run, callee, frame)
    if atom.cls is not None:
        argument = field_of(callee, "argument")
        own = argument is not None and argument.type == "this" and "::" not in text(field_of(callee, "field"))
        seen = None if own else class_of_member(run, atom, name, callee, frame)
        methods = run.names.find_methods(seen, name) if seen is not None else of_this(run, atom, name, frame)
        if methods:
            values = [run.evaluate(each, frame) for each in given]
            return call_methods(run, methods, atom, values, node, frame, types)
        field = member(run, atom, name, seen or lexical_class(run, atom, frame))
        if field is not None and name not in NODE_METHODS:
            values = [run.evaluate(each, frame) for each in given]
            return call_values(run, field, values, node, frame)
    values = [run.evaluate(each, frame) for each in given]
    call = Call(node, frame, values, types, given, atom)
    found = by_model(run, atom, name, call)
    if found is not None:
        return found
    if atom.cls is not None and is_only_declared(run, atom.cls, name):
        return without_source(run, f"{atom.cls.name}::{name}", values, node, frame, atom)
    if atom.node is not None and not atom.is_node and not name.startswith("create"):
        run.later(values, frame)
        return unknown(f"the result of {name}()")
    return unknown_call(run, f"{atom.type.name}::{name}", values, node, given, frame, receiver=atom)


def of_this(run: Machine, this: Obj, name: str, frame: Frame) -> list[Function]:
    """What ``name()`` calls inside of a class: its own while it is made as a base, or if it is not virtual."""
    assert this.cls is not None
    methods = run.names.find_methods(this.cls, name)
    owner = frame.function.owner if frame.function is not None else ""
    cls = run.names.find_class(owner, frame.scope, frame.file) if owner else None
    ancestry = run.names.ancestry(this.cls)
    if this.building is not None and this.building is not this.cls:
        return run.names.find_methods(this.building, name) or methods
    if cls is None or cls is this.cls or cls not in ancestry or not methods:
        return methods
    lexical = run.names.find_methods(cls, name)
    every = [m for each in ancestry for m in run.names.methods.get(each, {}).get(name, ())]
    if any(each.virtual for each in (*every, *run.names.declarations(this.cls, name))):
        return methods
    return lexical or methods


def by_model(run: Machine, atom: Obj, name: str, call: Call) -> Value | None:
    """What the tables know of a method; ``None`` if they do not know it."""
    model = LIBRARY_METHODS.get((atom.type.name, name)) or LIBRARY_METHODS.get((atom.foreign_base, name))
    if model is None and atom.is_node:
        model = NODE_METHODS.get(name)
    if model is None:
        return None
    run.handle(call.node, call.frame)
    return model(run, call)


def _on_unknown(
    run: Machine, name: str, values: Sequence[Value], node: Node, receiver_node: Node | None, given: list[Node],
    frame: Frame, why: str,
) -> Value:  # fmt: skip
    if CREATES.fullmatch(name):
        run.handle(node, frame)
        run.gap(
            node,
            frame,
            f"the node that {text(receiver_node)[:60]}->{name}() makes an interface on is not known: {why}",
        )
        return unknown(f"the result of {name}()")
    written = declared_type(run, receiver_node, frame) if receiver_node is not None else None
    known_type = (
        written is not None and written[0].name not in ("", "auto") and not is_own_class(run, written[0])
    )
    if not known_type:
        possible = [
            f
            for c, table in run.names.methods.items()
            for f in table.get(name, ())
            if run.makes_interfaces(f)
        ]
        possible = [f for f in possible if len(values) <= len(f.parameters) + (9 if f.variadic else 0)]
        if possible and not is_standard(name):
            run.gap(
                node,
                frame,
                f"which {name}() is called here is not known ({why}); {possible[0]} makes interfaces",
            )
    handed_over(run, f"{text(receiver_node)[:40]}->{name}()", values, node, frame)
    return unknown(f"the result of {name}()")


def is_own_class(run: Machine, kind: Type) -> bool:
    """Whether the program's files have a class of this name, in whatever namespace."""
    return kind.last in run.names.classes
