"""How an object of a class is made: its bases, its members in the order of their declaration, the body, as C++ does."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from nodl.infer.cpp.libraries import LIBRARY_CLASSES, Call, is_harmless_class
from nodl.infer.cpp.reading.declarations import Class, Field, Function, FunctionParameter
from nodl.infer.cpp.reading.known_headers import KNOWN_HEADERS, ROS_LIBRARIES
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.reading.writes import writes_of
from nodl.infer.cpp.running.contents import copied, handed_over
from nodl.infer.cpp.running.hiding import check_hidden
from nodl.infer.cpp.running.machine import MAX_DEPTH, MAX_RECURSION, NEXT, Frame, Machine
from nodl.infer.cpp.running.objects import (
    MAPS,
    SEQUENCES,
    converted,
    default_value,
    fields_of,
    initial_value,
    is_aggregate,
    made,
)
from nodl.infer.cpp.running.overloads import chosen
from nodl.infer.cpp.running.values import BOTTOM, Map, Obj, Seq, Text, Unknown, Value, join, unknown
from nodl.infer.cpp.syntax import Node, children


def construct(
    run: Machine,
    kind: Type,
    arguments: Sequence[Value],
    node: Node,
    frame: Frame,
    *,
    heap: bool = False,
    members: Mapping[str, Value] | None = None,
) -> Value:
    """Make an object of ``kind``: by its source, by the table of libraries, or one of which nothing is known."""
    cls = run.class_of(kind, frame)
    if cls is None and kind.name in SEQUENCES | MAPS and not arguments:
        run.handle(node, frame)
        return (Seq(()),) if kind.name in SEQUENCES else (Map(()),)
    key = ("object", frame.file.file, node.start_byte, node.end_byte, frame.path, kind)
    made_object = run.obj(key, kind, cls=cls, heap=heap)
    run.handle(node, frame)
    if cls is not None:
        if members is None and arguments and is_aggregate(run, cls):
            members = dict(zip(fields_of(cls), arguments, strict=False))
        made_object.data["members"] = members or {}
        check_hidden(run, cls, node, frame)
        _check_operators(run, cls, node, frame)
        _start_fields(run, made_object, cls)
        construct_class(run, made_object, cls, kind, arguments, node, frame)
        return (made_object,)
    if kind.name in ("std::thread", "std::jthread") and arguments:
        from nodl.infer.cpp.running.standard import STANDARD

        run.store.others_run()
        STANDARD[kind.name](run, arguments, node, frame)
    model = LIBRARY_CLASSES.get(kind.name)
    if model is not None:
        call = Call(node, frame, list(arguments), kind.arguments, receiver=made_object)
        found = model(run, call)
        return (made_object,) if found is None else found
    if not is_harmless_class(kind.name):
        handed_over(run, f"the constructor of {kind.name}", arguments, node, frame)
        _unmodelled(run, kind, node, frame, heap or bool(arguments))
    made_object.data["arguments"] = list(arguments)
    return (made_object,)


def _unmodelled(run: Machine, kind: Type, node: Node, frame: Frame, deliberate: bool) -> None:
    """Make an object of a class that is neither in reach nor in the table: it may be a node or make one.

    ``deliberate``: it is made with arguments or with new, as structures of C are not.
    """
    if run.names.is_of_c(kind.name, frame.file):
        return
    first = kind.name.partition("::")[0]
    if first in KNOWN_HEADERS and not (deliberate and first in ROS_LIBRARIES):
        return
    if first in ROS_LIBRARIES:
        why = f"the class {kind.name} is not in the table of {first}: it may be a node or make one"
        run.gap(node, frame, why)
        return
    header = run.names.foreign_header(kind.name, frame.file)
    if not header and deliberate and "::" not in kind.name:
        header = "no header in reach defines it"
    if header:
        why = f"the class {kind.name} is not in reach ({header}): it may be a node or make one"
        run.gap(node, frame, why)


def _check_operators(run: Machine, cls: Class, node: Node, frame: Frame) -> None:
    """Add a gap for an operator that changes something and whose calls are not followed: conversions, ``,``, and
    comparisons, from which C++20 derives others."""
    ancestry = run.names.ancestry(cls)
    kept = {name for each in ancestry for name in each.fields} | run.names.globals.keys()
    listed = [
        (name, f) for each in ancestry for name, found in run.names.methods[each].items() for f in found
    ]
    for name, method in listed:
        if _NOT_FOLLOWED.fullmatch(name) and (
            run.makes_interfaces(method) or writes_of(method.node).changed & kept
        ):
            why = f"{name} of {cls.name} changes something: where it runs is not followed"
            run.gap(node, frame, why)


_NOT_FOLLOWED = re.compile(r"operator (?!new|delete)\w.*|operator(?:,|&&|\|\||==|<=>)")


def _start_fields(run: Machine, made_object: Obj, cls: Class) -> None:
    for each in run.names.ancestry(cls):
        for name, member in each.fields.items():
            if not member.static:
                run.store.set((made_object, name), BOTTOM)


def construct_class(
    run: Machine, this: Obj, cls: Class, kind: Type, arguments: Sequence[Value], node: Node, frame: Frame
) -> None:
    """Run the constructor of ``cls`` (a base or the class itself) on ``this``."""
    if frame.depth > MAX_DEPTH:
        run.gap(node, frame, f"the bases of {cls.name} are deeper than is followed")
        return
    this.bindings[cls] = run.names.specialisations.bindings(cls, kind)
    constructor = chosen(
        run.names.find_methods(cls, cls.name) if cls.name in run.names.methods[cls] else [], arguments
    )
    path = (*frame.path[-24:], (frame.file.file, node.start_byte))
    inner = run.frame(
        (cls, this, path), Frame(cls.file, cls.scope, None, this, this.bindings[cls], path=frame.path)
    )
    if constructor is not None:
        if run.active.count(constructor) > MAX_RECURSION:
            run.gap(node, frame, f"the constructor of {cls.name} calls itself")
            return
        inner.function, inner.file, inner.scope = constructor, constructor.file, constructor.scope
        run.called.add(constructor)
        run.active.append(constructor)
    inner.depth = frame.depth + 1
    inner.path, inner.active = path, True
    inner.conditions = run.conditions(node, frame)
    inner.mark = run.store.mark()
    if constructor is not None:
        bind_parameters(run, constructor, arguments, inner)
    written = list(constructor.initialisers) if constructor else []
    given = {_member_name(name): value for name, value in written}
    delegate = next((value for name, value in written if _is_delegate(cls, name)), None)
    if delegate is not None:
        values = [run.evaluate(each, inner) for each in children(delegate)]
        construct_class(run, this, cls, kind, values, delegate, inner)
    else:
        _bases(run, this, cls, given, arguments, node, inner)
        _members(run, this, cls, given, inner)
    this.building, outside = cls, this.building
    if constructor is not None and constructor.body is not None:
        outcome = run.execute(constructor.body, inner)
        run.settle(inner.mark, inner.exits, bool(outcome & NEXT))
    this.building = outside
    if constructor is not None:
        _written_arguments(run, constructor, arguments, inner, node, frame)
    inner.active, inner.finished = False, not inner.captured
    if constructor is not None:
        run.active.pop()
    elif arguments and not this.data["members"] and not cls.inherits_constructors:
        _made_unseen(run, cls, arguments, node, frame)


def _made_unseen(run: Machine, cls: Class, arguments: Sequence[Value], node: Node, frame: Frame) -> None:
    """Make an object though no constructor in reach takes these arguments: a copy, or one that is not known."""
    if cls.name in cls.declared:
        whom = f"the constructor of {cls.name}, whose source is not in reach"
        handed_over(run, whom, arguments, node, frame)
        run.gap(node, frame, f"the source of the constructor of {cls.name} is not in reach")
    elif len(arguments) > 1 or not all(isinstance(atom, Obj | Unknown) for atom in arguments[0]):
        run.gap(node, frame, f"how {cls.name} is made of what it is given is not known")


def _written_arguments(
    run: Machine, constructor: Function, arguments: Sequence[Value], inner: Frame, node: Node, frame: Frame
) -> None:
    """Add a gap if a constructor writes to a text or list of its caller through a reference."""
    for parameter, value in zip(constructor.parameters, arguments, strict=False):
        after = run.store.get((inner, parameter.name)) or BOTTOM
        changed = is_written_back(parameter) and set(after) != set(value)
        if changed and any(isinstance(atom, Text | Seq | Map) for atom in (*value, *after)):
            what = f"what the constructor of {constructor.name} writes to its argument {parameter.name}"
            run.gap(node, frame, f"{what} is not followed")


def is_written_back(parameter: FunctionParameter) -> bool:
    """Return whether what a function writes to the parameter shows in its caller."""
    marked = parameter.type.rstrip().endswith(("&", "*"))
    return marked and "const" not in parameter.type.split() and bool(parameter.name)


def _is_delegate(cls: Class, written: str) -> bool:
    """Return whether an initialiser names the class itself, not a base or member of the same last name."""
    plain = written.partition("<")[0]
    if plain.rpartition("::")[2] != cls.name or cls.name in cls.fields:
        return False
    same = [base for base in cls.bases if _member_name(base) == cls.name]
    return not same or ("::" in plain and not any(base.partition("<")[0].endswith(plain) for base in same))


def _member_name(name: str) -> str:
    return name.partition("<")[0].rpartition("::")[2]


def _bases(
    run: Machine, this: Obj, cls: Class, given: dict[str, Node], arguments: Sequence[Value], node: Node, inner: Frame
) -> None:  # fmt: skip
    for written in cls.bases:
        kind = run.names.resolve(written, cls.scope, cls.file, this.bindings.get(cls))
        where = given.get(_member_name(written)) or given.get(kind.last)
        where = where or _alias_initialiser(run, cls, kind, given, inner)
        if where is not None:
            run.handle(where, inner)
            values = [run.evaluate(each, inner) for each in children(where)]
            if cls.virtual_base and values:
                run.gap(where, inner, f"{cls.name} has a virtual base: who makes it is not followed")
        else:
            values = list(arguments) if cls.inherits_constructors else []
        base = run.class_of(kind, cls)
        if base is not None and base is not cls:
            construct_class(run, this, base, kind, values, where or node, inner)
        else:
            frame = inner if where is not None else Frame(cls.file, cls.scope, path=inner.path)
            _foreign_base(run, this, cls, kind, values, where or node, frame)


def _alias_initialiser(
    run: Machine, cls: Class, kind: Type, given: dict[str, Node], inner: Frame
) -> Node | None:
    for name, where in given.items():
        if name not in cls.fields and run.type_of(name, inner).name == kind.name:
            return where
    return None


def _foreign_base(
    run: Machine, this: Obj, cls: Class, kind: Type, values: Sequence[Value], node: Node, frame: Frame
) -> None:
    """Make a base whose source is not in reach: of a node, of a library that is known, or a gap."""
    this.foreign_base = kind.name
    model = LIBRARY_CLASSES.get(kind.name)
    if model is not None:
        model(run, Call(node, frame, list(values), this.type.arguments, receiver=this))
    elif not is_harmless_class(kind.name):
        why = f"the base class {kind} of {cls.name} is not known: it may be a node or make interfaces"
        run.gap(cls.node if frame.file is cls.file else node, frame, why, this.node)
        handed_over(run, f"the constructor of {kind}", values, node, frame, ignore=this)


def _members(run: Machine, this: Obj, cls: Class, given: dict[str, Node], inner: Frame) -> None:
    known: Mapping[str, Value] = this.data.get("members", {})  # of an aggregate
    of_class = Frame(
        cls.file, cls.scope, None, this, inner.bindings, path=inner.path, conditions=inner.conditions, depth=inner.depth
    )  # fmt: skip
    for name, member in cls.fields.items():
        if member.static:
            continue
        kind = run.names.resolve(member.type, cls.scope, cls.file, this.bindings.get(cls))
        where, kind = given.get(name), kind._replace(pointer=member.pointer or kind.pointer)
        if name in known:
            found = known[name]
            if not kind.pointer:
                found = copied(run, found, member.node, inner, run.class_of(kind, cls))
        else:
            found = _member(
                run, member, kind, where or member.default, inner if where is not None else of_class
            )
        before = run.store.get((this, name)) or BOTTOM  # of a member that this one hides
        run.store.set((this, name), join(before, found))


def _member(run: Machine, member: Field, kind: Type, value: Node | None, frame: Frame) -> Value:
    """Return what a member holds at first: of its initialiser, else as it is declared."""
    if value is None:
        if kind.pointer:
            return BOTTOM
        return default_value(run, member.node, kind, replace(frame, path=(*frame.path, member.name)))
    run.handle(value, frame)
    if kind.pointer or (member.type == "auto" and value.type not in ("argument_list", "initializer_list")):
        return initial_value(run, value, frame, True)
    if value.type in ("argument_list", "initializer_list"):
        return made(run, value, kind, children(value), frame)
    return converted(run, kind, run.evaluate(value, frame), value, frame)


def bind_parameters(run: Machine, function: Function, arguments: Sequence[Value], inner: Frame) -> None:
    """Give each parameter its argument, a copy unless ``&`` or ``*``; else its default or an unknown."""
    inner.function = function
    for index, parameter in enumerate(function.parameters):
        if index < len(arguments):
            value = arguments[index]
            if function.variadic and index + 1 == len(function.parameters) < len(arguments):
                value = unknown("several arguments of a parameter pack")
            value = as_parameter(run, parameter, value, function.node, inner)
        else:
            value = unknown(f"the argument {parameter.name}")
            if parameter.default is not None:
                place = Frame(
                    function.file, function.scope, None, inner.this, inner.bindings, path=inner.path
                )
                value = run.evaluate(parameter.default, place)
        if parameter.name:
            run.local(inner, parameter.name, value, parameter.type)


def as_parameter(run: Machine, parameter: FunctionParameter, value: Value, node: Node, inner: Frame) -> Value:
    """Return an argument as its parameter has it: an object of its class unless it is a reference or pointer."""
    if parameter.type.rstrip().endswith(("&", "*")):
        return value
    return copied(run, value, node, inner, _class_of_parameter(run, parameter, value, inner))


def _class_of_parameter(
    run: Machine, parameter: FunctionParameter, value: Value, inner: Frame
) -> Class | None:
    """Return the class of a parameter that is an object, if an object is given."""
    if not any(isinstance(atom, Obj) and atom.cls is not None for atom in value):
        return None
    if inner.function is not None and not {*re.findall(r"\w+", parameter.type)}.isdisjoint(
        inner.function.templates
    ):
        return None  # may be a pointer
    kind = run.type_of(parameter.type, inner)
    return run.held_class(kind, inner)
