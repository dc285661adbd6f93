"""The part of the C++ standard library that names pass through: texts, containers, pointers, bind."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from nodl.infer.cpp.expressions import assign, element, with_entry
from nodl.infer.cpp.machine import Frame, Machine
from nodl.infer.cpp.names import Type
from nodl.infer.cpp.objects import construct, copied, declared_value, handed_over, items_of
from nodl.infer.cpp.syntax import children, text, unwrapped
from nodl.infer.cpp.values import (
    BOTTOM,
    END,
    NPOS,
    Bound,
    Const,
    Group,
    Lambda,
    Map,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    concatenated,
    join,
    literal,
    plain,
    truth,
    unknown,
)

if TYPE_CHECKING:
    from tree_sitter import Node

Standard = Callable[[Machine, Sequence[Value], "Node", Frame, Sequence[Type]], Value]
STANDARD: dict[str, Standard] = {}
CASTS = frozenset({
    "static_cast", "dynamic_cast", "const_cast", "reinterpret_cast", "std::static_pointer_cast",
    "std::dynamic_pointer_cast",
    "std::const_pointer_cast", "std::move", "std::forward", "std::ref", "std::cref", "std::as_const", "move",
    "dynamic_pointer_cast", "static_pointer_cast", "std::addressof", "std::any_cast",
})  # fmt: skip


def _standard(*names: str) -> Callable[[Standard], Standard]:
    def register(handler: Standard) -> Standard:
        STANDARD.update(dict.fromkeys(names, handler))
        return handler

    return register


@_standard("std::string", "std::string_view", "string", "std::filesystem::path", "std::quoted")
def _text(run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]) -> Value:
    return values[0] if values else literal("")


@_standard("std::to_string")
def _to_string(
    run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]
) -> Value:
    return concatenated(values[0]) if values else unknown("a text")


@_standard(
    "std::make_pair", "std::pair", "std::make_tuple", "std::tuple", "std::tie", "std::forward_as_tuple"
)
def _pair(run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]) -> Value:
    return (Group(tuple(values)),)


@_standard("std::get")
def _get(run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]) -> Value:
    position = re.search(r"get<\s*(\d+)\s*>", text(node))
    found = [atom.items[int(position[1])] for value in values for atom in value
             if position and isinstance(atom, Group | Seq) and int(position[1]) < len(atom.items)]  # fmt: skip
    return join(*found) if found else unknown("an element of a tuple")


@_standard("std::bind", "boost::bind", "std::bind_front")
def _bind(run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]) -> Value:
    """A method with its object, or a function with its first arguments."""
    if not values:
        return BOTTOM
    found: list[object] = []
    for atom in values[0]:
        objects = [each for each in values[1] if isinstance(each, Obj)] if len(values) > 1 else []
        if isinstance(atom, Bound) and atom.this is None and atom.function.owner and objects:
            rest = values[2:]
            targets: list[Bound | Lambda] = [Bound(atom.function, each) for each in objects]
        else:
            rest = values[1:]
            targets = [atom] if isinstance(atom, Bound | Lambda) else []
        for target in targets:
            if all(_is_placeholder(value) for value in rest):
                found.append(target)
            else:
                key = ("bind", frame.file.file, node.start_byte, frame.path, target)
                made = run.obj(key, Type("std::function"))
                made.data["partial"] = ((target,), list(rest))
                found.append(made)
    return tuple(found) if found else unknown("a function")


def _is_placeholder(value: Value) -> bool:
    return any(isinstance(a, Unknown) and re.search(r"the value of (?:\w+::)*_\d$", a.why) for a in value)


@_standard(
    "std::thread",
    "std::jthread",
    "std::async",
    "std::call_once",
    "std::for_each",
    "std::transform",
    "std::sort",
    "std::any_of",
    "std::all_of",
    "std::make_heap",
    "std::generate",
    "std::invoke",
)
def _calls_back(
    run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]
) -> Value:
    for atom in _bind(run, list(values), node, frame, types):
        run.later(atom, frame)
    for value in values:
        for atom in value:
            run.later(atom, frame)
    return unknown(f"the result of {text(node.child_by_field_name('function'))[:40]}()")


@_standard("std::find_if", "std::find")
def _find_if(run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]) -> Value:
    """The element of a list that is exactly known, or its end."""
    from nodl.infer.cpp.calls import call_values

    items, exact = items_of(run, values[0][0]) if values and len(values[0]) == 1 else ([], False)
    for item in items if exact and len(values) > 2 else ():
        called = any(isinstance(atom, Lambda | Bound) for atom in values[2])
        answer = truth(call_values(run, values[2], [item], node, frame)) if called else same(item, values[2])
        if answer is None:
            return unknown("an element that is looked for")
        if answer:
            return item
    return (END,) if exact else unknown("an element that is looked for")


def same(left: Value, right: Value) -> bool | None:
    first = plain(left[0]) if len(left) == 1 else None
    second = plain(right[0]) if len(right) == 1 else None
    return None if first is None or second is None else first == second


@_standard("std::function", "std::optional", "std::make_optional", "std::shared_ptr", "std::unique_ptr", "std::begin",
           "std::weak_ptr", "std::remove_reference", "std::launder", "std::exchange")  # fmt: skip
def _same(run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]) -> Value:
    return values[0] if values else BOTTOM


@_standard("getenv", "std::getenv", "rcpputils::get_env_var")
def _environment(
    run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]
) -> Value:
    return unknown("an environment variable")


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
    from nodl.infer.cpp.expressions import declared_type

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
        from nodl.infer.cpp.objects import made

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
        assign(run, receiver, (Seq((*atom.items, value), atom.open),), frame)
    elif receiver is not None:
        assign(run, receiver, (Seq((value, (atom,)), open=True),), frame)
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
        assign(run, receiver, (Seq((*before, *items), open=not exact),), frame)
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
        assign(
            run,
            receiver,
            (
                Seq(
                    (*atom.items, unknown("an element of a list"))
                    if name in ("resize", "assign")
                    else atom.items,
                    open=True,
                ),
            ),
            frame,
        )
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


__all__ = ["Const", "declared_value", "unwrapped"]
