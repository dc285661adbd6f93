"""Methods of containers and texts."""

from __future__ import annotations

import re

from nodl.infer.cpp.running import texts
from nodl.infer.cpp.running.algorithms import called_now
from nodl.infer.cpp.running.assignments import assign, with_entry
from nodl.infer.cpp.running.constructors import construct
from nodl.infer.cpp.running.contents import copied, handed_over, items_of
from nodl.infer.cpp.running.launch_values import settled_text
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.numbers import added
from nodl.infer.cpp.running.objects import ORDERED, SETS, as_set, made
from nodl.infer.cpp.running.operators import element
from nodl.infer.cpp.running.values import (
    BOTTOM,
    END,
    Group,
    Map,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    literal,
    open_sequence,
    plain,
    unknown,
)
from nodl.infer.cpp.running.variables import declared_type
from nodl.infer.cpp.syntax import Node, children, text


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
    "second", "fill", "pop_front", "swap", "remove_prefix", "remove_suffix", "pop", "unique", "remove",
    "sort", "reverse",
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
    called_now(run, values, node, frame)
    run.handle(node, frame)
    if isinstance(atom, Map):
        return _map_call(run, atom, name, receiver, values, node, given, frame)
    if isinstance(atom, Param) and name in _PARAMETER_VIEWS:
        return (atom,)
    is_list = isinstance(atom, Param) and any(isinstance(each, Seq) for each in atom.default)
    if isinstance(atom, Param) and is_list and name in ("size", "empty", "at", "front", "back"):
        items, exact = items_of(run, atom)
        if len(items) != 1 or not isinstance(items[0][0], Unknown):
            return _sequence_call(run, Seq(tuple(items), not exact), name, None, values, given, frame)
    if isinstance(atom, Text | Param) and not isinstance(atom, Seq):
        return _text_call(run, atom, name, receiver, values, node, frame)
    if isinstance(atom, Seq | Group):
        return _sequence_call(run, atom, name, receiver, values, given, frame)
    run.later(values, frame)
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
    kind = written[0].name if written is not None else ""
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
        cls = (
            run.names.class_of(inner, frame.scope, frame.file)
            if inner is not None and not inner.pointer
            else None
        )
        listed = [copied(run, run.evaluate(each, frame), each, frame, cls) for each in given]
        if name == "insert" and len(listed) == 3:
            return _inserted(run, atom, listed, given, receiver, frame)
        value = listed[-1] if listed else BOTTOM
        if name.startswith("emplace") and (inner is None or not inner.pointer):
            handed_over(run, f"an element that {name}() makes", listed, node, frame)
    run.handle(node, frame)
    if receiver is not None and isinstance(atom, Seq):
        ordered = kind in ORDERED or not (
            name in ("push_back", "emplace_back", "push") or _is_begin(given, receiver)
        )
        longer = (
            (value, *atom.items)
            if name.endswith("_front") or _is_begin(given, receiver)
            else (*atom.items, value)
        )
        open_now = atom.open or (ordered and not name.endswith("_front"))
        if kind in SETS and not atom.open:
            assign(run, receiver, (as_set(longer),), frame)
        else:
            assign(run, receiver, (open_sequence(longer) if open_now else Seq(longer),), frame)
    elif receiver is not None:
        assign(run, receiver, (open_sequence((value, (atom,))),), frame)
    return value


def _is_begin(given: list[Node], receiver: Node | None) -> bool:
    """``x.insert(x.begin(), ...)``."""
    start = re.sub(r"\s", "", text(given[0])) if given else ""
    return receiver is not None and start in (f"{text(receiver)}.begin()", f"{text(receiver)}.cbegin()")


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
        key, value = _new_entry(run, name, values, node, receiver, frame)
        assign(run, receiver, (_entered(atom, key, value, name == "insert_or_assign"),), frame)
    elif name == "insert" and values and receiver is not None:
        pairs = [each for each in values[0] if isinstance(each, Group | Seq) and len(each.items) == 2]
        pairs += [Group(entry) for each in values[0] if isinstance(each, Map) for entry in each.entries]
        for pair in pairs:
            atom = _entered(atom, pair.items[0], pair.items[1], False)
        assign(run, receiver, (atom if pairs else atom._replace(open=True),), frame)
    elif name == "erase" and receiver is not None:
        assign(run, receiver, (_without(atom, values[0] if values else BOTTOM),), frame)
    elif name in ("count", "contains") and values and _is_definite(atom, values[0]):
        return (not _is_missing(atom, values[0]),)
    elif name == "empty" and not atom.open:
        return (not atom.entries,)
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


def _new_entry(
    run: Machine, name: str, values: list[Value], node: Node, receiver: Node, frame: Frame
) -> tuple[Value, Value]:
    """Key and value of ``emplace(key, arguments of the value ...)``."""
    key, rest = values[0], values[1:]
    if len(rest) == 2 and all(
        isinstance(a, Group) for value in rest for a in value
    ):  # std::piecewise_construct
        key = rest[0][0].items[0] if rest[0] and rest[0][0].items else BOTTOM
        rest = list(rest[1][0].items) if rest[1] else []
    written = declared_type(run, receiver, frame)
    inner = written[0].arguments[1] if written is not None and len(written[0].arguments) > 1 else None
    cls = (
        run.names.class_of(inner, frame.scope, frame.file)
        if inner is not None and not inner.pointer
        else None
    )
    whole = len(rest) == 1 and any(isinstance(a, Obj) and a.cls is cls for a in rest[0])
    if inner is None or cls is None or whole:
        return key, rest[0] if rest else BOTTOM
    return key, construct(run, inner, rest, node, frame)


def _entered(atom: Map, key: Value, value: Value, replace: bool) -> Map:
    """A key that a map already has keeps its value, unless that is to be replaced."""
    if replace or _is_missing(atom, key):
        return with_entry(atom, key, value)
    if _is_definite(atom, key):
        return atom
    return atom._replace(entries=(*atom.entries, (key, value)), open=True)


def _without(atom: Map, key: Value) -> Map:
    if _is_definite(atom, key):
        return atom._replace(entries=tuple(entry for entry in atom.entries if entry[0] != key))
    return atom._replace(open=True)


def _is_definite(atom: Map, key: Value) -> bool:
    """Whether it is certain which entry has this key, or that none has."""
    return (
        not atom.open
        and len(key) == 1
        and plain(key[0]) is not None
        and all(len(known) == 1 and plain(known[0]) is not None for known, _ in atom.entries)
    )


def _is_missing(atom: Map, key: Value) -> bool:
    """Whether a map certainly has no such key."""
    return _is_definite(atom, key) and all(known != key for known, _ in atom.entries)


_REARRANGES = frozenset({
    "erase", "resize", "pop_back", "pop_front", "assign", "swap", "pop", "remove", "unique", "sort", "reverse",
    "splice", "merge", "remove_if", "extract",
})  # fmt: skip


def _sequence_call(
    run: Machine,
    atom: Seq | Group,
    name: str,
    receiver: Node | None,
    values: list[Value],
    given: list[Node],
    frame: Frame,
) -> Value:
    exact = isinstance(atom, Group) or not atom.open
    if name in ("at", "front", "back"):
        if exact and atom.items and name != "at":
            return atom.items[0 if name == "front" else -1]
        return element(run, atom, values[0] if values else BOTTOM)
    if name in ("end", "cend", "rend"):
        return (END,)
    if name in ("begin", "cbegin", "rbegin", "data"):
        return (atom,)
    if name == "value_or":  # an optional that holds nothing reads as an empty list
        return (values[0] if values else BOTTOM) if exact and not atom.items else (atom,)
    if name == "size":
        return (len(atom.items),) if exact else unknown("a size")
    if name == "empty":
        return (not atom.items,) if exact else unknown("a condition")
    if name == "clear" and receiver is not None:
        assign(run, receiver, (Seq(()),), frame)
    elif name == "fill" and receiver is not None and values and isinstance(atom, Seq):
        filled_with = Seq(tuple(values[0] for _ in atom.items)) if exact else open_sequence((values[0],))
        assign(run, receiver, (filled_with,), frame)
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
    elif name in ("pop_back", "pop_front") and exact and receiver is not None and isinstance(atom, Seq):
        assign(run, receiver, (Seq(atom.items[:-1] if name == "pop_back" else atom.items[1:]),), frame)
    elif (
        name == "erase"
        and exact
        and receiver is not None
        and isinstance(atom, Seq)
        and _is_begin(given, receiver)
    ):
        assign(run, receiver, (Seq(atom.items[1:]) if len(given) == 1 else open_sequence(atom.items),), frame)
    elif name == "assign" and receiver is not None and len(values) == 1:
        assign(run, receiver, values[0], frame)
    elif name == "swap" and receiver is not None and len(given) == 1 and isinstance(atom, Seq):
        before = run.evaluate(given[0], frame)
        assign(run, given[0], (atom,), frame)
        assign(run, receiver, before, frame)
    elif name == "count" and exact and values and len(values[0]) == 1 and plain(values[0][0]) is not None:
        listed = [plain(item[0]) if len(item) == 1 else None for item in atom.items]
        return unknown("a count") if None in listed else (listed.count(plain(values[0][0])),)
    elif name in _REARRANGES and receiver is not None and isinstance(atom, Seq):
        more = (
            (unknown("an element of a list"),)
            if name in ("resize", "assign", "swap", "splice", "merge")
            else ()
        )
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
    known = settled_text(run, atom)
    if name in texts.CHANGES and receiver is not None:
        after = texts.changed(known, name, values) if known is not None else None
        if after is None and name in ("append", "push_back") and len(values) == 1:
            found = added((atom,), values[0])
        else:
            found = literal(after) if after is not None else unknown(f"what {name}() makes of a text")
        assign(run, receiver, found, frame)
        return found
    found_value = texts.asked(known, name, values) if known is not None else None
    return unknown(f"the result of {name}()") if found_value is None else found_value
