"""Functions of the C++ standard library that names pass through: texts, pairs, bind, threads."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.contents import items_of
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import (
    BOTTOM,
    END,
    Bound,
    Group,
    Lambda,
    Obj,
    Seq,
    Unknown,
    Value,
    concatenated,
    join,
    literal,
    plain,
    truth,
    unknown,
)
from nodl.infer.cpp.syntax import text

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
    from nodl.infer.cpp.running.invocation import call_values

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
def _itself(run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]) -> Value:
    return values[0] if values else BOTTOM


@_standard("getenv", "std::getenv", "rcpputils::get_env_var")
def _environment(
    run: Machine, values: Sequence[Value], node: Node, frame: Frame, types: Sequence[Type]
) -> Value:
    return unknown("an environment variable")
