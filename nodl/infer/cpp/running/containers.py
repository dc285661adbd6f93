"""Methods of containers and texts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodl.infer.cpp.running.assignments import assign, with_entry
from nodl.infer.cpp.running.constructors import construct
from nodl.infer.cpp.running.contents import copied, handed_over, items_of
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.objects import made
from nodl.infer.cpp.running.operators import element
from nodl.infer.cpp.running.values import (
    BOTTOM,
    END,
    NPOS,
    Group,
    Map,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    concatenated,
    literal,
    open_sequence,
    plain,
    unknown,
)
from nodl.infer.cpp.running.variables import declared_type
from nodl.infer.cpp.syntax import children

if TYPE_CHECKING:
    from tree_sitter import Node


def is_standard(name: str) -> bool:
    """Methods of containers, texts and pointers, which every other class may also have."""
    return name in CONTAINER_METHODS or name in _COMMON


_COMMON = frozenset({
    "get", "reset", "push", "pop", "open", "close", "read", "write", "what", "count", "wait", "notify_one",
    "notify_all",
    "join", "detach", "load", "store", "exchange", "lock", "unlock", "try_lock", "seconds", "nanoseconds", "sec",
})  # fmt: skip

CONTAINER_METHODS = frozenset({
    "push_back", "emplace_back", "emplace", "insert", "insert_or_assign", "try_emplace", "at", "front", "back",
    "begin", "end", "find",
    "size", "empty", "clear", "c_str", "str", "data", "append", "substr", "length", "erase", "push_front",
    "emplace_front",
    "resize", "reserve", "pop_back", "rbegin", "cbegin", "cend", "rfind", "compare", "string", "count",
    "assign", "value_or",
    "has_value", "starts_with", "ends_with", "replace", "contains", "find_first_of", "find_last_of", "first",
    "second", "fill",
})  # fmt: skip


def container_call(
    run: Machine, atom: object, name: str, node: Node, receiver: Node | None, given: list[Node], frame: Frame
) -> Value:
    """A method of a text or container."""
    if name in (
        "emplace_back",
        "push_back",
        "push_front",
        "emplace_front",
        "insert",
        "push",
        "emplace",
    ) and isinstance(atom, Seq | Unknown):
        return _added(run, atom, name, node, receiver, given, frame)
    values = [run.evaluate(each, frame) for each in given]
    run.handle(node, frame)
    if isinstance(atom, Map):
        return _map_call(run, atom, name, receiver, values, node, given, frame)
    if isinstance(atom, Param) and name in _PARAMETER_VIEWS:
        return (atom,)
    is_list = isinstance(atom, Param) and any(isinstance(each, Seq) for each in atom.default)
    if isinstance(atom, Param) and is_list and name in ("size", "empty", "at", "front", "back"):
        items, exact = items_of(run, atom)
        if len(items) != 1 or not isinstance(items[0][0], Unknown):
            return _sequence_call(run, Seq(tuple(items), not exact), name, None, values, frame)
    if isinstance(atom, Text | Param) and not isinstance(atom, Seq):
        return _text_call(run, atom, name, receiver, values, node, frame)
    if isinstance(atom, Seq | Group):
        return _sequence_call(run, atom, name, receiver, values, frame)
    for value in values:
        for each in value:
            run.later(each, frame)
    return unknown(f"the result of {name}()")


_PARAMETER_VIEWS = frozenset({
    "as_string", "as_int", "as_bool", "as_double", "as_string_array", "get_value", "get", "value_to_string",
    "get_parameter_value",
    "as_integer_array", "as_double_array", "as_bool_array", "as_byte_array", "to_value_msg", "value", "c_str",
    "str", "begin",
})  # fmt: skip


def _added(
    run: Machine, atom: object, name: str, node: Node, receiver: Node | None, given: list[Node], frame: Frame
) -> Value:

    written = declared_type(run, receiver, frame) if receiver is not None else None
    inner = written[0].arguments[0] if written is not None and written[0].arguments else None
    if (
        name.startswith("emplace")
        and inner is not None
        and not inner.pointer
        and run.names.class_of(inner, frame.scope, frame.file)
    ):
        value = construct(run, inner, [run.evaluate(each, frame) for each in given], node, frame)
    elif given and given[-1].type == "initializer_list" and inner is not None and inner.name:
        value = made(run, given[-1], inner, children(given[-1]), frame)
    else:
        listed = [copied(run, run.evaluate(each, frame), each, frame) for each in given]
        if name == "insert" and len(listed) == 3:
            return _inserted(run, atom, listed, given, receiver, frame)
        value = listed[-1] if listed else BOTTOM
        if name.startswith("emplace") and (inner is None or not inner.pointer):
            handed_over(run, f"an element that {name}() makes", listed, node, frame)
    run.handle(node, frame)
    if receiver is not None and isinstance(atom, Seq):
        longer = (*atom.items, value)
        assign(run, receiver, (open_sequence(longer) if atom.open else Seq(longer),), frame)
    elif receiver is not None:
        assign(run, receiver, (open_sequence((value, (atom,))),), frame)
    return value


def _inserted(
    run: Machine, atom: object, listed: list[Value], given: list[Node], receiver: Node | None, frame: Frame
) -> Value:
    """``a.insert(a.end(), b.begin(), b.end())``."""
    source = listed[1]
    items = [item for each in source for item in items_of(run, each)[0]]
    before = atom.items if isinstance(atom, Seq) else ((atom,),)
    exact = isinstance(atom, Seq) and all(items_of(run, each)[1] for each in source)
    if receiver is not None:
        longer = (*before, *items)
        assign(run, receiver, (Seq(longer) if exact else open_sequence(longer),), frame)
    return BOTTOM


def _map_call(
    run: Machine,
    atom: Map,
    name: str,
    receiver: Node | None,
    values: list[Value],
    node: Node,
    given: list[Node],
    frame: Frame,
) -> Value:
    if name in ("emplace", "insert_or_assign", "try_emplace") and len(values) >= 2 and receiver is not None:
        assign(run, receiver, (with_entry(atom, values[0], values[1]),), frame)
    elif name == "insert" and values and receiver is not None:
        pairs = [each for each in values[0] if isinstance(each, Group | Seq) and len(each.items) == 2]
        for pair in pairs:
            atom = with_entry(atom, pair.items[0], pair.items[1])
        assign(run, receiver, (atom if pairs else atom._replace(open=True),), frame)
    elif name == "clear" and receiver is not None:
        assign(run, receiver, (Map(()),), frame)
    elif name == "at" and values:
        return element(run, atom, values[0])
    elif name == "find" and values:
        missing = not atom.open and _is_missing(atom, values[0])
        return (END,) if missing else (Group((values[0], element(run, atom, values[0]))),)
    elif name in ("end", "cend"):
        return (END,)
    elif name in ("begin", "cbegin"):
        return (atom,)
    elif name == "size" and not atom.open:
        return (len(atom.entries),)
    return unknown(f"the result of {name}()")


def _is_missing(atom: Map, key: Value) -> bool:
    """Whether a map certainly has no such key."""
    if len(key) != 1 or plain(key[0]) is None:
        return False
    return all(len(known) == 1 and plain(known[0]) is not None and known != key for known, _ in atom.entries)


def _sequence_call(
    run: Machine, atom: Seq | Group, name: str, receiver: Node | None, values: list[Value], frame: Frame
) -> Value:
    exact = isinstance(atom, Group) or not atom.open
    if name in ("at", "front", "back"):
        if exact and atom.items and name != "at":
            return atom.items[0 if name == "front" else -1]
        return element(run, atom, values[0] if values else BOTTOM)
    if name in ("end", "cend", "rend"):
        return (END,)
    if name in ("begin", "cbegin", "rbegin", "data", "value_or"):
        return (atom,)
    if name == "size":
        return (len(atom.items),) if exact else unknown("a size")
    if name == "empty":
        return (not atom.items,) if exact else unknown("a condition")
    if name == "clear" and receiver is not None:
        assign(run, receiver, (Seq(()),), frame)
    elif (
        name == "resize"
        and exact
        and receiver is not None
        and values
        and len(values[0]) == 1
        and isinstance(values[0][0], int)
    ):
        count = min(values[0][0], 256)
        filled = [*atom.items[:count], *([unknown("an element that is not set")] * (count - len(atom.items)))]
        assign(run, receiver, (Seq(tuple(filled)),), frame)
    elif (
        name in ("erase", "resize", "pop_back", "assign", "swap", "pop", "remove")
        and receiver is not None
        and isinstance(atom, Seq)
    ):
        more = (unknown("an element of a list"),) if name in ("resize", "assign") else ()
        assign(run, receiver, (open_sequence((*atom.items, *more)),), frame)
    return unknown(f"the result of {name}()")


def _text_call(
    run: Machine,
    atom: Text | Param,
    name: str,
    receiver: Node | None,
    values: list[Value],
    node: Node,
    frame: Frame,
) -> Value:
    if name in (
        "c_str",
        "str",
        "string",
        "data",
        "value",
        "get",
        "as_string",
        "view",
        "get_value",
        "value_or",
        "generic_string",
        "begin",
        "end",
    ):
        if name == "str" and values and receiver is not None:
            assign(run, receiver, values[0], frame)
        return (atom,)
    if name in ("append", "push_back", "operator+=") and values:
        found = concatenated((atom,), values[0])
        if receiver is not None:
            assign(run, receiver, found, frame)
        return found
    if name == "clear" and receiver is not None:
        assign(run, receiver, literal(""), frame)
        return BOTTOM
    return _computed_text(run, atom, name, receiver, values, frame)


def _computed_text(
    run: Machine, atom: Text | Param, name: str, receiver: Node | None, values: list[Value], frame: Frame
) -> Value:
    known = run.settled_text(atom)
    numbers = [value[0] for value in values if len(value) == 1 and isinstance(value[0], int)]
    texts = [plain(value[0]) for value in values if len(value) == 1]
    if known is None:
        if name in ("erase", "replace", "insert", "pop_back", "assign") and receiver is not None:
            assign(run, receiver, unknown(f"what {name}() makes of a text"), frame)
        return unknown(f"the result of {name}()")
    if name == "empty":
        return (not known,)
    if name in ("find", "rfind") and texts and texts[0] is not None:
        found = known.find(texts[0]) if name == "find" else known.rfind(texts[0])
        return (found,) if found >= 0 else (NPOS,)
    if name in ("size", "length"):
        return (len(known),)
    if name in ("front", "back") and known:
        return literal(known[0 if name == "front" else -1])
    if name == "at" and numbers and 0 <= numbers[0] < len(known):
        return literal(known[numbers[0]])
    if name == "substr" and len(numbers) == len(values):
        start = numbers[0] if numbers else 0
        return literal(known[start : start + numbers[1]] if len(numbers) > 1 else known[start:])
    if name in ("starts_with", "ends_with") and texts and texts[0] is not None:
        return (known.startswith(texts[0]) if name == "starts_with" else known.endswith(texts[0]),)
    if name in ("erase", "replace", "insert", "pop_back", "assign", "resize") and receiver is not None:
        assign(run, receiver, unknown(f"what {name}() makes of a text"), frame)
    return unknown(f"the result of {name}()")
