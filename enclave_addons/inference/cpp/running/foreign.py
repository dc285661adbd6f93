"""What leaves the program, by its text: objects of classes that are not known, nodes given to unknown code. Pure."""

from __future__ import annotations

import re
from typing import NamedTuple

from enclave_addons.inference.cpp.libraries import (
    LIBRARY_CLASSES,
    LIBRARY_FUNCTIONS,
    is_harmless_class,
    is_harmless_function,
)
from enclave_addons.inference.cpp.reading.declarations import Class, FileIndex, Function, Scope
from enclave_addons.inference.cpp.reading.known_headers import KNOWN_HEADERS, ROS_LIBRARIES
from enclave_addons.inference.cpp.reading.names import Names
from enclave_addons.inference.cpp.syntax import (
    Node,
    callee_name,
    children,
    field_of,
    last_name,
    template_arguments,
    text,
    unwrapped,
    walk,
)

_NODE = re.compile(r"(?:\w+_)?(?:[Nn]ode|nh|parent)(?:_?[Pp]tr|_handle)?_?")
"""Usual names of variables that hold a node."""
_NODES = ("Node", "LifecycleNode")
_GIVES_NODE = re.compile(r"(?:shared|weak)_from_this|get_node\w*|getNode\w*")
_HANDS_ON = re.compile(r"lock|get|move|forward|c?ref|(?:static|dynamic)_pointer_cast")
_KNOWN = re.compile(rf"(?:add|remove|get|spin)_\w+|spin|{_HANDS_ON.pattern}")
"""Functions of rclcpp and of the standard library that take a node and make nothing of it."""
_MAKES = re.compile(r"(?:make|allocate)_(?:shared|unique)|make_intrusive")


def unmodelled(names: Names, name: str, scope: Scope, file: FileIndex, deliberate: bool) -> str:
    """Return why an object of a class that is neither in reach nor in the table may be a node or make one.

    Args:
        deliberate: It is made with arguments or with ``new``, as structures of C are not.

    Returns:
        The empty text if the class is known to make none.
    """
    first = name.partition("::")[0]
    if first in KNOWN_HEADERS and not (deliberate and first in ROS_LIBRARIES):
        return ""
    if first in ROS_LIBRARIES:
        return f"the class {name} is not in the table of {first}: it may be a node or make one"
    header = names.foreign_header(name, file)
    if not header and deliberate and "::" not in name:
        header = names.unreviewed(scope, file)
    return f"the class {name} is not in reach ({header}): it may be a node or make one" if header else ""


class Leaving(NamedTuple):
    """How code leaves the program: it gives a node to unknown code, makes an object of an unknown class, or a node."""

    gives_node: bool = False
    makes_unknown: bool = False
    makes_node: bool = False


def leaving(names: Names, function: Function, part: Node | None = None) -> Leaving:
    """Return how a function, or a part of it, leaves the program."""
    is_node = _may_be_node(names, function)
    around = names.classes.get(function.owner.rpartition("::")[2], ())
    templates = {*function.templates, *(each for cls in around for each in cls.templates)}
    gives_node = makes_unknown = makes_node = False
    for each in walk(part if part is not None else function.node):
        written, given = _made(each)
        if written and written not in templates:
            outside, unknown = _class_of(names, written, function, given is not None)
            makes_unknown = makes_unknown or unknown
            makes_node = makes_node or (written.rpartition("::")[2] in _NODES and given is not None)
            gives_node = gives_node or (outside and any(map(_is_variable, children(given))))
        elif each.type == "call_expression" and not written:
            gives_node = gives_node or (_is_unknown_call(names, each) and _node_among(given, is_node))
    return Leaving(gives_node, makes_unknown, makes_node)


def _made(node: Node) -> tuple[str, Node | None]:
    """Return the class that an expression or declaration makes an object of, as written, and the arguments."""
    if node.type == "call_expression":
        callee, given = field_of(node, "function"), field_of(node, "arguments")
        made = template_arguments(callee)[:1] if _MAKES.fullmatch(last_name(callee)) else []
        return text(made[0]) if made else "", given
    if node.type == "new_expression":
        return text(field_of(node, "type")), field_of(node, "arguments")
    if node.type == "declaration" and any(
        each.type == "identifier" for each in node.children_by_field_name("declarator")
    ):
        return _type_of(node), None
    given = field_of(node, "value") if node.type == "init_declarator" else None
    if given is not None and node.parent is not None and given.type in ("argument_list", "initializer_list"):
        return _type_of(node.parent), given
    return "", None


def _type_of(declaration: Node) -> str:
    """Return the type that a declaration names; behind ``#endif`` the parser takes ``else`` for one."""
    written = text(field_of(declaration, "type"))
    return "" if written == "else" else written


def _class_of(names: Names, written: str, function: Function, deliberate: bool) -> tuple[bool, bool]:
    """Return whether a class of a library may make interfaces on a node it gets, and whether it is not known at all."""
    kind = names.resolve(written, function.scope, function.file)
    if (
        not kind.name
        or kind.name == "auto"
        or names.find_class(kind.name, function.scope, function.file) is not None
    ):
        return False, False
    if kind.name in LIBRARY_CLASSES:
        return True, False
    if is_harmless_class(kind.name):
        return False, False
    return True, bool(unmodelled(names, kind.name, function.scope, function.file, deliberate))


def _is_unknown_call(names: Names, call: Node) -> bool:
    callee = field_of(call, "function")
    name, last = callee_name(callee) if callee is not None else "", last_name(callee)
    if last in names.functions_by_name or _KNOWN.fullmatch(last):
        return False
    return name in LIBRARY_FUNCTIONS or not is_harmless_function(name)


def _may_be_node(names: Names, function: Function) -> bool:
    """Return whether objects of the function's class may be nodes: a base of it is not in reach."""
    waiting = list(names.classes.get(function.owner.rpartition("::")[2], ()))
    seen: set[Class] = set()
    while waiting:
        cls = waiting.pop()
        if cls in seen:
            continue
        seen.add(cls)
        for written in cls.bases:
            # Not ``Names.bases``: to look is not to use, and a template that is used is doubted.
            base = names.find_class(names.resolve(written, cls.scope, cls.file).name, cls.scope, cls.file)
            if base is None:
                return True
            waiting.append(base)
    return False


def _is_variable(argument: Node) -> bool:
    """Return whether an argument may be a node, whatever it is called."""
    return not argument.type.endswith(("literal", "string", "lambda_expression"))


def _node_among(arguments: Node | None, is_node: bool) -> bool:
    """Return whether one of the arguments may be a node, by what it is called; ``is_node``: ``this`` is."""
    return any(_is_node(each, is_node) for each in children(arguments))


def _is_node(argument: Node, is_node: bool) -> bool:
    inner = unwrapped(argument)
    while inner is not None and inner.type == "pointer_expression":
        inner = unwrapped(field_of(inner, "argument"))
    if inner is None:
        return False
    if inner.type == "this":
        return is_node
    if inner.type == "call_expression":
        callee = field_of(inner, "function")
        last = last_name(callee)
        if _GIVES_NODE.fullmatch(last):
            return True
        receiver = field_of(callee, "argument")
        held = [*children(field_of(inner, "arguments")), *([receiver] if receiver is not None else [])]
        return _HANDS_ON.fullmatch(last) is not None and any(_is_node(each, is_node) for each in held)
    name = field_of(inner, "field") if inner.type == "field_expression" else inner
    return name is not None and _NODE.fullmatch(text(name)) is not None
