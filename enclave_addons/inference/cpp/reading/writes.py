"""Which variables a piece of code may change, by their names: more than it changes, never fewer. Pure."""

from __future__ import annotations

import re
from typing import NamedTuple, TypeAlias

from enclave_addons.inference.cpp.syntax import (
    Node,
    callee_name,
    children,
    field_of,
    last_name,
    text,
    unwrapped,
    walk,
)

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


Passed: TypeAlias = tuple[str, int, int, frozenset[str]]
MemberOf: TypeAlias = tuple[str, str, frozenset[str]]


class VariableWrites(NamedTuple):
    """What a piece of code does to variables, by their names.

    Attributes:
        assigned: What is replaced: an object as well as a text or number.
        changed: What is changed in place: texts, numbers and containers; an object stays who it is.
        seen: Objects whose methods are called, and what aliases stand for.
        passed: Arguments: the function, how many it gets, the argument's position and the variables in it.
        lasting: What closures in it write, whenever they run.
        of_others: Members of other objects in it: with the name of the variable that holds the object, empty for
            anything but a variable, and the types of local variables of that name.
    """

    assigned: frozenset[str]
    changed: frozenset[str]
    seen: frozenset[str] = frozenset()
    passed: tuple[Passed, ...] = ()
    lasting: frozenset[str] = frozenset()
    of_others: frozenset[MemberOf] = frozenset()


_REPLACES = frozenset({"reset", "swap", "emplace", "assign", "store", "exchange", "release", "tie"})
FILLS = frozenset({
    "push_back", "emplace_back", "push_front", "emplace_front", "insert", "insert_or_assign", "emplace", "try_emplace",
    "erase", "clear", "resize", "append", "pop_back", "pop_front", "pop", "push", "assign", "fill", "sort", "merge",
    "splice", "remove", "remove_if", "unique", "reverse", "replace", "swap", "reset", "store", "exchange", "fetch_add",
    "fetch_sub", "fetch_and", "fetch_or", "fetch_xor", "compare_exchange_strong", "compare_exchange_weak",
})  # fmt: skip
"""Methods that change what their text, container or ``std::atomic`` holds."""
_READS_ARGUMENTS = re.compile(r"RCLCPP_\w+|lookupTransform|canTransform|publish|get_logger")


def written_by(node: Node) -> VariableWrites:
    """Return what the code below ``node`` does to variables itself."""
    assigned: set[str] = set()
    changed: set[str] = set()
    seen: set[str] = set()
    lasting: set[str] = set()
    others: set[tuple[str, str]] = set()
    types: dict[str, set[str]] = {}  # of local variables
    moved: set[str] = set()  # numbers and iterators
    passed: list[Passed] = []
    aliases: list[
        tuple[set[str], set[str], bool]
    ] = []  # with the variables behind; whether they are iterators
    for each in walk(node):
        words = _words_of(each)
        for name in declared_in(each):
            types.setdefault(name, set()).add(text(field_of(each, "type")))
        if each.type == "assignment_expression":
            left = unwrapped(field_of(each, "left"))
            changed |= words
            if left is not None and left.type == "field_expression":
                assigned |= _in(field_of(left, "field"))
            elif left is not None and left.type != "subscript_expression":
                assigned |= words
        elif each.type == "call_expression":
            callee = field_of(each, "function")
            last = last_name(callee)
            receivers = _receivers(callee)
            seen |= receivers
            changed |= receivers if last in FILLS else set()
            assigned |= words if last in _REPLACES else set()
            if not _READS_ARGUMENTS.fullmatch(last):
                passed += _passed(last, field_of(each, "arguments"))
            for argument in children(field_of(each, "arguments")):
                changed |= _iterated(argument)
        elif each.type in ("for_range_loop", "declaration") and _is_alias(each):
            seen |= words
            aliases.append((_in(field_of(each, "declarator")), words, False))
        elif each.type == "field_expression":
            others |= _members_of_other(each)
        elif each.type == "update_expression" and words == {text(field_of(each, "argument"))}:
            moved |= words
        else:
            changed |= words
            if each.type == "init_declarator":
                aliases.append((_in(field_of(each, "declarator")), _iterated(field_of(each, "value")), True))
            lasting |= (
                writes_of(each) if each.type == "lambda_expression" and not _runs_at_once(each) else set()
            )
    # From the last on: an alias may stand for one that was declared before.
    for names, behind, is_iterator in reversed(aliases):
        assigned |= behind if names & assigned else set()
        changed |= behind if names & (changed if is_iterator else changed | moved) else set()
        passed += [(name, given, at, frozenset(behind)) for name, given, at, words in passed if names & words]
    return VariableWrites(
        frozenset(assigned),
        frozenset(changed | moved),
        frozenset(seen),
        tuple(passed),
        frozenset(lasting),
        frozenset((name, held, frozenset(types.get(held, ()))) for name, held in others),
    )


_DECLARATIONS = ("declaration", "for_range_loop", "parameter_declaration", "optional_parameter_declaration")


def declared_in(node: Node) -> set[str]:
    """Return the names that a declaration, a parameter or a capture gives to variables."""
    if node.type == "lambda_capture_initializer":
        return _in(node.named_children[0])
    found: set[str] = set()
    for declarator in node.children_by_field_name("declarator") if node.type in _DECLARATIONS else ():
        inner = declarator
        while inner.type in ("init_declarator", "reference_declarator", "pointer_declarator"):
            inner = field_of(inner, "declarator") or inner.named_children[-1]
        found |= _in(inner)
    return found


def _members_of_other(node: Node) -> set[tuple[str, str]]:
    """Return ``m`` and ``x`` of ``x.m``."""
    held = text(field_of(node, "argument")).removeprefix("this->")
    names = _in(field_of(node, "field")) if held != "this" else set()
    return {(name, held if _WORD.fullmatch(held) else "") for name in names}


_ALGORITHM = re.compile(
    r"std::(?:ranges::)?(?:for_each(?:_n)?|transform|(?:stable_|partial_)?sort|(?:find|count|remove|replace|copy)_if|"
    r"(?:any|all|none)_of|accumulate|generate(?:_n)?|(?:stable_)?partition|(?:min|max|minmax)_element|"
    r"(?:lower|upper)_bound|unique|visit|invoke|apply)"
)


def _runs_at_once(closure: Node) -> bool:
    """Return whether a closure is an argument of an algorithm of the standard library, which keeps none."""
    call = closure.parent.parent if closure.parent is not None else None
    callee = field_of(call, "function") if call is not None and call.type == "call_expression" else None
    return callee is not None and _ALGORITHM.fullmatch(callee_name(callee)) is not None


def _iterated(value: Node | None) -> set[str]:
    """Return the variables that an iterator or pointer into a container leads to: ``x.begin()``."""
    callee = field_of(value, "function") if value is not None and value.type == "call_expression" else None
    if callee is None or callee.type != "field_expression":
        return set()
    return (
        _in(field_of(callee, "argument")) if _LEADS_INTO.fullmatch(text(field_of(callee, "field"))) else set()
    )


_LEADS_INTO = re.compile(
    r"r?(?:begin|end)|data|find\w*|(?:lower|upper)_bound|front|back|at|top|get|value|emplace\w*|insert\w*"
)


def _receivers(callee: Node | None) -> set[str]:
    if callee is None or callee.type != "field_expression" or text(field_of(callee, "field")) in _READING:
        return set()
    return _in(field_of(callee, "argument"))


def _passed(callee: str, arguments: Node | None) -> list[Passed]:
    given = children(arguments)
    return [
        (callee, len(given), index, frozenset(_in(each)))
        for index, each in enumerate(given)
        if each.type in _VARIABLES
    ]


_VARIABLES = ("identifier", "field_expression", "pointer_expression", "subscript_expression")


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
        if each.type in _VARIABLES:
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
