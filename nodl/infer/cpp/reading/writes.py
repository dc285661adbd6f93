"""Which variables a piece of code may change, by their names: more than it changes, never fewer. Pure."""

from __future__ import annotations

import re

from nodl.infer.cpp.syntax import Node, field_of, text, walk

_WORD = re.compile(r"[A-Za-z_]\w*")
_READING = frozenset({
    "begin", "end", "cbegin", "cend", "rbegin", "rend", "size", "empty", "find", "count", "c_str", "length", "substr",
    "compare", "has_value", "value_or", "starts_with", "ends_with", "contains", "publish", "lock", "unlock", "now",
    "seconds", "nanoseconds", "get_logger", "get_clock", "get_name", "get_namespace", "str", "what", "rfind",
    "get_subscription_count", "is_activated", "is_active", "canTransform", "lookupTransform", "transform",
})  # fmt: skip
"""Methods that leave their object as it is."""


def writes_of(node: Node) -> frozenset[str]:
    """Return what the code below ``node`` may change itself, aliases included.

    That is assigned, counted up, read from a stream, given to a call or changed by a method of theirs.
    """
    return frozenset(word for each in walk(node) for word in _words_of(each))


def _words_of(node: Node) -> set[str]:
    """Return the variables that ``node`` itself may change."""
    if node.type == "assignment_expression":
        return _in(field_of(node, "left"))
    if node.type == "update_expression":
        return _in(field_of(node, "argument"))
    if node.type == "binary_expression" and text(field_of(node, "operator")) == ">>":
        return _in(field_of(node, "right"))
    if node.type == "call_expression":
        return _called(node)
    if node.type in ("for_range_loop", "declaration") and _is_alias(node):
        return _in(field_of(node, "right")) or _in(field_of(node, "declarator"))
    return set()


def _called(node: Node) -> set[str]:
    callee = field_of(node, "function")
    arguments = field_of(node, "arguments")
    given = arguments.named_children if arguments is not None else []
    found: set[str] = set()
    for each in given:  # an argument may be a reference
        if each.type in ("identifier", "field_expression", "pointer_expression", "subscript_expression"):
            found |= _in(each)
    if callee is not None and callee.type == "field_expression":
        name = text(field_of(callee, "field"))
        if name not in _READING:
            found |= _in(field_of(callee, "argument"))
    return found


def _is_alias(node: Node) -> bool:
    """Return whether it is a reference or pointer that is not to a constant."""
    return "const" not in text(field_of(node, "type")) and any(
        each.type in ("reference_declarator", "pointer_declarator")
        or (each.type == "init_declarator" and text(each)[:1] in "&*")
        for each in node.named_children
    )


def _in(node: Node | None) -> set[str]:
    return set(_WORD.findall(text(node)))
