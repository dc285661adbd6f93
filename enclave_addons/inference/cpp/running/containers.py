"""Methods of containers and texts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import chain

from enclave_addons.inference.cpp.libraries import LIBRARY_CLASSES
from enclave_addons.inference.cpp.reading.type_names import NO_TYPE, Type
from enclave_addons.inference.cpp.running.arithmetic import added
from enclave_addons.inference.cpp.running.assignments import assign, with_entry
from enclave_addons.inference.cpp.running.constructors import (
    as_element,
    begun_stream,
    construct,
    copies,
    default_value,
    made,
)
from enclave_addons.inference.cpp.running.contents import copied, elements_copied, handed_over, items_of
from enclave_addons.inference.cpp.running.expressions import element
from enclave_addons.inference.cpp.running.invocation import CallSite
from enclave_addons.inference.cpp.running.launch_values import settled_text
from enclave_addons.inference.cpp.running.machine import Machine
from enclave_addons.inference.cpp.running.plain_types import ORDERED, is_plain_type
from enclave_addons.inference.cpp.running.references import forget
from enclave_addons.inference.cpp.running.standard import called_now
from enclave_addons.inference.cpp.running.static_types import declared_type, seen_type
from enclave_addons.inference.cpp.running.unknown_calls import may_be_written
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    END,
    MAX_ITEMS,
    Atom,
    Group,
    Map,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    as_one_map,
    literal,
    lost,
    open_sequence,
    plain,
    unknown,
)
from enclave_addons.inference.cpp.syntax import children


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
    if name in ("swap", "splice", "merge") and site.given:
        forget(run, site.given[0], site.frame, written=_held_by([(atom,)]), told=False)
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
    if isinstance(atom, int):  # a std::atomic, compare_exchange_strong() writes back
        may_be_written(run, name, [], site.given, site.frame)
    return unknown(f"the result of {name}()")


_ADDING = frozenset({"emplace_back", "push_back", "push_front", "emplace_front", "insert", "push", "emplace"})
_PARAMETER_VIEWS = frozenset({
    "as_string", "as_int", "as_bool", "as_double", "as_string_array", "get_value", "get", "value_to_string",
    "get_parameter_value", "as_integer_array", "as_double_array", "as_bool_array", "as_byte_array", "to_value_msg",
    "value", "c_str", "str", "begin",
})  # fmt: skip


_AT_A_PLACE = ("std::vector", "std::list", "std::deque")
"""The first argument of their ``emplace`` is the position."""


def _added(run: Machine, atom: object, name: str, site: CallSite) -> Value:
    given, frame, receiver = site.given, site.frame, site.receiver
    kind, _ = declared_type(run, receiver, frame)
    inner = kind.arguments[0] if kind.arguments else None
    cls = run.held_class(inner, frame)
    if (
        name.startswith("emplace")
        and inner is not None
        and (cls is not None or inner.name in LIBRARY_CLASSES)
    ):
        values = site.values[name == "emplace" and kind.name in _AT_A_PLACE :]
        is_copy = len(values) == 1 and cls is not None and copies(run, cls, values[0])
        value = (
            copied(run, values[0], site.node, frame, cls)
            if is_copy
            else construct(run, inner, values, site.node, frame)
        )
    elif given and given[-1].type == "initializer_list" and inner is not None and inner.name:
        value = made(run, given[-1], inner, children(given[-1]), frame)
    else:
        listed = [run.evaluate(each, frame) for each in given]
        if inner is None or not inner.pointer:
            listed = [
                as_element(run, inner or NO_TYPE, value, each, frame)
                for value, each in zip(listed, given, strict=True)
            ]
        if name == "insert" and len(listed) == 3:
            return _inserted(run, atom, listed[1], site)
        value = listed[-1] if listed else BOTTOM
        if inner is not None and inner.name == "std::pair" and _as_they_are(inner.arguments, site.values):
            value = (Group(tuple(site.values)),)
        elif name.startswith("emplace") and (inner is None or not inner.pointer):
            what = f"an element that {name}() makes"
            handed_over(run, what, listed, site.node, frame)
            if len(listed) > 1 + (name == "emplace"):
                value = unknown(what)
    run.handle(site.node, frame)
    if not isinstance(atom, Seq):
        assign(run, receiver, (open_sequence((value, (atom,))),), frame)
        return value
    at_end = name in ("push_back", "emplace_back", "push") or END in site.values[0][:1]
    is_exact = at_end and not atom.open and kind.name not in ORDERED
    longer = (*atom.items, value)
    assign(run, receiver, (Seq(longer) if is_exact else open_sequence(longer),), frame)
    return value


def _as_they_are(kinds: Sequence[Type], values: Sequence[Value]) -> bool:
    """Return whether a pair of these types, made of texts and pointers, holds just these values."""
    return len(kinds) == len(values) == 2 and all(
        kind.pointer or (kind.name == "std::string" and all(isinstance(atom, Text) for atom in value))
        for kind, value in zip(kinds, values, strict=True)
    )


def _inserted(run: Machine, atom: object, source: Value, site: CallSite) -> Value:
    """Run ``a.insert(a.end(), b.begin(), b.end())``."""
    items = [item for each in source for item in items_of(run, each)[0]]
    longer = (*(atom.items if isinstance(atom, Seq) else ((atom,),)), *items)
    kind, _ = declared_type(run, site.receiver, site.frame)
    after = elements_copied(run, kind, (open_sequence(longer),), site.node, site.frame)
    assign(run, site.receiver, after, site.frame)
    return BOTTOM


def _map_call(run: Machine, atom: Map, name: str, site: CallSite) -> Value:
    values = site.values

    def becomes(after: Atom) -> Value:
        assign(run, site.receiver, (after,), site.frame)
        return unknown(f"the result of {name}()")

    first = values[0] if values else BOTTOM
    if name in ("emplace", "insert_or_assign", "try_emplace") and len(values) >= 2:
        key, value = _new_entry(run, site)
        return becomes(
            with_entry(atom, key, value) if name == "insert_or_assign" else _entered(atom, key, value)
        )
    if name == "insert" and values:
        pairs = [each for each in first if isinstance(each, Group | Seq) and len(each.items) == 2]
        pairs += [Group(entry) for each in first if isinstance(each, Map) for entry in each.entries]
        for pair in pairs:
            atom = _entered(atom, pair.items[0], pair.items[1])
        return becomes(atom if pairs else atom._replace(open=True))
    if name == "clear":
        return becomes(Map(()))
    if name == "erase" and _has(atom, first) is not None:
        return becomes(Map(tuple(entry for entry in atom.entries if entry[0] != first)))
    if name in _CHANGES:
        return becomes(_changed_by(atom, name, values)[0])
    if name in ("at", "find", "count", "contains") and values:
        found, has = element(run, atom, first), _has(atom, first)
        if name == "find":
            return (*(() if has else (END,)), *(() if has is False else (Group((first, found)),)))
        return found if name == "at" else unknown("a condition") if has is None else (has,)
    if name in ("end", "cend"):
        return (END,)
    if name in ("begin", "cbegin"):
        is_open = atom.open or len(atom.entries) > 1  # entries stand as they were made, not by their keys
        return (Seq(tuple((Group(entry),) for entry in atom.entries), is_open, place=True),)
    return unknown(f"the result of {name}()")


def _has(atom: Map, key: Value) -> bool | None:
    """Return whether a map certainly has a key, or has it not."""
    keys = (key, *(known for known, _ in atom.entries))
    if atom.open or any(len(each) != 1 or plain(each[0]) is None for each in keys):
        return None
    return key in keys[1:]


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


def _entered(atom: Map, key: Value, value: Value) -> Map:
    """Enter a pair; a key that the map already has keeps its value."""
    definite = len(key) == 1 and plain(key[0]) is not None
    if definite and not atom.open and any(known == key for known, _ in atom.entries):
        return atom
    return as_one_map((*atom.entries, (key, value)), atom.open or not definite)


_CHANGES = frozenset({
    "erase", "resize", "pop_back", "pop_front", "assign", "swap", "pop", "remove", "unique", "sort", "reverse",
    "splice", "merge", "remove_if", "extract", "fill",
})  # fmt: skip
"""Methods after which only the objects in a container are known, and those of another one that it gets."""
_KEEP_NOTHING = frozenset({"erase", "remove", "unique", "sort", "remove_if"})
"""Those of them that only compare elements with what they get, or by it."""


def _changed_by(atom: Map | Seq, name: str, values: Sequence[Value]) -> Value:
    """Return what a container may be after one of these methods."""
    return lost((atom,), f"what {name}() leaves", () if name in _KEEP_NOTHING else _held_by(values))


def _held_by(values: Sequence[Value]) -> Value:
    """Return the objects and closures in what a method gets."""
    found: list[Atom] = []
    for atom in chain.from_iterable(values):
        inner = (
            atom.entries if isinstance(atom, Map) else (atom.items,) if isinstance(atom, Seq | Group) else ()
        )
        found += [*_held_by([*chain.from_iterable(inner)])] if inner else [atom]
    return tuple(found)


def _sequence_call(run: Machine, atom: Seq | Group, name: str, site: CallSite) -> Value:
    exact, items, values = isinstance(atom, Group) or not atom.open, atom.items, site.values
    first = values[0] if values else BOTTOM
    if name in ("at", "front", "back"):
        if exact and items and name != "at":
            return items[0 if name == "front" else -1]
        return element(run, atom, first)
    if name in ("end", "cend", "rend"):
        return (END,)
    if name in ("begin", "cbegin", "data", "rbegin") and isinstance(atom, Seq):
        return (Seq(items[::-1] if name == "rbegin" else items, atom.open, place=True),)
    if name == "value_or":  # an optional that holds nothing reads as an empty list
        return first if exact and not items else (atom,)
    if name == "size":
        return (len(items),) if exact else unknown("a size")
    if name == "empty":
        return (not items,) if exact else unknown("a condition")
    if name == "clear":
        assign(run, site.receiver, (Seq(()),), site.frame)
    elif name == "assign" and len(values) == 2 and END in values[1]:
        _inserted(run, Seq(()), first, site)
    elif name == "resize" and isinstance(atom, Seq) and (resized := _resized(run, atom, site)) is not None:
        assign(run, site.receiver, (resized,), site.frame)
    elif name in _CHANGES and isinstance(atom, Seq):
        assign(run, site.receiver, _changed_by(atom, name, values), site.frame)
    return unknown(f"the result of {name}()")


def _resized(run: Machine, atom: Seq, site: CallSite) -> Seq | None:
    """Return a list of texts, numbers or pointers with as many items as it gets; ``None`` where that is not known."""
    arguments = seen_type(run, site.receiver, site.frame).arguments
    if len(arguments) != 1 or not (arguments[0].pointer or is_plain_type(arguments[0].name)):
        return None
    count, *given = site.values or [BOTTOM]
    if atom.open or len(count) != 1 or type(count[0]) is not int or not 0 <= count[0] <= MAX_ITEMS:
        return None
    at_first = BOTTOM if arguments[0].pointer else default_value(run, site.node, arguments[0], site.frame)
    new = given[0] if given else at_first
    return Seq((*atom.items, *[new] * (count[0] - len(atom.items)))[: count[0]])


_SAME_TEXT = frozenset({
    "c_str", "str", "string", "data", "value", "get", "as_string", "view", "get_value", "value_or", "generic_string",
    "begin", "end",
})  # fmt: skip


def _text_call(run: Machine, atom: Text | Param, name: str, site: CallSite) -> Value:
    values = site.values
    if name in _SAME_TEXT:
        if name == "str" and values:
            assign(run, site.receiver, begun_stream(values[0]), site.frame)
        return (atom,)
    if name == "clear" and "stream" in declared_type(run, site.receiver, site.frame)[0].name:
        return BOTTOM  # of its flags
    if name in _CHANGES_TEXT:
        adds = name in ("append", "push_back") and len(values) == 1
        changed = literal("") if name == "clear" else unknown(f"what {name}() leaves of a text")
        found = added((atom,), values[0]) if adds else changed
        assign(run, site.receiver, found, site.frame)
        return found
    named = site.receiver.type in ("identifier", "field_expression")
    if isinstance(atom, Text) and named and not _READS_TEXT.fullmatch(name):
        assign(run, site.receiver, unknown(f"what {name}() leaves of a text or stream"), site.frame)
    return _measured(run, atom, name)


def _measured(run: Machine, atom: Text | Param, name: str) -> Value:
    """Return whether a text that this run knows is empty, its length and last letter; nothing else is followed."""
    written = settled_text(run, atom) if run.start is not None else plain(atom)
    if written is not None and name == "empty":
        return (not written,)
    if written is not None and written.isascii() and name in ("size", "length"):
        return (len(written),)
    return literal(written[-1]) if written and name == "back" else unknown(f"the result of {name}()")


_READS_TEXT = re.compile(
    r"empty|size|length|front|back|at|substr|rfind|contains|(?:starts|ends)_with|good|fail|eof|bad|is_open|tell[pg]|rdstate|compare|capacity|reserve|shrink_to_fit|max_size|copy|hash\w*|c?r?(?:begin|end)|"
    r"find\w*|count|has_\w+|is_\w+|get_\w+|as_\w+|to_\w+|filename|stem|extension|\w+_path|native|(?:generic_)?\w*string"
)
"""Further methods that leave a text, stream or path as it is."""
_CHANGES_TEXT = frozenset({
    "erase", "replace", "insert", "pop_back", "assign", "resize", "remove_prefix", "remove_suffix", "swap", "clear",
    "push_back", "append", "emplace",
})  # fmt: skip
"""Methods after which the text is another one."""
