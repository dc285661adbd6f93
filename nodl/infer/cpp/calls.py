"""Calls: who is called, with what, and what comes back.

A call that cannot be followed is a gap when one of its possible targets makes interfaces, when it gets a node, or when
its name makes an interface in rclcpp.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from nodl.infer.cpp.declarations import Class, Function, parameters_of
from nodl.infer.cpp.expressions import assign, current_object, declared_type, member, variable
from nodl.infer.cpp.ledger import CREATES
from nodl.infer.cpp.libraries import (
    LIBRARY_CLASSES,
    LIBRARY_FUNCTIONS,
    LIBRARY_METHODS,
    NODE_BASES,
    NODE_METHODS,
    Call,
    is_harmless_class,
    is_harmless_function,
)
from nodl.infer.cpp.machine import (
    MAX_DEPTH,
    MAX_RECURSION,
    NEXT,
    Frame,
    Machine,
    expression,
    template_arguments,
)
from nodl.infer.cpp.names import NO_TYPE, Type
from nodl.infer.cpp.objects import (
    bind_parameters,
    chosen,
    construct,
    copied,
    handed_over,
    is_plain_type,
    made,
    nodes_in,
)
from nodl.infer.cpp.standard import CASTS, CONTAINER_METHODS, STANDARD, container_call, is_standard
from nodl.infer.cpp.store import Changes
from nodl.infer.cpp.syntax import children, text, unwrapped
from nodl.infer.cpp.values import (
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

if TYPE_CHECKING:
    from tree_sitter import Node


@expression("call_expression")
def call_expression(run: Machine, node: Node, frame: Frame) -> Value:
    callee = unwrapped(node.child_by_field_name("function"))
    if callee is None:
        return unknown("a call")
    arguments = node.child_by_field_name("arguments")
    if callee.type == "field_expression":
        return _method_call(run, node, callee, children(arguments), frame)
    if callee.type in (
        "identifier",
        "qualified_identifier",
        "template_function",
        "type_identifier",
        "template_type",
        "primitive_type",
        "dependent_name",
    ):
        return _named_call(run, node, callee, children(arguments), frame)
    values = [run.evaluate(each, frame) for each in children(arguments)]
    return call_values(run, run.evaluate(callee, frame), values, node, frame)


def _plain(callee: Node) -> str:
    """The name of a callee without its template arguments."""
    whole = re.sub(r"\s+", "", text(callee))
    if not whole.endswith(">"):
        return whole.lstrip(":")
    depth = 0
    for position in range(len(whole) - 1, -1, -1):
        depth += (whole[position] == ">") - (whole[position] == "<")
        if depth == 0:
            return whole[:position].lstrip(":")
    return whole


def types_of(run: Machine, callee: Node, frame: Frame) -> list[Type]:
    return [run.type_of(text(each), frame) for each in template_arguments(callee)]


# --- by name --------------------------------------------------------------------------------------------------


def _named_call(run: Machine, node: Node, callee: Node, given: list[Node], frame: Frame) -> Value:
    name = _plain(callee)
    if name in CASTS:
        return run.evaluate(given[0], frame) if given else BOTTOM
    if "::" not in name:
        owner = frame.owner_of(name)
        if owner is not None:
            values = [run.evaluate(each, frame) for each in given]
            return call_values(run, run.store.get((owner, name)) or BOTTOM, values, node, frame)
    found = _own_method(run, node, callee, name, given, frame)
    if found is not None:
        return found
    return _free_call(run, node, callee, name, given, frame)


def _own_method(
    run: Machine, node: Node, callee: Node, name: str, given: list[Node], frame: Frame
) -> Value | None:
    """``f()`` and ``Base::f()`` inside of a class; ``None`` if the class has no such method."""
    this_object = current_object(frame)
    if this_object is None:
        return None
    head, separator, last = name.rpartition("::")
    if not separator:
        if this_object.cls is not None:
            methods = run.names.find_methods(this_object.cls, name) or _hidden(run, this_object, name, frame)
            if methods:
                values = [run.evaluate(each, frame) for each in given]
                return call_methods(
                    run, methods, this_object, values, node, frame, types_of(run, callee, frame)
                )
            field = member(run, this_object, name, frame)
            if field is not None:
                values = [run.evaluate(each, frame) for each in given]
                return call_values(run, field, values, node, frame)
        if run.names.find_functions(name, frame.scope, frame.file):
            return None
        if _is_library_method(this_object, name):
            return _on_object(run, this_object, name, node, callee, given, frame)
        if this_object.cls is not None and _undefined(run, this_object.cls, name):
            values = [run.evaluate(each, frame) for each in given]
            return _without_source(run, f"{this_object.cls.name}::{name}", values, node, frame, this_object)
        return None
    kind = run.type_of(head, frame)
    cls = run.names.class_of(kind, frame.scope, frame.file)
    if cls is not None and this_object.cls is not None and cls in run.names.ancestry(this_object.cls):
        methods = run.names.find_methods(cls, last)
        if methods:
            values = [run.evaluate(each, frame) for each in given]
            return call_methods(
                run, methods, this_object, values, node, frame, types_of(run, callee, frame), exactly=True
            )
    if (
        cls is None
        and kind.name in NODE_BASES | {this_object.foreign_base: None}
        and _is_library_method(this_object, last)
    ):
        values = [run.evaluate(each, frame) for each in given]
        return _by_model(
            run,
            this_object,
            last,
            Call(node, frame, values, types_of(run, callee, frame), given, this_object),
        )
    return None


def _hidden(run: Machine, this_object: Obj, name: str, frame: Frame) -> list[Function]:
    """A method of the class whose code runs, where the object is of a class that does not derive from it by source."""
    owner = frame.function.owner if frame.function is not None else ""
    cls = run.names.find_class(owner, frame.scope, frame.file) if owner else None
    return run.names.find_methods(cls, name) if cls is not None else []


def _undefined(run: Machine, cls: Class, name: str) -> bool:
    return bool(run.names.declarations(cls, name))


def _is_library_method(this_object: Obj, name: str) -> bool:
    if this_object.is_node and name in NODE_METHODS:
        return True
    return (this_object.foreign_base, name) in LIBRARY_METHODS or (
        this_object.type.name,
        name,
    ) in LIBRARY_METHODS


def _free_call(run: Machine, node: Node, callee: Node, name: str, given: list[Node], frame: Frame) -> Value:
    qualified = _qualified(run, name, frame)
    types = types_of(run, callee, frame)
    if qualified in (
        "std::make_shared",
        "std::make_unique",
        "make_shared",
        "make_unique",
        "boost::make_shared",
        "std::allocate_shared",
    ):
        values = [run.evaluate(each, frame) for each in given]
        kind = types[0] if types else NO_TYPE
        return construct(run, kind._replace(pointer=False), values, node, frame, heap=True)
    functions = run.names.find_functions(name, frame.scope, frame.file)
    if functions:
        values = [run.evaluate(each, frame) for each in given]
        return call_functions(run, functions, values, node, frame, types)
    standard = STANDARD.get(qualified)
    if standard is not None:
        values = [run.evaluate(each, frame) for each in given]
        return standard(run, values, node, frame, types)
    model = LIBRARY_FUNCTIONS.get(qualified)
    if model is not None:
        values = [run.evaluate(each, frame) for each in given]
        run.handle(node, frame)
        return model(run, Call(node, frame, values, types, given))
    head, _, last = qualified.rpartition("::")
    if last in ("make_shared", "make_unique", "create") and head:
        made_value = _static_maker(run, head, last, node, given, frame)
        if made_value is not None:
            return made_value
    kind = run.type_of(text(callee), frame)
    known = kind.name in LIBRARY_CLASSES or is_plain_type(kind.name) or kind.last.endswith("Options")
    if known or run.names.class_of(kind, frame.scope, frame.file) is not None:
        return made(run, node, kind, given, frame)
    if head:
        found = _static_method(run, node, callee, head, last, given, frame)
        if found is not None:
            return found
    values = [run.evaluate(each, frame) for each in given]
    if variable_call := _callable_value(run, name, frame):
        return call_values(run, variable_call, values, node, frame)
    return unknown_call(run, qualified, values, node, given, frame)


def _callable_value(run: Machine, name: str, frame: Frame) -> Value:
    found = variable(run, name, frame)
    return found if any(isinstance(atom, Lambda | Bound) for atom in found) else BOTTOM


def _qualified(run: Machine, name: str, frame: Frame) -> str:
    head, separator, last = name.rpartition("::")
    if separator:
        return f"{run.type_of(head, frame).name}::{last}"
    target = run.names.alias(name, frame.scope, frame.file)
    if target is not None and "::" in target[0]:
        return target[0].lstrip(":")
    if name in ("to_string", "make_shared", "make_unique", "move", "bind", "ref"):
        return f"std::{name}"
    return name


def _static_maker(
    run: Machine, head: str, last: str, node: Node, given: list[Node], frame: Frame
) -> Value | None:
    """``rclcpp::Node::make_shared(...)``: as ``std::make_shared<rclcpp::Node>(...)``."""
    kind = run.type_of(head, frame)
    cls = run.names.class_of(kind, frame.scope, frame.file)
    if cls is not None and run.names.find_methods(cls, last):
        return None
    if last == "create" and kind.name not in LIBRARY_CLASSES:
        return None
    values = [run.evaluate(each, frame) for each in given]
    return construct(run, kind._replace(pointer=False), values, node, frame, heap=True)


def _static_method(
    run: Machine, node: Node, callee: Node, head: str, last: str, given: list[Node], frame: Frame
) -> Value | None:
    kind = run.type_of(head, frame)
    cls = run.names.class_of(kind, frame.scope, frame.file)
    if cls is None:
        return None
    methods = run.names.find_methods(cls, last)
    values = [run.evaluate(each, frame) for each in given]
    if methods:
        this_object = current_object(frame)
        inside = (
            this_object is not None
            and this_object.cls is not None
            and cls in run.names.ancestry(this_object.cls)
        )
        return call_methods(
            run,
            methods,
            this_object if inside else None,
            values,
            node,
            frame,
            types_of(run, callee, frame),
            exactly=True,
            bindings=dict(zip(cls.templates, kind.arguments, strict=False)),
        )
    if _undefined(run, cls, last):
        return _without_source(run, f"{cls.name}::{last}", values, node, frame, None)
    return None


# --- on an object ---------------------------------------------------------------------------------------------


def _method_call(run: Machine, node: Node, callee: Node, given: list[Node], frame: Frame) -> Value:
    receiver_node = callee.child_by_field_name("argument")
    field = unwrapped(callee.child_by_field_name("field"))
    name = _plain(field) if field is not None else ""
    if field is not None and field.type == "qualified_identifier":
        name = name.rpartition("::")[2]
    receiver = run.evaluate(receiver_node, frame)
    if (
        name in ("get", "lock", "value", "release")
        and not given
        and any(isinstance(a, Obj) for a in receiver)
    ):
        kept = tuple(
            a
            for a in receiver
            if not (isinstance(a, Obj) and a.cls is not None and run.names.find_methods(a.cls, name))
        )
        if kept == receiver:
            return receiver
    if name == "reset" and _is_pointer(run, receiver_node, frame, receiver):
        return _reset(run, receiver_node, node, given, frame)
    if not receiver:
        values = [run.evaluate(each, frame) for each in given]
        for value in values:
            for atom in value:
                run.later(atom, frame)
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
    return join(*found)


def _could_make(run: Machine, receiver: Node, name: str, frame: Frame) -> bool:
    """Whether the method, of an object that was not seen to be made, would make interfaces."""
    written = declared_type(run, receiver, frame)
    cls = run.names.class_of(written[0], frame.scope, frame.file) if written is not None else None
    if cls is not None:
        return any(map(run.makes_interfaces, run.names.find_methods(cls, name)))
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
        return _on_object(run, atom, name, node, callee, given, frame)
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


def _on_object(
    run: Machine, atom: Obj, name: str, node: Node, callee: Node, given: list[Node], frame: Frame
) -> Value:
    types = types_of(run, callee, frame)
    if atom.cls is not None:
        methods = run.names.find_methods(atom.cls, name)
        if methods:
            values = [run.evaluate(each, frame) for each in given]
            return call_methods(run, methods, atom, values, node, frame, types)
        field = member(run, atom, name, frame)
        if field is not None and name not in NODE_METHODS:
            values = [run.evaluate(each, frame) for each in given]
            return call_values(run, field, values, node, frame)
    values = [run.evaluate(each, frame) for each in given]
    call = Call(node, frame, values, types, given, atom)
    found = _by_model(run, atom, name, call)
    if found is not None:
        return found
    if atom.cls is not None and _undefined(run, atom.cls, name):
        return _without_source(run, f"{atom.cls.name}::{name}", values, node, frame, atom)
    if atom.node is not None and not atom.is_node and not name.startswith("create"):
        for value in values:
            for each in value:
                run.later(each, frame)
        return unknown(f"the result of {name}()")
    return unknown_call(run, f"{atom.type.name}::{name}", values, node, given, frame, receiver=atom)


def _by_model(run: Machine, atom: Obj, name: str, call: Call) -> Value | None:
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
    return kind.last in run.names.classes


# --- functions with source --------------------------------------------------------------------------------------


def call_values(run: Machine, callee: Value, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    """Call whatever ``callee`` holds."""
    found: list[Value] = []
    for atom in callee:
        if isinstance(atom, Lambda):
            found.append(call_lambda(run, atom, values, node, frame))
        elif isinstance(atom, Bound):
            found.append(invoke(run, atom.function, atom.this, values, node, frame, ()))
        elif (
            isinstance(atom, Obj) and atom.cls is not None and run.names.find_methods(atom.cls, "operator()")
        ):
            found.append(
                call_methods(
                    run, run.names.find_methods(atom.cls, "operator()"), atom, values, node, frame, ()
                )
            )
        elif isinstance(atom, Obj) and atom.data.get("partial") is not None:
            inner, fixed = atom.data["partial"]
            found.append(call_values(run, inner, _placed(fixed, values), node, frame))
        else:
            name = text(node.child_by_field_name("function"))[:60]
            handed_over(run, f"{name}()", values, node, frame)
            found.append(unknown(f"the result of {name}()"))
    return join(*found) if found else unknown("the result of a call")


def _placed(fixed: Sequence[Value], values: Sequence[Value]) -> list[Value]:
    """The arguments of ``std::bind`` with its placeholders filled in."""
    found = []
    for value in fixed:
        place = next(
            (
                a.why
                for a in value
                if isinstance(a, Unknown) and re.search(r"the value of (?:\w+::)*_\d$", a.why)
            ),
            "",
        )
        index = int(place[-1]) - 1 if place else -1
        found.append((values[index] if index < len(values) else unknown("an argument")) if place else value)
    return found


def call_lambda(run: Machine, atom: Lambda, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    if frame.depth > MAX_DEPTH:
        return unknown("a recursion")
    outer = atom.frame
    inner = Frame(
        outer.file, outer.scope, outer.function, None, outer.bindings, outer,
        (*frame.path[-24:], (outer.file.file, node.start_byte)), (*outer.conditions, *run.conditions(node, frame)),
        depth=frame.depth + 1,
    )  # fmt: skip
    inner.mark = run.store.mark()
    declarator = atom.node.child_by_field_name("declarator")
    for index, parameter in enumerate(parameters_of(declarator) if declarator is not None else ()):
        value = values[index] if index < len(values) else unknown(f"the argument {parameter.name}")
        run.local(inner, parameter.name, value, parameter.type)
    body = atom.node.child_by_field_name("body")
    outcome = run.execute(body, inner) if body is not None else NEXT
    run.settle(inner.mark, inner.exits, bool(outcome & NEXT))
    return inner.returned


def call_functions(
    run: Machine,
    functions: Sequence[Function],
    values: Sequence[Value],
    node: Node,
    frame: Frame,
    types: Sequence[Type],
) -> Value:
    function = chosen(functions, values)
    if function is None:
        return unknown_call(run, functions[0].name, values, node, [], frame)
    return invoke(run, function, None, values, node, frame, types)


def call_methods(
    run: Machine,
    methods: Sequence[Function],
    this_object: Obj | None,
    values: Sequence[Value],
    node: Node,
    frame: Frame,
    types: Sequence[Type],
    *,
    exactly: bool = False,
    bindings: dict[str, Type] | None = None,
) -> Value:
    function = chosen(methods, values)
    if function is None and this_object is not None and this_object.cls is not None and not exactly:
        for base in run.names.ancestry(this_object.cls)[1:]:
            function = chosen(run.names.methods.get(base, {}).get(methods[0].name, []), values)
            if function is not None:
                break
    if function is None:
        name = f"{methods[0].owner}::{methods[0].name}"
        if this_object is not None and this_object.is_node and methods[0].name in NODE_METHODS:
            run.handle(node, frame)
            return NODE_METHODS[methods[0].name](
                run, Call(node, frame, list(values), list(types), [], this_object)
            )
        return unknown_call(run, name, values, node, [], frame)
    return invoke(run, function, this_object, values, node, frame, types, bindings)


def invoke(
    run: Machine, function: Function, this_object: Obj | None, values: Sequence[Value], node: Node, frame: Frame,
    types: Sequence[Type], bindings: dict[str, Type] | None = None,
) -> Value:  # fmt: skip
    """Run the body of ``function``."""
    run.handle(node, frame)
    run.called.add(function)
    if run.active.count(function) > MAX_RECURSION or frame.depth > MAX_DEPTH:
        if function.parameters and run.makes_interfaces(function):
            run.gap(node, frame, f"{function} calls itself, deeper than is followed")
        return unknown("a recursion")
    if function.only_computes and not run.makes_interfaces(function):
        return unknown(f"the result of {function.name}()")
    inner = Frame(
        function.file, function.scope, function, this_object, bindings or {},
        path=(*frame.path[-24:], (frame.file.file, node.start_byte)),
        conditions=run.conditions(node, frame), depth=frame.depth + 1,
    )  # fmt: skip
    if this_object is not None:
        inner.bindings = {**_class_bindings(run, function, this_object), **(bindings or {})}
    deduced = {**_element_types(run, function, node, frame), **_deduced(run, function, values, types)}
    inner.bindings = {**inner.bindings, **deduced}
    inner.mark = run.store.mark()
    run.active.append(function)
    bind_parameters(run, function, values, inner)
    outcome = run.execute(function.body, inner) if function.body is not None else NEXT
    if function.name in HOOKS:
        inner.exits = _successes(inner)
    run.settle(inner.mark, inner.exits, bool(outcome & NEXT))
    run.active.pop()
    _write_back(run, function, inner, node, frame)
    inner.finished = not inner.captured
    return inner.returned


# Transitions of a lifecycle node (rclcpp_lifecycle/node_interfaces/lifecycle_node_interface.hpp).
HOOKS = ("on_configure", "on_activate", "on_deactivate", "on_cleanup", "on_shutdown", "on_error")


def _successes(inner: Frame) -> list[Changes]:
    """A transition that fails leaves the node where nothing else runs."""
    kept = [
        changes
        for changes, value in zip(inner.exits, inner.exit_values, strict=True)
        if not value or not all(_FAILED.search(str(getattr(a, "why", getattr(a, "name", "")))) for a in value)
    ]
    return kept or inner.exits


_FAILED = re.compile(r"::(?:FAILURE|ERROR)$")


def _class_bindings(run: Machine, function: Function, this_object: Obj) -> dict[str, Type]:
    for cls, bound in this_object.bindings.items():
        if (
            cls.qualified == function.owner
            or cls.qualified.endswith("::" + function.owner)
            or cls.scope == function.scope
        ):
            return bound
    return {}


def _element_types(run: Machine, function: Function, node: Node, frame: Frame) -> dict[str, Type]:
    """``T`` of a parameter ``std::list<T> &``, from the container that is given."""
    bound: dict[str, Type] = {}
    given = children(node.child_by_field_name("arguments")) if function.templates else []
    for parameter, argument in zip(function.parameters, given, strict=False):
        match = re.search(r"<\s*(\w+)\s*>", parameter.type)
        target = unwrapped(argument)
        if target is not None and target.type == "pointer_expression":
            target = target.child_by_field_name("argument")
        if match is None or match[1] not in function.templates or target is None:
            continue
        written = declared_type(run, target, frame)
        if written is not None and written[0].arguments:
            bound[match[1]] = written[0].arguments[0]
    return bound


def _deduced(
    run: Machine, function: Function, values: Sequence[Value], types: Sequence[Type]
) -> dict[str, Type]:
    """Template parameters: as given, else from the types of the arguments."""
    bound = dict(zip(function.templates, types, strict=False))
    for parameter, value in zip(function.parameters, values, strict=False):
        name = re.sub(r"\b(?:const|typename)\b|[&*\s]", "", parameter.type)
        inner = re.fullmatch(r"std::(?:shared_ptr|unique_ptr|weak_ptr)<(\w+)>", name)
        name = inner[1] if inner else name
        if name in function.templates and name not in bound:
            kinds = [atom.type for atom in value if isinstance(atom, Obj)]
            if kinds:
                bound[name] = kinds[0]
    return bound


def _write_back(run: Machine, function: Function, inner: Frame, node: Node, frame: Frame) -> None:
    """What a function does to its reference parameters shows in the caller's variables."""
    given = children(node.child_by_field_name("arguments"))
    for parameter, argument in zip(function.parameters, given, strict=False):
        marks = parameter.type.rstrip()
        if not marks.endswith(("&", "*")) or "const" in parameter.type.split() or not parameter.name:
            continue
        target = unwrapped(argument)
        if target is not None and target.type == "pointer_expression":
            target = target.child_by_field_name("argument")
        if target is None or target.type not in ("identifier", "field_expression", "subscript_expression"):
            continue
        value = run.store.get((inner, parameter.name))
        if value is not None and value != run.evaluate(target, frame):
            assign(run, target, value, frame)


# --- without source ---------------------------------------------------------------------------------------------


def _without_source(
    run: Machine, name: str, values: Sequence[Value], node: Node, frame: Frame, receiver: Obj | None
) -> Value:
    """Declared in a header in reach, defined where we cannot see it."""
    nodes = [o for value in values for o in nodes_in(run, value)]
    if receiver is not None and receiver.node is not None:
        nodes.append(receiver)
    holder = receiver is not None and receiver.cls is not None and _holds_node(run, receiver)
    if nodes or holder or CREATES.fullmatch(name.rpartition("::")[2]):
        record = nodes[0].node if nodes else None
        run.gap(node, frame, f"the source of {name}() is not in reach; it may make interfaces", record)
    run.handle(node, frame)
    handed_over(run, f"{name}()", [v for v in values if not nodes_in(run, v)], node, frame)
    return unknown(f"the result of {name}()")


def _holds_node(run: Machine, holder: Obj) -> bool:
    for each in run.names.ancestry(holder.cls) if holder.cls is not None else ():
        for name in each.fields:
            if nodes_in(run, run.store.get((holder, name)) or BOTTOM):
                return True
    return False


def unknown_call(
    run: Machine,
    name: str,
    values: Sequence[Value],
    node: Node,
    given: Sequence[Node],
    frame: Frame,
    receiver: Obj | None = None,
) -> Value:
    """A function of a library that is not modelled."""
    last = name.rpartition("::")[2]
    harmless = is_harmless_function(name) or (receiver is not None and receiver.type.name in LIBRARY_CLASSES)
    if receiver is not None and receiver.foreign_base and is_harmless_class(receiver.foreign_base):
        harmless = True
    if CREATES.fullmatch(last) and not harmless:
        run.handle(node, frame)
        run.gap(
            node,
            frame,
            f"{name}() may make an interface; whose is not known",
            receiver.node if receiver else None,
        )
    if receiver is not None and last.startswith("emplace"):  # the element that it makes may be anything
        handed_over(run, f"an element that {last}() makes", values, node, frame)
    if harmless:
        for value in values:
            for atom in value:
                run.later(atom, frame)
        return unknown(f"the result of {name}()")
    run.handle(node, frame) if CREATES.fullmatch(last) else None
    handed_over(run, f"{name}()", values, node, frame)
    if receiver is None or receiver.cls is not None:
        _may_be_written(run, name, given, frame)
    return unknown(f"the result of {name}()")


def _may_be_written(run: Machine, name: str, given: Sequence[Node], frame: Frame) -> None:
    """A text that somebody unknown gets as a variable may be another one afterwards."""
    for each in given:
        target = unwrapped(each)
        if target is not None and target.type == "pointer_expression" and text(target).startswith("&"):
            target = target.child_by_field_name("argument")
        if target is None or target.type not in ("identifier", "field_expression"):
            continue
        declared = declared_type(run, target, frame)
        if declared is None or declared[0].name not in ("std::string", "string", "std::vector"):
            continue
        owner = frame.owner_of(text(target))
        if owner is not None and "const" in owner.types.get(text(target), "").split():
            continue
        before = run.evaluate(target, frame)
        if any(isinstance(atom, Text | Seq | Param) for atom in before):
            assign(run, target, join(before, unknown(f"what {name}() may have written")), frame)


__all__ = ["Group", "copied"]
