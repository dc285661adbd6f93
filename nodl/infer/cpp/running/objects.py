"""Objects: what declarations make, of plain types, containers, aggregates and classes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from nodl.infer.cpp.reading.declarations import Class
from nodl.infer.cpp.reading.type_names import NO_TYPE, Type
from nodl.infer.cpp.running.arithmetic import as_type
from nodl.infer.cpp.running.contents import copied, elements_copied, items_of
from nodl.infer.cpp.running.hiding import seen_type
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.references import keep_references
from nodl.infer.cpp.running.values import (
    BOTTOM,
    END,
    Const,
    Group,
    Map,
    Obj,
    Seq,
    Text,
    Unknown,
    Value,
    literal,
    open_sequence,
    plain,
    unknown,
)
from nodl.infer.cpp.syntax import Node, children, field_of, text

SEQUENCES = frozenset({
    "std::vector", "std::array", "std::list", "std::deque", "std::set", "std::unordered_set", "std::initializer_list",
    "vector", "std::multiset", "std::queue", "std::stack",
})  # fmt: skip
SETS = frozenset({"std::set", "std::unordered_set", "set"})
ORDERED = frozenset({*SETS, "std::multiset", "std::priority_queue"})
MAPS = frozenset({"std::map", "std::unordered_map", "std::multimap", "map"})
_TEXTS = frozenset({
    "std::string", "string", "std::string_view", "std::stringstream", "std::ostringstream", "std::filesystem::path",
})  # fmt: skip
_SCALARS = frozenset({
    "bool", "int", "float", "double", "char", "size_t", "std::size_t", "unsigned", "long", "short", "auto",
    "uint8_t", "uint16_t", "uint32_t", "uint64_t", "int8_t", "int16_t", "int32_t", "int64_t", "unsigned int",
    "std::atomic_bool", "std::chrono::milliseconds", "std::chrono::seconds",
})  # fmt: skip


MAX_ELEMENTS = 32
"""Of a list that is made with so many elements; of longer ones one element stands for all."""


def is_plain_type(name: str) -> bool:
    """Return whether it is a text, number or container."""
    return name in SEQUENCES or name in MAPS or name in _TEXTS or name in _SCALARS


def declared_value(
    run: Machine, node: Node, written: str, value: Node | None, pointer: bool, frame: Frame
) -> Value:
    """Return what ``T x``, ``T x = v``, ``T x(v)``, ``T x{v}`` makes."""
    kind = run.type_of(written, frame)
    if value is None:
        return BOTTOM if pointer or kind.pointer else default_value(run, node, kind, frame)
    if pointer or kind.pointer or _is_auto(written) or kind.name in _SCALARS:
        by_reference = pointer or (kind.pointer and "optional" not in written)
        found = initial_value(run, value, frame, by_reference or (_is_auto(written) and "&" in written))
        if "optional" in written and not pointer:
            found = copied(run, found, node, frame, run.class_of(kind, frame))
        return found if pointer or kind.pointer else as_type(kind.name, found)
    if value.type not in ("argument_list", "initializer_list"):
        return converted(run, kind, run.evaluate(value, frame), node, frame)
    return made(run, node, kind, children(value), frame)


def _is_auto(written: str) -> bool:
    return "auto" in written.split() or written.startswith("decltype")


def initial_value(run: Machine, value: Node, frame: Frame, reference: bool = False) -> Value:
    """Return what ``= v`` (copied unless ``reference``), ``(v)`` or ``{v}`` gives; ``BOTTOM`` for empty brackets."""
    if value.type in ("argument_list", "initializer_list"):
        inner = children(value)
        if len(inner) == 1:
            return initial_value(run, inner[0], frame, reference)
        return BOTTOM if not inner else run.evaluate(value, frame)
    found = run.evaluate(value, frame)
    if reference or _gives_iterator(value):
        return found
    if any(isinstance(atom, Seq | Map) for atom in found):
        return elements_copied(run, seen_type(run, value, frame), found, value, frame)
    return copied(run, found, value, frame)


def _gives_iterator(value: Node) -> bool:
    """Return whether it is ``x.find(...)`` or ``std::find_if(...)``: the element itself, seen through an iterator."""
    callee = text(field_of(value, "function")) if value.type == "call_expression" else ""
    return _ITERATORS.search(callee) is not None


_ITERATORS = re.compile(
    r"(?:^std::|[.>])(?:ranges::)?(?:c?r?(?:begin|end)|find\w*|(?:lower|upper|equal)_\w+|(?:min|max)_element|next|prev)$"
)


def converted(run: Machine, kind: Type, value: Value, node: Node, frame: Frame) -> Value:
    """Convert ``Foo x = y``: a copy of an object, as a Foo, or a Foo made of y."""
    from nodl.infer.cpp.running.constructors import construct

    cls = run.class_of(kind, frame)
    if cls is None or any(isinstance(atom, Obj) for atom in value):
        return copied(run, value, node, frame, cls)
    if any(isinstance(atom, Seq | Group) for atom in value) or not run.names.find_methods(cls, cls.name):
        return value
    return construct(run, kind, [value], node, frame)


def made(run: Machine, node: Node, kind: Type, given: Sequence[Node], frame: Frame) -> Value:
    """Make an object of ``kind`` from arguments in parentheses or braces."""
    from nodl.infer.cpp.running.constructors import construct

    cls = run.class_of(kind, frame)
    if cls is None and kind.name in SEQUENCES:
        return _sequence(run, node, kind, given, frame)
    if cls is None and kind.name in MAPS:
        return as_map([run.evaluate(each, frame) for each in given])
    if cls is None and (kind.name in _TEXTS or kind.name in _SCALARS or kind.last in run.names.enums):
        if not given:
            return default_value(run, node, kind, frame)
        if kind.name in _TEXTS:
            return text_of(run, [run.evaluate(each, frame) for each in given])
        return as_type(kind.name, run.evaluate(given[0], frame))
    values: list[Value] | None = None
    if cls is not None and len(given) == 1 and not given[0].type.startswith("initializer_"):
        values = [run.evaluate(given[0], frame)]
        if _copies(run, cls, values[0]):
            return copied(run, values[0], node, frame, cls)
    if cls is not None and is_aggregate(run, cls) and given:
        found = _aggregate(run, node, kind, cls, given, frame, values)
        keep_references(run, found, given, frame)
        return found
    values = values or [run.evaluate(each, frame) for each in given]
    if cls is None and len(values) == 1 and _all_of(kind, values[0]):
        return values[0]  # a copy of a library's object
    found = construct(run, kind, values, node, frame)
    keep_references(run, found, given, frame)
    return found


def in_braces(run: Machine, value: Node, kind: Type, frame: Frame) -> Value:
    """Return what braces make of a type that is known; of anything else its value."""
    if value.type == "initializer_list" and kind.name:
        return made(run, value, kind, children(value), frame)
    return run.evaluate(value, frame)


def _sequence(run: Machine, node: Node, kind: Type, given: Sequence[Node], frame: Frame) -> Value:
    """Make a list: in braces its elements; in parentheses a copy, a part of another one, or so many equal elements."""
    inner = kind.arguments[0] if kind.arguments else NO_TYPE
    cls = run.held_class(inner, frame)
    items = [
        made(run, each, inner, children(each), frame)
        if cls is not None and each.type == "initializer_list"
        else run.evaluate(each, frame)
        if inner.pointer
        else copied(run, run.evaluate(each, frame), each, frame, cls)
        for each in given
    ]
    if len(given) == 1 and given[0].type != "initializer_list" and any(isinstance(a, Seq) for a in items[0]):
        return items[0]
    parent = given[0].parent if given else None
    if parent is None or parent.type != "argument_list":
        return (as_set(items) if kind.name in SETS else Seq(tuple(items)),)
    if len(items) > 1 and END in items[1]:
        parts = [items_of(run, atom) for atom in items[0]]
        listed = [item for part, _ in parts for item in part]
        return (Seq(tuple(listed)) if len(parts) == 1 and parts[0][1] else open_sequence(listed),)
    count = items[0][0] if len(items[0]) == 1 else None
    return _repeated(run, node, inner, count, frame, items[1] if len(items) > 1 else None)


def _repeated(
    run: Machine, node: Node, inner: Type, count: object, frame: Frame, value: Value | None = None
) -> Value:
    """Return so many elements of type ``inner``: each its own object, or one for all if that is not known."""
    if isinstance(count, int) and 0 <= count <= MAX_ELEMENTS:
        made_ones = []
        for index in range(count):
            of_one = replace(frame, path=(*frame.path, index))
            made_ones.append(_element(run, node, inner, of_one, value))
        return (Seq(tuple(made_ones)),)
    run.repeated += 1
    one = _element(run, node, inner, frame, value)
    run.repeated -= 1
    return (open_sequence((one,)),)


def _element(run: Machine, node: Node, inner: Type, frame: Frame, value: Value | None) -> Value:
    if value is not None:
        return copied(run, value, node, frame, run.held_class(inner, frame))
    return default_value(run, node, inner, frame) if inner.name and not inner.pointer else BOTTOM


def as_set(items: Sequence[Value]) -> Seq:
    """Return each element once, in order; in any order, any number of times if one is not a known text."""
    known = [plain(item[0]) if len(item) == 1 and isinstance(item[0], Text) else None for item in items]
    by_text = {text: item for text, item in zip(known, items, strict=True) if text is not None}
    return open_sequence(items) if None in known else Seq(tuple(by_text[text] for text in sorted(by_text)))


def cast(run: Machine, kind: Type, value: Value) -> Value:
    """Evaluate ``static_cast<T>(x)``: a number as T holds it, the enumerator of a number, else the object itself."""
    if kind.last not in run.names.enums:
        return as_type(kind.name, value)
    numbers = run.names.enumerator_numbers
    owner = f"::{kind.last}::"
    found: list[object] = []
    for atom in value:
        same = [full for full, each in numbers.items() if each == atom and owner in f"::{full}"]
        if isinstance(atom, int) and same:
            found.append(Const(same[0], atom))
        else:
            found.append(atom if isinstance(atom, Const) else Unknown("an enumerator"))
    return tuple(found)


def text_of(run: Machine, values: Sequence[Value]) -> Value:
    """Make ``std::string(...)`` of a text, of so many letters, of a part of a text.

    Two letters in braces look the same.
    """
    if len(values) == 1:
        is_made = any(isinstance(atom, int | float | Seq) for atom in values[0])
        return unknown("a made text") if is_made else values[0]
    return unknown("a text made of several values")


def _copies(run: Machine, cls: Class, value: Value) -> bool:
    """Return whether an object of the class, or of a derived one, is all that a constructor gets."""
    derived = all(isinstance(atom, Obj) and cls in run.names.ancestry(atom.cls) for atom in value)
    return bool(value) and derived and cls.name not in run.names.methods[cls]


def _all_of(kind: Type, value: Value) -> bool:
    return bool(value) and all(isinstance(atom, Obj) and atom.type.name == kind.name for atom in value)


def as_map(items: Sequence[Value]) -> Value:
    """Return a map with these pairs as entries; a map among them comes back as it is, all else gives an unknown."""
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
    """Return whether braces fill its fields: the class has neither bases nor constructors."""
    return not (cls.bases or run.names.find_methods(cls, cls.name) or cls.name in cls.declared)


def fields_of(cls: Class) -> list[str]:
    """Return the members that braces fill, in order."""
    return [each.name for each in cls.fields.values() if not each.static]


def _aggregate(
    run: Machine,
    node: Node,
    kind: Type,
    cls: Class,
    given: Sequence[Node],
    frame: Frame,
    values: list[Value] | None,
) -> Value:
    """Make an object whose fields braces fill; ``values``: what was given, if that ran already."""
    from nodl.infer.cpp.running.constructors import construct

    names = fields_of(cls)
    bindings = run.names.specialisations.bindings(cls, kind)
    members: dict[str, Value] = {}
    for position, item in enumerate(given):
        name, value = names[position] if position < len(names) else "", item
        if item.type == "initializer_pair":
            designator = field_of(item, "designator")
            name, value = text(designator).lstrip("."), field_of(item, "value") or item
        if name:
            member = cls.fields.get(name)
            inner = run.names.resolve(member.type, cls.scope, cls.file, bindings) if member else NO_TYPE
            members[name] = values[position] if values else in_braces(run, value, inner, frame)
    return construct(run, kind, [], node, frame, members=members)


def default_value(run: Machine, node: Node, kind: Type, frame: Frame) -> Value:
    """Return what a declaration without initial value holds."""
    from nodl.infer.cpp.running.constructors import construct

    if kind.name in _TEXTS:
        return literal("")
    if kind.name == "std::array" and kind.arguments and not kind.arguments[0].pointer:
        size = kind.arguments[1].name if len(kind.arguments) > 1 else ""
        return _repeated(run, node, kind.arguments[0], int(size) if size.isdigit() else None, frame)
    if kind.name in SEQUENCES:
        return (Seq(()),)
    if kind.name in MAPS:
        return (Map(()),)
    if kind.name in _SCALARS or not kind.name or kind.last in run.names.enums:
        return unknown("a value that is not set")
    if kind.name in ("std::function", "std::pair", "std::tuple", "std::mutex"):
        return BOTTOM
    return construct(run, kind, [], node, frame)
