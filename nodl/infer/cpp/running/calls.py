"""Calls by name: methods of the own class, functions, static methods, what makes objects.

A call that cannot be followed is a gap when one of its possible targets makes interfaces, when it gets a node, or when
its name makes an interface in rclcpp.
"""

from __future__ import annotations

from nodl.infer.cpp.libraries import LIBRARY_CLASSES, LIBRARY_FUNCTIONS, NODE_BASES, Call
from nodl.infer.cpp.reading.declarations import Function
from nodl.infer.cpp.reading.type_names import NO_TYPE
from nodl.infer.cpp.running.algorithms import as_algorithm, writes_elements
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.callees import callee_name, is_only_declared, types_of
from nodl.infer.cpp.running.constructors import construct
from nodl.infer.cpp.running.hiding import lexical_class
from nodl.infer.cpp.running.invocation import call_functions, call_methods, call_values
from nodl.infer.cpp.running.machine import Frame, Machine, expression
from nodl.infer.cpp.running.method_calls import by_model, is_library_method, method_call, of_this, on_object
from nodl.infer.cpp.running.objects import cast, is_plain_type, made
from nodl.infer.cpp.running.references import is_plain, keep_references
from nodl.infer.cpp.running.standard import CASTS, STANDARD, may_write
from nodl.infer.cpp.running.unknown_calls import changed_by_standard, unknown_call, without_source
from nodl.infer.cpp.running.values import BOTTOM, Bound, Lambda, Obj, Value, join, unknown
from nodl.infer.cpp.running.variables import current_object, member, variable
from nodl.infer.cpp.syntax import Node, children, field_of, text, unwrapped


@expression("call_expression")
def call_expression(run: Machine, node: Node, frame: Frame) -> Value:
    """Calls a method on an object, something by its name, or else whatever the callee evaluates to."""
    callee = unwrapped(field_of(node, "function"))
    if callee is None:
        return unknown("a call")
    arguments = field_of(node, "arguments")
    if callee.type == "field_expression":
        return method_call(run, node, callee, children(arguments), frame)
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


# --- by name --------------------------------------------------------------------------------------------------


def _named_call(run: Machine, node: Node, callee: Node, given: list[Node], frame: Frame) -> Value:
    name = callee_name(callee)
    if name in CASTS:
        value = run.evaluate(given[0], frame) if given else BOTTOM
        if name in ("std::ref", "std::cref") and is_plain(value):
            later = join(value, unknown("what is written through a reference to it"))
            if name == "std::ref":
                assign(run, given[0], later, frame)
            return later
        return cast(run, types_of(run, callee, frame)[0], value) if name == "static_cast" else value
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
            methods = of_this(run, this_object, name, frame) or _hidden(run, this_object, name, frame)
            if methods:
                values = [run.evaluate(each, frame) for each in given]
                return call_methods(
                    run, methods, this_object, values, node, frame, types_of(run, callee, frame)
                )
            field = member(run, this_object, name, lexical_class(run, this_object, frame))
            if field is not None:
                values = [run.evaluate(each, frame) for each in given]
                return call_values(run, field, values, node, frame)
        if run.names.find_functions(name, frame.scope, frame.file):
            return None
        if is_library_method(this_object, name):
            return on_object(run, this_object, name, node, callee, given, frame)
        if this_object.cls is not None and is_only_declared(run, this_object.cls, name):
            values = [run.evaluate(each, frame) for each in given]
            return without_source(run, f"{this_object.cls.name}::{name}", values, node, frame, this_object)
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
        and kind.name in NODE_BASES | {this_object.foreign_base}
        and is_library_method(this_object, last)
    ):
        values = [run.evaluate(each, frame) for each in given]
        return by_model(
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
        new = construct(run, kind._replace(pointer=False), values, node, frame, heap=True)
        keep_references(run, new, given, frame)
        return new
    functions = run.names.find_functions(name, frame.scope, frame.file)
    if functions:
        values = [run.evaluate(each, frame) for each in given]
        return call_functions(run, functions, values, node, frame, types)
    qualified = as_algorithm(qualified, given)
    standard = STANDARD.get(qualified)
    if standard is not None or may_write(qualified):
        values = [run.evaluate(each, frame) for each in given]
        given_back = standard(run, values, node, frame, types) if standard is not None else BOTTOM
        if may_write(qualified) or writes_elements(run, qualified, values):
            changed_by_standard(run, qualified, given, frame)
            given_back = given_back or unknown_call(run, qualified, values, node, [], frame)
        return given_back
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
        found = _static_method(run, node, callee, name.rpartition("::")[0] or head, last, given, frame)
        if found is not None:
            return found
    values = [run.evaluate(each, frame) for each in given]
    if variable_call := _callable_value(run, name, frame):
        return call_values(run, variable_call, values, node, frame)
    if writes_elements(run, qualified, values):
        changed_by_standard(run, qualified, given, frame)
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
            bindings=run.names.specialisations.bindings(cls, kind),
        )
    if is_only_declared(run, cls, last):
        return without_source(run, f"{cls.name}::{last}", values, node, frame, None)
    return None
