"""Objects: what declarations make, of plain types, containers, aggregates and classes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from nodl.infer.cpp.reading.type_names import NO_TYPE
from nodl.infer.cpp.running.contents import copied
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import BOTTOM, Group, Map, Obj, Seq, Value, literal, unknown
from nodl.infer.cpp.syntax import children, text

if TYPE_CHECKING:
    from tree_sitter import Node

    from nodl.infer.cpp.reading.declarations import Class
    from nodl.infer.cpp.reading.type_names import Type


SEQUENCES = frozenset({
    "std::vector", "std::array", "std::list", "std::deque", "std::set", "std::unordered_set", "std::initializer_list",
    "vector", "std::multiset", "std::queue", "std::stack",
})  # fmt: skip
MAPS = frozenset({"std::map", "std::unordered_map", "std::multimap", "map"})
_TEXTS = frozenset(
    {
        "std::string",
        "string",
        "std::string_view",
        "std::stringstream",
        "std::ostringstream",
        "std::filesystem::path",
    }
)
_SCALARS = frozenset({
    "bool", "int", "float", "double", "char", "size_t", "std::size_t", "unsigned", "long", "short", "auto",
    "uint8_t", "uint16_t", "uint32_t", "uint64_t", "int8_t", "int16_t", "int32_t", "int64_t", "unsigned int",
    "std::atomic_bool", "std::chrono::milliseconds", "std::chrono::seconds",
})  # fmt: skip


def is_plain_type(name: str) -> bool:
    """A text, number or container."""
    return name in SEQUENCES or name in MAPS or name in _TEXTS or name in _SCALARS


def declared_value(
    run: Machine, node: Node, written: str, value: Node | None, pointer: bool, frame: Frame
) -> Value:
    """What ``T x``, ``T x = v``, ``T x(v)``, ``T x{v}`` makes."""
    kind = run.type_of(written, frame)
    if value is None:
        return BOTTOM if pointer or kind.pointer else default_value(run, node, kind, frame)
    if pointer or kind.pointer or _is_auto(written) or kind.name in _SCALARS:
        return initial_value(run, value, frame, pointer or (_is_auto(written) and "&" in written))
    if value.type not in ("argument_list", "initializer_list"):
        found = copied(run, run.evaluate(value, frame), node, frame)
        return converted(run, kind, found, node, frame)
    return made(run, node, kind, children(value), frame)


def _is_auto(written: str) -> bool:
    return "auto" in written.split() or written.startswith("decltype")


def initial_value(run: Machine, value: Node, frame: Frame, reference: bool = False) -> Value:
    if value.type in ("argument_list", "initializer_list"):
        inner = children(value)
        if len(inner) == 1:
            return run.evaluate(inner[0], frame)
        return BOTTOM if not inner else run.evaluate(value, frame)
    found = run.evaluate(value, frame)
    return found if reference else copied(run, found, value, frame)


def converted(run: Machine, kind: Type, value: Value, node: Node, frame: Frame) -> Value:
    """``Foo x = y``: the object itself, or a Foo made of y."""
    from nodl.infer.cpp.running.constructors import construct

    cls = run.names.class_of(kind, frame.scope, frame.file)
    if cls is None or any(isinstance(atom, Obj) for atom in value):
        return value
    if any(isinstance(atom, Seq | Group) for atom in value) or not run.names.find_methods(cls, cls.name):
        return value
    return construct(run, kind, [value], node, frame)


def made(run: Machine, node: Node, kind: Type, given: Sequence[Node], frame: Frame) -> Value:
    """An object of ``kind`` from arguments in parentheses or braces."""
    from nodl.infer.cpp.running.constructors import construct

    cls = run.names.class_of(kind, frame.scope, frame.file)
    if cls is None and kind.name in SEQUENCES:
        items = [run.evaluate(each, frame) for each in given]
        if (
            len(given) == 1
            and given[0].type != "initializer_list"
            and any(isinstance(a, Seq) for a in items[0])
        ):
            return items[0]
        if (
            node.type == "declaration"
            and any(
                c.type == "init_declarator" and text(c).rstrip().endswith(")") for c in node.named_children
            )
            and len(given) == 2
        ):
            return (Seq((items[1],), open=True),)
        return (Seq(tuple(items)),)
    if cls is None and kind.name in MAPS:
        return as_map([run.evaluate(each, frame) for each in given])
    if cls is None and (kind.name in _TEXTS or kind.name in _SCALARS or kind.last in run.names.enums):
        return run.evaluate(given[0], frame) if given else default_value(run, node, kind, frame)
    if cls is not None and is_aggregate(run, cls) and given:
        return _aggregate(run, node, kind, cls, given, frame)
    values = [run.evaluate(each, frame) for each in given]
    if cls is None and len(values) == 1 and _all_of(kind, values[0]):
        return values[0]  # a copy of a library's object
    return construct(run, kind, values, node, frame)


def _all_of(kind: Type, value: Value) -> bool:
    return bool(value) and all(isinstance(atom, Obj) and atom.type.name == kind.name for atom in value)


def as_map(items: Sequence[Value]) -> Value:
    entries = []
    for value in items:
        for atom in value:
            if isinstance(atom, Group | Seq) and len(atom.items) == 2:
                entries.append((atom.items[0], atom.items[1]))
            elif isinstance(atom, Map):
                return value
            else:
                return unknown("entries of a map")
    return (Map(tuple(entries)),)


def is_aggregate(run: Machine, cls: Class) -> bool:
    return not run.names.find_methods(cls, cls.name) and cls.name not in cls.declared


def _aggregate(
    run: Machine, node: Node, kind: Type, cls: Class, given: Sequence[Node], frame: Frame
) -> Value:
    from nodl.infer.cpp.running.constructors import class_frame, construct

    (made_object,) = construct(run, kind, [], node, frame)
    names = [f.name for f in cls.fields.values() if not f.static]
    for position, item in enumerate(given):
        name, value = names[position] if position < len(names) else "", item
        if item.type == "initializer_pair":
            designator = item.child_by_field_name("designator")
            name, value = text(designator).lstrip("."), item.child_by_field_name("value") or item
        if name:
            member = cls.fields.get(name)
            inner = run.type_of(member.type, class_frame(run, made_object, cls, frame)) if member else NO_TYPE
            given_value = (
                made(run, value, inner, children(value), frame)
                if value.type == "initializer_list" and inner.name
                else run.evaluate(value, frame)
            )
            run.store.set((made_object, name), given_value)
    return (made_object,)


def default_value(run: Machine, node: Node, kind: Type, frame: Frame) -> Value:
    """What a declaration without initial value holds."""
    from nodl.infer.cpp.running.constructors import construct

    if kind.name in _TEXTS:
        return literal("")
    if kind.name in SEQUENCES:
        return (Seq(()),)
    if kind.name in MAPS:
        return (Map(()),)
    if kind.name in _SCALARS or not kind.name or kind.last in run.names.enums:
        return unknown("a value that is not set")
    if kind.name in ("std::function", "std::pair", "std::tuple", "std::mutex"):
        return BOTTOM
    return construct(run, kind, [], node, frame)
