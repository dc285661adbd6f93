"""The standard library, as far as names are made with it: texts, lists, maps, optionals, parameters' values."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial

from enclave_addons.inference.cpp.engine.frames import NEXT, Frame
from enclave_addons.inference.cpp.engine.invocation import call_value
from enclave_addons.inference.cpp.engine.launch_values import parameter_items, text_of
from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.objects import bound_to, converted, copied, made_of
from enclave_addons.inference.cpp.engine.places import (
    declared_type,
    element,
    places_of,
    read,
    step_of,
    write,
    write_all,
)
from enclave_addons.inference.cpp.engine.values import (
    BOTTOM,
    END,
    NULL,
    Atom,
    Const,
    Group,
    Map,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    as_map,
    concatenated,
    is_open,
    join,
    literal,
    only,
    open_sequence,
    plain,
    unknown,
)
from enclave_addons.inference.cpp.reading.type_names import NO_TYPE
from enclave_addons.inference.cpp.syntax import Node, field_of, unwrapped

_SAME_TEXT = frozenset(
    {"c_str", "data", "str", "string", "get", "value", "native", "toStdString", "view", "load"}
)
_VALUE_OF_PARAMETER = re.compile(
    r"as_\w+|get_value|get_parameter_value|get|value|value_to_string|value_or|get_value_message"
)
_ADDS = frozenset({"push_back", "emplace_back", "push_front", "push", "emplace", "insert", "emplace_front"})
_READS = frozenset({"at", "back", "front", "top", "operator[]"})
_NOW = re.compile(
    r"std::(?:for_each|transform|find_if|any_of|all_of|none_of|copy_if|sort|count_if|remove_if|apply|visit|accumulate|generate\w*)"
)
_NUMBERS = re.compile(r"(?:std::)?(?:sto[ild]+|ato[ifl]|strto\w+|stof)")
_PRINTS = re.compile(r"(?:std::)?(?:v?sn?printf|str(?:n?cpy|n?cat)|mem(?:cpy|set)|getline|sscanf)")
_OF_STANDARD = re.compile(
    r"std::\w+|(?:\w+::)?(?:to_string|printf|v?sn?printf|str(?:n?cpy|n?cat)|min|max|abs)"
)


# --- functions ----------------------------------------------------------------------------------------------------


def function_of_standard(
    run: Machine, name: str, values: Sequence[Value], given: Sequence[Node], node: Node, frame: Frame
) -> Value | None:
    """Call a function of the standard library; ``None`` if it is none."""
    if name in ("std::to_string", "to_string") and len(values) == 1:
        value = only(values[0])
        return unknown("a number as text") if isinstance(value, float) else concatenated(values[0])
    if name in ("std::make_pair", "std::make_tuple", "make_pair", "std::tie", "std::forward_as_tuple"):
        return (Group(tuple(values)),)
    if name == "std::get" and values:
        return unknown("a part of a tuple")
    if name in ("std::begin", "std::cbegin", "begin") and values:
        return values[0]
    if name in ("std::end", "std::cend", "end"):
        return (END,)
    if name in ("std::size", "size") and values:
        return _size(values[0])
    if name in ("std::next", "std::prev", "std::quoted") and values:
        return values[0] if name == "std::quoted" else unknown("an iterator")
    if name in ("std::swap", "swap") and len(given) == 2:
        for target, value in zip(given, reversed(values), strict=True):
            write_all(run, places_of(run, target, frame), value)
        return BOTTOM
    if name == "std::exchange" and len(given) == 2:
        write_all(run, places_of(run, given[0], frame), values[1])
        return values[0]
    if name in ("std::min", "std::max") and len(values) == 2:
        first, second = only(values[0]), only(values[1])
        if isinstance(first, int | float) and isinstance(second, int | float):
            return (min(first, second) if name == "std::min" else max(first, second),)
        return unknown("a number")
    if _NUMBERS.fullmatch(name):
        known = [plain(atom) for atom in values[0]] if values else []
        whole = len(known) == 1 and known[0] is not None and re.fullmatch(r"-?\d+", known[0]) is not None
        return (int(known[0] or 0),) if whole else unknown("a number")
    if name in ("std::async", "std::invoke") or _NOW.fullmatch(name):
        return _with_callable(run, name, values, given, node, frame)
    if not _OF_STANDARD.fullmatch(name):
        return None
    run.later(values)
    if name in (
        "std::getline",
        "std::reverse",
        "std::sort",
        "std::replace",
        "std::transform",
        "std::copy",
        "std::iota",
    ) or _PRINTS.fullmatch(name):
        for target in given:
            _forget(run, target, name, frame)
    return unknown(f"the result of {name}()")


def _forget(run: Machine, given: Node, name: str, frame: Frame) -> None:
    target = unwrapped(given)
    if target is not None and target.type == "call_expression":
        target = field_of(field_of(target, "function"), "argument")
    for place in places_of(run, target, frame):
        held = read(run, place)
        if any(isinstance(atom, Text | Seq | Map) for atom in held):
            write(run, place, unknown(f"what {name}() writes"))


def _with_callable(
    run: Machine, name: str, values: Sequence[Value], given: Sequence[Node], node: Node, frame: Frame
) -> Value:
    if name == "std::invoke" and values:
        return call_value(run, values[0], values[1:], node, frame) or unknown("the result of std::invoke()")
    if name != "std::async":
        item = element(run, values[0], "any") if values and values[0] else unknown("an element")
        for each in values:
            run.branches([partial(_call_now, run, each, item, node, frame), lambda: NEXT])
        if name == "std::transform":
            for target in given[1:]:
                _forget(run, target, name, frame)
        return unknown(f"the result of {name}()")
    run.later([bound_to(values[-1:] if len(values) < 3 else values[1:])] if values else [])
    return unknown("what runs beside")


def _call_now(run: Machine, function: Value, item: Value, node: Node, frame: Frame) -> int:
    call_value(run, function, [item], node, frame)
    return NEXT


# --- methods ------------------------------------------------------------------------------------------------------


def method_of_standard(
    run: Machine, atom: Atom, name: str, values: Sequence[Value], given: Sequence[Node], node: Node,
    base: Node | None, frame: Frame,
) -> Value | None:  # fmt: skip
    """Call a method of a text, list, map or parameter; ``None`` if there is none of that name."""
    if isinstance(atom, Param):
        return _of_parameter(run, atom, name, values, given, node, base, frame)
    if isinstance(atom, Text):
        return _of_text(run, atom, name, values, base, frame)
    if isinstance(atom, Seq | Group):
        return _of_list(run, atom, name, values, given, node, base, frame)
    if isinstance(atom, Map):
        return _of_map(run, atom, name, values, given, node, base, frame)
    if isinstance(atom, bool | int | float) and name in ("load", "value", "count", "get"):
        return (atom,)
    if name in ("store", "exchange") and len(values) >= 1 and not isinstance(atom, Obj):
        write_all(run, places_of(run, base, frame), values[0])
        return BOTTOM
    if name == "reset" and (atom == NULL or isinstance(atom, Unknown)):
        write_all(run, places_of(run, base, frame), values[0] if values else (NULL,))
        return BOTTOM
    if atom == NULL:
        return _of_nothing(run, name, values, given, node, base, frame)
    if isinstance(atom, Const) and name in ("value", "load", "get"):
        return (atom,)
    if isinstance(atom, Unknown) and name in _ADDS | {"operator="} and base is not None:
        run.later(values)
        return unknown(atom.why)
    return None


def _of_nothing(
    run: Machine,
    name: str,
    values: Sequence[Value],
    given: Sequence[Node],
    node: Node,
    base: Node | None,
    frame: Frame,
) -> Value | None:
    if name in ("has_value", "operator bool", "joinable"):
        return (False,)
    if name in ("lock", "get"):
        return (NULL,)
    if name == "value_or" and values:
        return values[0]
    if name == "emplace":
        kind = declared_type(run, base, frame)._replace(pointer=False)
        value = (
            made_of(run, kind, values, given, node, frame, braces=False)
            if kind != NO_TYPE
            else unknown("a value")
        )
        write_all(run, places_of(run, base, frame), value)
        return value
    if name in ("join", "detach", "swap"):
        return BOTTOM
    return None


def _of_parameter(
    run: Machine, atom: Param, name: str, values: Sequence[Value], given: Sequence[Node], node: Node,
    base: Node | None, frame: Frame,
) -> Value | None:  # fmt: skip
    if _VALUE_OF_PARAMETER.fullmatch(name):
        return (atom,)
    if name in ("get_name",):
        return literal(atom.name)
    if name in ("size", "empty", "at", "front", "back", "begin", "end", "cbegin", "cend"):
        default = [each for each in atom.default if isinstance(each, Seq)]
        if default or run.start is not None:
            items, exact = parameter_items(run, atom)
            listed = Seq(tuple(items), not exact)
            settled = run.start is not None and exact
            if name in ("size", "empty") and not settled:
                return unknown("the size of a parameter")
            if default or isinstance(run.consulted.get(atom.name), list | tuple):
                return _of_list(run, listed, name, values, given, node, base, frame)
    if name in ("empty", "size", "length"):
        known = text_of(run, atom) if run.start is not None else None
        return (
            unknown("the size of a parameter")
            if known is None
            else (known == "" if name == "empty" else len(known),)
        )
    if name in _SAME_TEXT:
        return (atom,)
    if name in ("get_type", "get_type_name"):
        return unknown("the type of a parameter")
    return _of_text(run, Text((*concatenated((atom,))[0].parts,)), name, values, base, frame)


def _of_text(
    run: Machine, atom: Text, name: str, values: Sequence[Value], base: Node | None, frame: Frame
) -> Value | None:
    known = plain(atom)
    if name in _SAME_TEXT and not (name == "str" and values):
        return (atom,)
    if name in ("append", "push_back", "operator+=") and values:
        found = concatenated((atom,), values[0]) if len(values) == 1 else unknown("a text")
        write_all(run, places_of(run, base, frame), found)
        return found
    if name in ("str", "assign", "operator=") and values:
        write_all(run, places_of(run, base, frame), values[0])
        return values[0]
    if name == "clear":
        write_all(run, places_of(run, base, frame), literal(""))
        return BOTTOM
    if name in ("erase", "pop_back", "insert", "replace", "resize"):
        found = literal(known[:-1]) if name == "pop_back" and known else unknown("a text that is edited")
        write_all(run, places_of(run, base, frame), found)
        return found
    result = _of_known_text(known, name, [only(value) for value in values]) if known is not None else None
    return result if result is not None else unknown(f"{name}() of a text")


def _of_known_text(known: str, name: str, values: Sequence[Atom | None]) -> Value | None:
    if name in ("empty", "size", "length"):
        return (known == "",) if name == "empty" else (len(known.encode()),)
    if name in ("front", "back") and known:
        return literal(known[0] if name == "front" else known[-1])
    numbers = [value for value in values if type(value) is int]
    if name == "substr" and numbers and len(numbers) == len(values):
        return literal(known[numbers[0] :][: numbers[1] if len(numbers) > 1 else None])
    texts = [plain(value) for value in values if isinstance(value, Text)]
    wanted = texts[0] if len(texts) == 1 == len(values) else None
    if wanted is None or name not in ("find", "starts_with", "ends_with"):
        return None
    if name != "find":
        return (known.startswith(wanted) if name == "starts_with" else known.endswith(wanted),)
    found = known.find(wanted)
    return (found,) if found >= 0 else (Const("std::string::npos"),)


def _size(value: Value) -> Value:
    atom = only(value)
    if isinstance(atom, Seq | Group) and not getattr(atom, "open", False):
        return (len(atom.items),)
    if isinstance(atom, Map) and not atom.open:
        return (len(atom.entries),)
    return unknown("the size of a list")


def _of_list(
    run: Machine, atom: Seq | Group, name: str, values: Sequence[Value], given: Sequence[Node], node: Node,
    base: Node | None, frame: Frame,
) -> Value | None:  # fmt: skip
    whole = (atom,)
    if name in ("size", "length"):
        return _size(whole)
    if name == "empty":
        count = only(_size(whole))
        return (count == 0,) if isinstance(count, int) else unknown("whether a list is empty")
    if name in _READS:
        return element(run, whole, step_of(run, whole, values[0] if values else BOTTOM, name))
    if name in ("begin", "cbegin", "rbegin"):
        return (
            atom.items[0]
            if len(atom.items) == 1 and not getattr(atom, "open", False)
            else element(run, whole, "any")
        )
    if name in ("end", "cend", "rend"):
        return (END,)
    if name in _ADDS:
        return _added(run, atom, name, values, given, node, base, frame)
    if name in ("count", "contains", "find"):
        return _found(atom, name, values)
    if name in ("clear", "resize", "assign", "pop_back", "erase", "pop", "pop_front"):
        _shortened(run, atom, name, values, base, frame)
        return unknown("an iterator")
    if name in ("reserve", "shrink_to_fit", "capacity", "max_size", "data", "swap", "fill", "sort", "unique"):
        return whole if name == "data" else BOTTOM
    return None


def _found(atom: Seq | Group, name: str, values: Sequence[Value]) -> Value:
    is_known = not getattr(atom, "open", False) and not any(
        is_open(item) or len(item) != 1 for item in atom.items
    )
    wanted = only(values[0]) if values else None
    if is_known and wanted is not None and not isinstance(wanted, Unknown | Param):
        there = (wanted,) in atom.items
        if name == "find":
            return (wanted,) if there else (END,)
        return (int(there),)
    return unknown("whether a list has an element")


def _shortened(
    run: Machine, atom: Seq | Group, name: str, values: Sequence[Value], base: Node | None, frame: Frame
) -> None:
    items = atom.items
    if name == "clear":
        found: Value = (Seq(()),)
    elif name in ("pop_back", "pop_front") and items and not getattr(atom, "open", False):
        found = (Seq(items[:-1] if name == "pop_back" else items[1:]),)
    elif (
        name == "assign"
        and len(values) == 2
        and isinstance(count := only(values[0]), int)
        and 0 <= count <= 64
    ):
        found = (Seq((values[1],) * count),)
    elif (
        name == "resize"
        and isinstance(count := only(values[0]) if values else None, int)
        and 0 <= count <= 64
    ):
        new = values[1] if len(values) > 1 else unknown("an element that is not set")
        found = (Seq((*items[:count], *[new] * (count - len(items)))),)
    else:
        found = (open_sequence(items),)
    write_all(run, places_of(run, base, frame), found)


def _added(
    run: Machine, atom: Seq | Group, name: str, values: Sequence[Value], given: Sequence[Node], node: Node,
    base: Node | None, frame: Frame,
) -> Value:  # fmt: skip
    kind = declared_type(run, base, frame)
    item_type = kind.arguments[0] if kind.arguments else NO_TYPE
    run.handle(node, frame)
    if name.startswith("emplace"):
        is_made = len(values) == 1 and any(isinstance(a, Obj) for a in values[0])
        if name == "emplace" and len(values) > 1:
            values, given = values[1:], given[1:]
        value = values[0] if is_made or not item_type.name else made_of(
            run, item_type, values, given or [node], node, frame, braces=False)  # fmt: skip
    elif name == "insert" and len(values) > 1:
        places = places_of(run, base, frame)
        more = element(run, values[1], "any") if len(values) == 3 else values[1]
        known = [a for a in values[1] if isinstance(a, Seq)]
        items = [i for a in known for i in a.items] if len(values) == 3 else [more]
        write_all(run, places, (open_sequence([*atom.items, *items]),))
        return unknown("an iterator")
    else:
        value = copied(run, values[0], node, frame) if values else unknown("an element")
        value = converted(run, value, item_type, node, frame)
    if isinstance(atom, Seq) and atom.open:
        found: Atom = open_sequence([*atom.items, value])
    elif run.repeated or len(atom.items) >= 256:
        found = open_sequence([*atom.items, value])
    elif "set" in kind.last and value in atom.items:
        found = Seq(atom.items)
    else:
        found = Seq((value, *atom.items) if name.endswith("front") else (*atom.items, value))
    write_all(run, places_of(run, base, frame), (found,))
    return value


def _of_map(
    run: Machine, atom: Map, name: str, values: Sequence[Value], given: Sequence[Node], node: Node,
    base: Node | None, frame: Frame,
) -> Value | None:  # fmt: skip
    whole = (atom,)
    if name in ("size", "empty"):
        count = only(_size(whole))
        return _size(whole) if name == "size" or not isinstance(count, int) else (count == 0,)
    if name in ("at", "operator[]") and values:
        return element(run, whole, values[0]) or unknown("an entry that is not there")
    if name in ("count", "contains", "find"):
        return _sought(run, atom, name, values[0] if values else BOTTOM)
    if name in ("insert", "emplace", "insert_or_assign", "try_emplace", "emplace_hint"):
        return _entered(run, atom, name, values, given, node, base, frame)
    if name in ("begin", "cbegin"):
        return join(*((Group(entry),) for entry in atom.entries)) or (END,)
    if name in ("end", "cend"):
        return (END,)
    if name in ("clear", "erase"):
        found = Map(()) if name == "clear" else atom._replace(open=True)
        write_all(run, places_of(run, base, frame), (found,))
        return BOTTOM
    return BOTTOM if name in ("reserve", "swap") else None


def _sought(run: Machine, atom: Map, name: str, key: Value) -> Value:
    certain = len(key) == 1 and not is_open(key) and not isinstance(key[0], Param)
    certain = certain and not atom.open and all(len(k) == 1 and not is_open(k) for k, _ in atom.entries)
    there = [(each, value) for each, value in atom.entries if each == key]
    if name == "find":
        if certain:
            return (Group(there[0]),) if there else (END,)
        found = there if there else list(atom.entries)
        return (*join(*((Group(entry),) for entry in found)), *unknown("an entry of a map"))
    return (int(bool(there)),) if certain else unknown("whether a map has a key")


def _entered(
    run: Machine, atom: Map, name: str, values: Sequence[Value], given: Sequence[Node], node: Node,
    base: Node | None, frame: Frame,
) -> Value:  # fmt: skip
    kind = declared_type(run, base, frame)
    value_type = kind.arguments[1] if len(kind.arguments) > 1 else NO_TYPE
    pair = only(values[0]) if len(values) == 1 else None
    run.handle(node, frame)
    if isinstance(pair, Group) and len(pair.items) == 2:
        key, value = pair.items
    elif len(values) >= 2:
        key = values[0]
        value = values[1]
        if name == "try_emplace" or len(values) > 2:
            value = made_of(run, value_type, values[1:], given[1:], node, frame, braces=False)
    else:
        write_all(run, places_of(run, base, frame), (atom._replace(open=True),))
        return unknown("an entry of a map")
    value = converted(run, copied(run, value, node, frame), value_type, node, frame)
    before = dict(atom.entries).get(key)
    certain = not is_open(key) and len(key) == 1 and not run.repeated
    new = (
        value if before is None else before if name != "insert_or_assign" and certain else join(before, value)
    )
    found = as_map({**dict(atom.entries), key: new}, atom.open or not certain)
    write_all(run, places_of(run, base, frame), (found,))
    return (Group(((Group((key, value)),), unknown("whether it is new"))),)
