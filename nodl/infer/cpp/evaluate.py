"""C++ expressions as name templates: literals, ``+``, constants, variables, parameters of the node."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from nodl.infer.cpp.source import CppClass, CppUnit, Function, text
from nodl.name_template import NameTemplate, ParameterPart, Part, UnknownPart

if TYPE_CHECKING:
    from tree_sitter import Node

MAX_ALTERNATIVES = 16
Parts = tuple[Part, ...]

_PASSES_ON = frozenset({"c_str", "str", "as_string", "get_value", "string"})
_OWN_NAMES = {"get_name": "{node}", "get_namespace": "{ns}", "get_fully_qualified_name": "~"}


@dataclass
class Scope:
    """Where an expression stands: function, class, unit; and the arguments its class is built with."""

    unit: CppUnit
    function: Function | None = None
    cls: CppClass | None = None
    defaults: dict[str, list[Parts]] = field(default_factory=dict)  # declared parameters
    arguments: dict[str, list[Parts]] = field(default_factory=dict)  # of the constructor, by parameter name
    busy: set[str] = field(default_factory=set)


def unknown(why: str) -> list[Parts]:
    return [(UnknownPart(why),)]


def evaluate(node: Node | None, scope: Scope) -> list[Parts]:
    """The texts that an expression may be."""
    if node is None:
        return unknown("a value that is not given")
    handler = _HANDLERS.get(node.type)
    found: list[Parts] = handler(node, scope) if handler else unknown(f"the C++ expression {text(node)[:60]}")
    return list(dict.fromkeys(found))[:MAX_ALTERNATIVES]


def template(parts: Parts) -> NameTemplate:
    return NameTemplate(_melted(parts))


def _melted(parts: Parts) -> Parts:
    melted: list[Part] = []
    for part in parts:
        if isinstance(part, str) and melted and isinstance(melted[-1], str):
            melted[-1] += part
        else:
            melted.append(part)
    return tuple(melted)


def _literal(node: Node, scope: Scope) -> list[Parts]:
    content = "".join(text(child) for child in node.named_children if child.type == "string_content")
    return [(content,)]


def _literals(node: Node, scope: Scope) -> list[Parts]:
    return _product([evaluate(child, scope) for child in node.named_children])


def _product(operands: list[list[Parts]]) -> list[Parts]:
    results: list[Parts] = [()]
    for alternatives in operands:
        results = [(*head, *tail) for head in results for tail in alternatives][:MAX_ALTERNATIVES]
    return [_melted(parts) for parts in results]


def _binary(node: Node, scope: Scope) -> list[Parts]:
    if text(node.child_by_field_name("operator")) != "+":
        return unknown("a computed text")
    sides = (node.child_by_field_name("left"), node.child_by_field_name("right"))
    return _product([evaluate(side, scope) for side in sides])


def _first_child(node: Node, scope: Scope) -> list[Parts]:
    return evaluate(node.named_children[0], scope) if node.named_children else [("",)]


def _conditional(node: Node, scope: Scope) -> list[Parts]:
    sides = (node.child_by_field_name("consequence"), node.child_by_field_name("alternative"))
    return [parts for side in sides for parts in evaluate(side, scope)]


def _assignment(node: Node, scope: Scope) -> list[Parts]:
    operator = text(node.child_by_field_name("operator"))
    value = evaluate(node.child_by_field_name("right"), scope)
    if operator == "=":
        return value
    return [(UnknownPart("a text that grows"), *parts) for parts in value]


def _identifier(node: Node, scope: Scope) -> list[Parts]:
    return variable(text(node), scope)


def _qualified(node: Node, scope: Scope) -> list[Parts]:
    return variable(text(node).rpartition("::")[2], scope)


def _field(node: Node, scope: Scope) -> list[Parts]:
    return variable(text(node.child_by_field_name("field")), scope)


def variable(name: str, scope: Scope) -> list[Parts]:
    """Every value that a variable of that name in reach is given."""
    if name in scope.busy:
        return []
    scope.busy.add(name)
    try:
        for values in _places(name, scope):
            found = [parts for value in values for parts in evaluate(value, scope)]
            if found:
                return found
        if name in scope.arguments:
            return scope.arguments[name]
        return unknown(f"the value of {name}")
    finally:
        scope.busy.discard(name)


def _places(name: str, scope: Scope) -> list[list[Node]]:
    """The function's own values; then all of the class; then constants."""
    if scope.function is not None and name in scope.function.values:
        own = scope.function.values[name]
        if name not in (scope.cls.values if scope.cls else ()):
            return [own]
    places: list[list[Node]] = []
    if scope.cls is not None:
        members = list(scope.cls.values.get(name, ()))
        for function in scope.cls.functions:
            members += function.values.get(name, ())
            if name in function.initialisers:
                members.append(function.initialisers[name])
        if members and not (scope.function and name in scope.function.parameters):
            places.append(members)
    if name in scope.unit.constants:
        places.append(scope.unit.constants[name])
    return places


def called_name(node: Node) -> str:
    """``create_publisher`` of ``this->create_publisher<T>(...)`` and kin."""
    function = node.child_by_field_name("function")
    while function is not None and function.type in ("field_expression", "qualified_identifier"):
        function = function.child_by_field_name("field") or function.child_by_field_name("name")
    if function is not None and function.type in ("template_function", "template_method"):
        function = function.child_by_field_name("name")
    return text(function)


def receiver_of(node: Node) -> str:
    function = node.child_by_field_name("function")
    if function is not None and function.type == "field_expression":
        return text(function.child_by_field_name("argument"))
    return ""


def arguments_of(node: Node) -> list[Node]:
    arguments = node.child_by_field_name("arguments")
    return [child for child in arguments.named_children if child.type != "comment"] if arguments else []


def _call(node: Node, scope: Scope) -> list[Parts]:
    name = called_name(node)
    arguments = arguments_of(node)
    if name in ("get_parameter", "declare_parameter", "get_parameter_or") and arguments:
        return parameter(arguments[0], scope)
    if name in _OWN_NAMES:
        return [(_OWN_NAMES[name],)]
    if name in _PASSES_ON:
        function = node.child_by_field_name("function")
        inner = function.child_by_field_name("argument") if function is not None else None
        return evaluate(inner or (arguments[0] if arguments else None), scope)
    return unknown(f"the result of {name or 'a call'}()")


def parameter(name_node: Node, scope: Scope) -> list[Parts]:
    found: list[Parts] = []
    for parts in evaluate(name_node, scope):
        if len(parts) != 1 or not isinstance(parts[0], str):
            found += unknown("a parameter whose name is not known")
            continue
        for default in scope.defaults.get(parts[0]) or [()]:
            literal = "".join(str(part) for part in default) if _is_text(default) else None
            found.append((ParameterPart(parts[0], literal),))
    return found


def _is_text(parts: Parts) -> bool:
    return bool(parts) and all(isinstance(part, str) for part in parts)


_HANDLERS: dict[str, Callable[[Node, Scope], list[Parts]]] = {
    "string_literal": _literal,
    "raw_string_literal": lambda node, scope: [(text(node).partition("(")[2].rpartition(")")[0],)],
    "concatenated_string": _literals,
    "binary_expression": _binary,
    "parenthesized_expression": _first_child,
    "initializer_list": _first_child,
    "argument_list": _first_child,
    "conditional_expression": _conditional,
    "assignment_expression": _assignment,
    "identifier": _identifier,
    "field_identifier": _identifier,
    "qualified_identifier": _qualified,
    "field_expression": _field,
    "call_expression": _call,
}
