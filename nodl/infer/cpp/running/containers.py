"""Methods of containers and texts."""

from __future__ import annotations

import re

from nodl.infer.cpp.running.arithmetic import CHANGES_TEXT, added, asked_of_text, changed_text
from nodl.infer.cpp.running.assignments import assign, with_entry
from nodl.infer.cpp.running.constructors import ORDERED, SETS, as_set, construct, made
from nodl.infer.cpp.running.contents import copied, handed_over, items_of
from nodl.infer.cpp.running.invocation import CallSite
from nodl.infer.cpp.running.launch_values import settled_text
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.operators import element
from nodl.infer.cpp.running.standard import called_now
from nodl.infer.cpp.running.static_types import declared_type
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
from nodl.infer.cpp.syntax import children, text


def is_standard(name: str) -> bool:
    """Return whether it is a method of containers, texts and pointers, which every other class may also have."""
    return name in CONTAINER_METHODS or name in _COMMON


_COMMON = frozenset({
    "get", "reset", "push", "pop", "open", "close", "read", "write", "what", "count", "wait", "notify_one",
    "notify_all",
    "join", "detach", "load", "store", "exchange", "lock", "unlock", "try_lock", "seconds", "nanoseconds", "sec",
})  # fmt: skip

CONTAINER_METHODS = frozenset({
    "push_back", "emplace_back", "emplace", "insert", "insert_or_assign", "try_emplace", "at", "front", "back", "begin",
    "end", "find", "size", "empty", "clear", "c_str", "str", "data", "append", "substr", "length", "erase",
    "push_front", "emplace_front", "resize", "reserve", "pop_back", "rbegin", "cbegin", "cend", "rfind", "compare",
    "string", "count", "assign", "value_or", "has_value", "starts_with", "ends_with", "replace", "contains",
    "find_first_of", "find_last_of", "first", "second", "fill", "pop_front", "swap", "remove_prefix", "remove_suffix",
    "pop", "unique", "remove", "sort", "reverse",
})  # fmt: skip


def container_call(run: Machine, atom: object, name: str, site: CallSite) -> Value:
    """Call a method of a text or container."""
    if name in _ADDING and isinstance(atom, Seq | Unknown):
        return _added(run, atom, name, site)
    values = site.values
    called_now(run, values, site.node, site.frame)
    run.handle(site.node, site.frame)
    if isinstance(atom, Map):
        return _map_call(run, atom, name, site)
    if isinstance(atom, Param) and name in _PARAMETER_VIEWS:
        return (atom,)
    is_list = isinstance(atom, Param) and any(isinstance(each, Seq) for each in atom.default)
    if is_list and name in ("size", "empty", "at", "front", "back"):
        items, exact = items_of(run, atom)
        if len(items) != 1 or not isinstance(items[0][0], Unknown):
            return _sequence_call(run, Seq(tuple(items), not exact), name, site)
    if isinstance(atom, Text | Param):
        return _text_call(run, atom, name, site)
    if isinstance(atom, Seq | Group):
        return _sequence_call(run, atom, name, site)
    run.later(values, site.frame)
    return unknown(f"the result of {name}()")


_ADDING = frozenset({"emplace_back", "push_back", "push_front", "emplace_front", "insert", "push", "emplace"})
_PARAMETER_VIEWS = frozenset({
    "as_string", "as_int", "as_bool", "as_double", "as_string_array", "get_value", "get", "value_to_string",
    "get_parameter_value", "as_integer_array", "as_double_array", "as_bool_array", "as_byte_array", "to_value_msg",
    "value", "c_str", "str", "begin",
})  # fmt: skip


def _added(run: Machine, atom: object, name: str, site: CallSite) -> Value:
    given, frame, receiver = site.given, site.frame, site.receiver
    kind, _ = declared_type(run, receiver, frame)
    inner = kind.arguments[0] if kind.arguments else None
    cls = run.held_class(inner, frame)
    if name.startswith("emplace") and inner is not None and cls is not None:
        value = construct(run, inner, site.values, site.node, frame)
    elif given and given[-1].type == "initializer_list" and inner is not None and inner.name:
        value = made(run, given[-1], inner, children(given[-1]), frame)
    else:
        listed = [run.evaluate(each, frame) for each in given]
        if inner is None or not inner.pointer:
            listed = [copied(run, v, each, frame, cls) for v, each in zip(listed, given, strict=True)]
        if name == "insert" and len(listed) == 3:
            return _inserted(run, atom, listed[1], site)
        value = listed[-1] if listed else BOTTOM
        if name.startswith("emplace") and (inner is None or not inner.pointer):
            handed_over(run, f"an element that {name}() makes", listed, site.node, frame)
    run.handle(site.node, frame)
    if not isinstance(atom, Seq):
        assign(run, receiver, (open_sequence((value, (atom,))),), frame)
        return value
    in_front = name.endswith("_front") or _is_begin(site)
    ordered = kind.name in ORDERED or (name in ("insert", "emplace") and not in_front)
    longer = (value, *atom.items) if in_front else (*atom.items, value)
    if kind.name in SETS and not atom.open:
        assign(run, receiver, (as_set(longer),), frame)
    else:
        is_open = atom.open or (ordered and not name.endswith("_front"))
        assign(run, receiver, (open_sequence(longer) if is_open else Seq(longer),), frame)
    return value


def _is_begin(site: CallSite) -> bool:
    """Return whether it is ``x.insert(x.begin(), ...)``."""
    start = re.sub(r"\s", "", text(site.given[0])) if site.given else ""
    return start in (f"{text(site.receiver)}.begin()", f"{text(site.receiver)}.cbegin()")


def _inserted(run: Machine, atom: object, source: Value, site: CallSite) -> Value:
    """Run ``a.insert(a.end(), b.begin(), b.end())``."""
    items = [item for each in source for item in items_of(run, each)[0]]
    exact = isinstance(atom, Seq) and all(items_of(run, each)[1] for each in source)
    longer = (*(atom.items if isinstance(atom, Seq) else ((atom,),)), *items)
    assign(run, site.receiver, (Seq(longer) if exact else open_sequence(longer),), site.frame)
    return BOTTOM


def _map_call(run: Machine, atom: Map, name: str, site: CallSite) -> Value:
    values = site.values

    def becomes(after: Map) -> Value:
        assign(run, site.receiver, (after,), site.frame)
        return unknown(f"the result of {name}()")

    first = values[0] if values else BOTTOM
    if name in ("emplace", "insert_or_assign", "try_emplace") and len(values) >= 2:
        key, value = _new_entry(run, site)
        return becomes(_entered(atom, key, value, name == "insert_or_assign"))
    if name == "insert" and values:
        pairs = [each for each in first if isinstance(each, Group | Seq) and len(each.items) == 2]
        pairs += [Group(entry) for each in first if isinstance(each, Map) for entry in each.entries]
        for pair in pairs:
            atom = _entered(atom, pair.items[0], pair.items[1], False)
        return becomes(atom if pairs else atom._replace(open=True))
    if name == "erase":
        return becomes(_without(atom, first))
    if name == "clear":
        return becomes(Map(()))
    if name in ("count", "contains") and values and _is_definite(atom, first):
        return (not _is_missing(atom, first),)
    if name == "empty" and not atom.open:
        return (not atom.entries,)
    if name == "at" and values:
        return element(run, atom, first)
    if name == "find" and values:
        return (END,) if _is_missing(atom, first) else (Group((first, element(run, atom, first))),)
    if name in ("end", "cend"):
        return (END,)
    if name in ("begin", "cbegin"):
        return (atom,)
    if name == "size" and not atom.open:
        return (len(atom.entries),)
    return unknown(f"the result of {name}()")


def _new_entry(run: Machine, site: CallSite) -> tuple[Value, Value]:
    """Return key and value of ``emplace(key, arguments of the value ...)``."""
    key, *rest = site.values
    if len(rest) > 1 and any(isinstance(a, Group) for v in rest for a in v):  # std::piecewise_construct
        return unknown("a key"), unknown("an element that is made of pieces")
    kind, _ = declared_type(run, site.receiver, site.frame)
    inner = kind.arguments[1] if len(kind.arguments) > 1 else None
    cls = run.held_class(inner, site.frame)
    whole = len(rest) == 1 and any(isinstance(a, Obj) and a.cls is cls for a in rest[0])
    if inner is None or cls is None or whole:
        return key, rest[0] if rest else BOTTOM
    return key, construct(run, inner, rest, site.node, site.frame)


def _entered(atom: Map, key: Value, value: Value, replace: bool) -> Map:
    """Enter a pair: a key that a map already has keeps its value, unless that is to be replaced."""
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
    """Return whether it is certain which entry has this key, or that none has."""
    return (
        not atom.open
        and len(key) == 1
        and plain(key[0]) is not None
        and all(len(known) == 1 and plain(known[0]) is not None for known, _ in atom.entries)
    )


def _is_missing(atom: Map, key: Value) -> bool:
    """Return whether a map certainly has no such key."""
    return _is_definite(atom, key) and all(known != key for known, _ in atom.entries)


_REARRANGES = frozenset({
    "erase", "resize", "pop_back", "pop_front", "assign", "swap", "pop", "remove", "unique", "sort", "reverse",
    "splice", "merge", "remove_if", "extract",
})  # fmt: skip


def _sequence_call(run: Machine, atom: Seq | Group, name: str, site: CallSite) -> Value:
    exact, items, values = isinstance(atom, Group) or not atom.open, atom.items, site.values
    first = values[0] if values else BOTTOM
    if name in ("at", "front", "back"):
        if exact and items and name != "at":
            return items[0 if name == "front" else -1]
        return element(run, atom, first)
    if name in ("end", "cend", "rend"):
        return (END,)
    if name in ("begin", "cbegin", "rbegin", "data"):
        return (atom,)
    if name == "value_or":  # an optional that holds nothing reads as an empty list
        return first if exact and not items else (atom,)
    if name == "size":
        return (len(items),) if exact else unknown("a size")
    if name == "empty":
        return (not items,) if exact else unknown("a condition")
    if name == "swap" and len(values) == 1 and isinstance(atom, Seq):
        before = run.evaluate(site.given[0], site.frame)
        assign(run, site.given[0], (atom,), site.frame)
        assign(run, site.receiver, before, site.frame)
    elif name == "assign" and len(values) == 1:
        assign(run, site.receiver, first, site.frame)
    elif (after := _rearranged(atom, name, site)) is not None:
        assign(run, site.receiver, (after,), site.frame)
    return unknown(f"the result of {name}()")


def _rearranged(atom: Seq | Group, name: str, site: CallSite) -> Seq | None:
    """Return what a method that changes a list leaves of it; ``None`` for one that does not."""
    exact, items, values = isinstance(atom, Group) or not atom.open, atom.items, site.values
    first = values[0] if values else BOTTOM
    if name == "clear":
        return Seq(())
    if name == "resize" and exact and len(first) == 1 and isinstance(first[0], int):
        count = min(first[0], 256)
        unset = [unknown("an element that is not set")] * (count - len(items))
        return Seq((*items[:count], *unset))
    if isinstance(atom, Group):
        return None
    if name == "fill" and values:
        return Seq((first,) * len(items)) if exact else open_sequence((first,))
    if name in ("pop_back", "pop_front") and exact:
        return Seq(items[:-1] if name == "pop_back" else items[1:])
    if name == "erase" and exact and _is_begin(site):
        return Seq(items[1:]) if len(values) == 1 else open_sequence(items)
    more = (unknown("an element of a list"),) if name in _ADDS_OTHERS else ()
    return open_sequence((*items, *more)) if name in _REARRANGES else None


_ADDS_OTHERS = frozenset({"resize", "assign", "swap", "splice", "merge"})
_SAME_TEXT = frozenset({
    "c_str", "str", "string", "data", "value", "get", "as_string", "view", "get_value", "value_or", "generic_string",
    "begin", "end",
})  # fmt: skip


def _text_call(run: Machine, atom: Text | Param, name: str, site: CallSite) -> Value:
    values = site.values
    if name in _SAME_TEXT:
        if name == "str" and values:
            assign(run, site.receiver, values[0], site.frame)
        return (atom,)
    known = settled_text(run, atom)
    if name in CHANGES_TEXT:
        after = changed_text(known, name, values) if known is not None else None
        if after is None and name in ("append", "push_back") and len(values) == 1:
            found = added((atom,), values[0])
        else:
            found = literal(after) if after is not None else unknown(f"what {name}() makes of a text")
        assign(run, site.receiver, found, site.frame)
        return found
    found_value = asked_of_text(known, name, values) if known is not None else None
    return unknown(f"the result of {name}()") if found_value is None else found_value
