"""How objects and other values come into being: constructors, members, first values, conversions, copies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from enclave_addons.inference.cpp.engine.frames import Frame
from enclave_addons.inference.cpp.engine.machine import MAX_DEPTH, Machine
from enclave_addons.inference.cpp.engine.overloads import candidates
from enclave_addons.inference.cpp.engine.places import local
from enclave_addons.inference.cpp.engine.values import (
    NULL,
    Atom,
    Bound,
    Group,
    Lambda,
    Map,
    Obj,
    Param,
    Place,
    Seq,
    Text,
    Value,
    join,
    literal,
    nodes_in,
    only,
    unknown,
)
from enclave_addons.inference.cpp.libraries import LIBRARY_CLASSES, Call, is_harmless_class
from enclave_addons.inference.cpp.reading.declarations import Class, Field, Function, Global
from enclave_addons.inference.cpp.reading.known_headers import ROS_LIBRARIES
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.syntax import Node, children, text

LISTS = frozenset({
    "std::vector", "std::list", "std::deque", "std::set", "std::unordered_set", "std::array", "std::queue",
    "std::stack", "std::initializer_list", "std::multiset", "std::span", "std::forward_list",
    "std::priority_queue", "std::valarray",
})  # fmt: skip
MAPS = frozenset({"std::map", "std::unordered_map", "std::multimap", "std::unordered_multimap"})
GROUPS = frozenset({"std::pair", "std::tuple"})
TEXTS = frozenset({
    "std::string", "std::string_view", "std::stringstream", "std::ostringstream", "std::filesystem::path", "fs::path",
    "std::istringstream", "QString",
})  # fmt: skip
_NUMBERS = frozenset({
    "int", "double", "float", "bool", "char", "long", "short", "unsigned", "size_t", "std::size_t", "unsigned int",
    "long long", "unsigned long", "unsigned char", "std::atomic",
})  # fmt: skip
THREADS = frozenset({"std::thread", "std::jthread", "boost::thread"})
_NODE_LIKE = ("Node", "LifecycleNode")
_CONTEXTS = ("rclcpp::NodeOptions", "rclcpp::Context", "rclcpp::Executor")


def is_number(name: str) -> bool:
    """Return whether a type is one of numbers."""
    last = name.removeprefix("std::")
    return name in _NUMBERS or (last.endswith("_t") and last[:3] in ("int", "uin"))


def library_call(
    node: Node,
    frame: Frame,
    values: Sequence[Value],
    types: Sequence[Type],
    given: Sequence[Node],
    this: Obj | None,
) -> Call:
    """Return a call as models of libraries get it: braces are lists."""
    listed = [tuple(Seq(a.items) if isinstance(a, Group) else a for a in value) for value in values]
    return Call(node, frame, listed, types, given, this)


# --- constructors -------------------------------------------------------------------------------------------------


def construct(
    run: Machine, kind: Type, values: Sequence[Value], node: Node, frame: Frame, *, heap: bool = False,
    given: Sequence[Node] = (), key: object = None,
) -> Value:  # fmt: skip
    """Make an object of a class, or another value of a type, of these arguments."""
    cls = run.class_of(kind, frame)
    run.handle(node, frame)
    if cls is None:
        return _foreign(run, kind, values, node, frame, heap, given)
    name = key or (node.start_byte, frame.file.file, frame.path, cls)
    obj = run.object(name, kind, cls, heap=heap)
    if frame.this is not None and frame.this.several:
        obj.several = True
    initialise(run, obj, cls, run.names.bindings(cls, kind), values, node, frame, given)
    return (obj,)


def initialise(
    run: Machine, obj: Obj, cls: Class, bindings: dict[str, Type], values: Sequence[Value], node: Node, frame: Frame,
    given: Sequence[Node] = (),
) -> None:  # fmt: skip
    """Run the constructor of a class on an object, after those of its bases and the values of its members."""
    if len(run.active) > MAX_DEPTH or (obj, cls) in run.active:
        run.lost(node, frame)
        return
    obj.bindings[cls] = {**obj.bindings.get(cls, {}), **bindings}
    constructors = run.names.methods[cls].get(cls.name, [])
    fitting = candidates(constructors, values) if constructors else ()
    declared = any(each.parameters for each in cls.declared.get(cls.name, ()))
    if (
        len(values) == 1
        and not fitting
        and (same := [a for a in values[0] if isinstance(a, Obj) and a.cls is cls])
    ):
        copy_members(run, same, obj, node, frame)
        return
    if not fitting:
        inner = Frame(
            cls.file, cls.scope, None, obj, obj.bindings[cls], run.path(frame.path, node.start_byte, cls)
        )
        run.active.append((obj, cls))
        _bases(run, obj, cls, {}, inner, values if cls.inherits_constructors else (), node)
        run.active.pop()
        _members(run, obj, cls, {}, inner, () if constructors or declared else values)
        if values and declared:
            unreached(run, f"{cls.name}::{cls.name}", values, node, frame)
        return

    def constructed(each: Function) -> Value:
        return run.calls.invoke(run, each, obj, values, node, frame, (), given)

    run.each_way(constructed, fitting[:3])


def before_body(run: Machine, constructor: Function, obj: Obj, frame: Frame, node: Node) -> None:
    """Run what a constructor does before its body: bases, then members, by its list or by their declarations."""
    cls = next(
        (c for c in run.names.ancestry(obj.cls) if constructor in run.names.methods[c].get(c.name, ())), None
    )
    if cls is None:
        return
    listed = {name.partition("<")[0]: given for name, given in constructor.initialisers}
    if cls.name in listed and cls.name not in cls.fields:  # it delegates
        given = arguments(listed[cls.name])
        values = [run.evaluate(each, frame) for each in given]
        initialise(run, obj, cls, dict(obj.bindings.get(cls, {})), values, listed[cls.name], frame, given)
        return
    _bases(run, obj, cls, listed, frame, (), node)
    _members(run, obj, cls, listed, frame, ())


def arguments(node: Node | None) -> list[Node]:
    """Return the expressions between the parentheses or braces of a call or initialiser."""
    if node is None:
        return []
    return children(node) if node.type in ("argument_list", "initializer_list") else [node]


def _bases(
    run: Machine,
    obj: Obj,
    cls: Class,
    listed: dict[str, Node],
    frame: Frame,
    inherited: Sequence[Value],
    node: Node,
) -> None:
    for written, base in run.names.bases(cls):
        last = written.partition("<")[0].rpartition("::")[2].strip()
        at = next((given for name, given in listed.items() if name.rpartition("::")[2] == last), None)
        kind = run.names.resolve(written, cls.scope, cls.file, obj.bindings.get(cls))
        given = arguments(at)
        values = [run.evaluate(each, frame) for each in given] if at is not None else list(inherited)
        if at is not None:
            run.handle(at.parent or at, frame)
        if base is not None:
            initialise(run, obj, base, run.names.bindings(base, kind), values, at or node, frame, given)
            continue
        obj.foreign_base = obj.foreign_base or kind.name
        model = LIBRARY_CLASSES.get(kind.name)
        if model is not None:
            model(run, library_call(at or node, frame, values, kind.arguments, given, obj))
        elif not is_harmless_class(kind.name):
            unreached(run, kind.name, values, at or node, frame, of_node=kind.last.endswith(_NODE_LIKE))


def _members(
    run: Machine, obj: Obj, cls: Class, listed: dict[str, Node], frame: Frame, aggregate: Sequence[Value]
) -> None:
    place = 0
    for name, member in cls.fields.items():
        if member.static:
            continue
        given = listed.get(name)
        if given is not None:
            value = value_of(run, member.type, member.pointer, given, frame, cls, obj, member.node)
        elif place < len(aggregate):
            value = converted(run, aggregate[place], _type_of(run, member, cls, obj), member.node, frame)
        else:
            value = value_of(run, member.type, member.pointer, member.default, frame, cls, obj, member.node)
        place += 1
        before = run.store.get((obj, name))
        run.store.set((obj, name), join(before, value) if obj.several else value)


def _type_of(run: Machine, member: Field, cls: Class, obj: Obj) -> Type:
    found = run.names.resolve(member.type, cls.scope, cls.file, obj.bindings.get(cls))
    return found._replace(pointer=found.pointer or member.pointer)


def value_of(
    run: Machine, written: str, pointer: bool, given: Node | None, frame: Frame, cls: Class | None, obj: Obj | None,
    node: Node,
) -> Value:  # fmt: skip
    """Return what a variable of this type holds that is declared with ``given``: arguments, a value, or nothing."""
    if cls is not None and obj is not None:
        kind = run.names.resolve(written, cls.scope, cls.file, obj.bindings.get(cls))
    else:
        kind = run.type_of(written, frame)
    kind = kind._replace(pointer=kind.pointer or pointer)
    if given is None:
        return default_of(run, kind, node, frame)
    if given.type not in ("argument_list", "initializer_list"):
        found = run.evaluate(given, frame)
        behind = given.type == "pointer_expression" and text(given).startswith("*")
        is_address = (
            (given.type == "pointer_expression" and not behind)
            or kind.pointer
            or written.rstrip().endswith("&")
        )
        copy = found if is_address else copied(run, found, given, frame, behind=behind)
        return converted(run, copy, kind, given, frame)
    listed = children(given)
    values = [run.evaluate(each, frame) for each in listed]
    run.handle(given.parent or given, frame)
    return made_of(run, kind, values, listed, given, frame, braces=given.type == "initializer_list")


def made_of(
    run: Machine,
    kind: Type,
    values: Sequence[Value],
    listed: Sequence[Node],
    node: Node,
    frame: Frame,
    *,
    braces: bool,
) -> Value:
    """Return ``T(values)`` or ``T{values}``."""
    if not listed:
        return default_of(run, kind._replace(pointer=kind.pointer), node, frame)
    if kind.pointer or is_number(kind.name) or kind.name in ("", "auto"):
        return values[0]
    if len(kind.name) == 1 and run.class_of(kind, frame) is None:
        return values[0]  # a template's parameter
    if kind.name in TEXTS or kind.name == "std::function":
        return values[0] if len(values) == 1 else unknown("a text made of several arguments")
    if kind.name in LISTS | MAPS | GROUPS:
        is_copy = len(values) == 1 and any(isinstance(a, Seq | Map | Param) for a in values[0])
        if is_copy and kind.name not in GROUPS:
            return copied(run, values[0], node, frame)
        if braces or kind.name in GROUPS:
            return converted(run, (Group(tuple(values)),), kind, node, frame)
        count = only(values[0])
        if isinstance(count, int) and not isinstance(count, bool) and 0 <= count <= 64:
            kind_of = kind.arguments[0] if kind.arguments else Type("")
            if len(values) > 1:
                return (Seq((values[1],) * count),)
            return (Seq(several_of(run, kind_of, count, node, frame)),)
        if len(values) == 1 and any(isinstance(a, Group) for a in values[0]):
            return converted(run, values[0], kind, node, frame)
        return unknown("a list that is made of something that is not known")
    same = [a for v in values[:1] for a in v if isinstance(a, Obj) and a.type.name == kind.name]
    if len(values) == 1 and same and len(same) == len(values[0]):
        return copied(run, values[0], node, frame)
    return construct(run, kind, values, node, frame, given=listed)


def several_of(run: Machine, kind: Type, count: int, node: Node, frame: Frame) -> tuple[Value, ...]:
    """Return the first values of so many elements of a list."""
    return tuple(
        default_of(run, kind, node, replace(frame, path=run.path(frame.path, "element", index)))
        for index in range(count)
    )


def default_of(run: Machine, kind: Type, node: Node, frame: Frame) -> Value:
    """Return what a variable of this type holds that is not initialised."""
    if kind.pointer:
        return (NULL,)
    if kind.name in TEXTS:
        return literal("")
    if kind.name in LISTS:
        if kind.name == "std::array" and len(kind.arguments) > 1 and kind.arguments[1].name.isdigit():
            count = int(kind.arguments[1].name)
            if count <= 32:
                return (Seq(several_of(run, kind.arguments[0], count, node, frame)),)
        return (Seq((), open=kind.name == "std::array"),)
    if kind.name in MAPS:
        return (Map(()),)
    if kind.name in GROUPS:
        return (Group(tuple(default_of(run, each, node, frame) for each in kind.arguments)),)
    if is_number(kind.name):
        return unknown("a number that is not initialised")
    if kind.name in ("std::function", "std::thread", "std::any", "std::variant"):
        return (NULL,)
    if run.class_of(kind, frame) is not None or kind.name in LIBRARY_CLASSES:
        return construct(run, kind, [], node, frame)
    if not kind.name or kind.name in ("auto", "void") or "::" not in kind.name:
        return unknown(f"a {kind.name or 'value'} that is not initialised")
    return (run.object((node.start_byte, frame.file.file, frame.path, kind.name), kind),)


def _foreign(
    run: Machine,
    kind: Type,
    values: Sequence[Value],
    node: Node,
    frame: Frame,
    heap: bool,
    given: Sequence[Node],
) -> Value:
    """Make an object of a class whose source is not in reach: by its model, else what it makes is a gap if it gets a
    node."""
    if (
        kind.name in TEXTS | LISTS | MAPS | GROUPS
        or is_number(kind.name)
        or kind.name in ("std::function", "auto")
    ):
        return made_of(run, kind._replace(pointer=False), values, list(given) or [node] * len(values), node, frame,
                       braces=False)  # fmt: skip
    obj = run.object((node.start_byte, frame.file.file, frame.path, kind.name), kind, heap=heap)
    model = LIBRARY_CLASSES.get(kind.name)
    if model is not None:
        found = model(run, library_call(node, frame, values, kind.arguments, given, obj))
        return found if found is not None else (obj,)
    if kind.name in THREADS and values:
        run.later([bound_to(values)])
        return (obj,)
    if is_harmless_class(kind.name):
        run.later(values)
        holders = [each for value in values for each in nodes_in(value)]
        if kind.name.startswith("rclcpp") and holders:
            obj.node = holders[0].node
        return (obj,)
    ours = kind.name.partition("::")[0] in ROS_LIBRARIES and (bool(values) or heap)
    unreached(run, kind.name, values, node, frame, of_node=ours or kind.last.endswith(_NODE_LIKE))
    return (obj,)


def bound_to(values: Sequence[Value]) -> Value:
    """Return a function that a thread calls, with its arguments."""
    rest = tuple(values[1:])
    found: list[Atom] = []
    for atom in values[0]:
        objects = [a for a in rest[0] if isinstance(a, Obj)] if rest else []
        if isinstance(atom, Bound) and objects and atom.function.owner and not atom.function.static:
            found += [Bound(atom.function, each, rest[1:]) for each in objects]
        else:
            found.append(Bound(atom.function, atom.this, rest) if isinstance(atom, Bound) else atom)
    return tuple(found)


def unreached(
    run: Machine, name: str, values: Sequence[Value], node: Node, frame: Frame, *, of_node: bool = False
) -> None:
    """Say that code which is not in reach gets a node, a context or an executor, or is a node: it may make
    interfaces."""
    owner = next((each for value in values for each in nodes_in(value)), None)
    context = any(isinstance(atom, Obj) and atom.type.name in _CONTEXTS for value in values for atom in value)
    if owner is not None:
        run.gap(node, frame, f"the node is handed to {name}, which may make interfaces on it", owner.node)
    elif context or of_node:
        run.gap(node, frame, f"the class {name} is not in reach: it may be a node or make one")
    run.later(values)


# --- conversions and copies -----------------------------------------------------------------------------------------


def converted(run: Machine, value: Value, kind: Type, node: Node, frame: Frame) -> Value:
    """Return a value as a variable of this type holds it: a braced list becomes a list, map or object."""
    if not any(isinstance(atom, Group | Text | Seq | Lambda) for atom in value):
        return value
    return join(*(_converted(run, atom, kind, node, frame) for atom in value))


def _converted(run: Machine, atom: Atom, kind: Type, node: Node, frame: Frame) -> Value:
    item = kind.arguments[0] if kind.arguments else Type("")
    if isinstance(atom, Group):
        if kind.name in LISTS:
            return (Seq(tuple(converted(run, each, item, node, frame) for each in atom.items)),)
        if kind.name in MAPS:
            return (_as_map(run, atom, kind, node, frame),)
        if kind.name in GROUPS and kind.arguments:
            pairs = zip(atom.items, (*kind.arguments, *[Type("")] * len(atom.items)), strict=False)
            return (Group(tuple(converted(run, each, part, node, frame) for each, part in pairs)),)
        if kind.pointer:
            return atom.items[0] if atom.items else (NULL,)
        if kind.name in TEXTS or is_number(kind.name):
            return atom.items[0] if atom.items else default_of(run, kind, node, frame)
        if run.class_of(kind, frame) is not None or kind.name in LIBRARY_CLASSES:
            path = replace(frame, path=run.path(frame.path, atom.items))
            return construct(run, kind, list(atom.items), node, path)
        return (atom,)
    if isinstance(atom, Text | Lambda) and not kind.pointer and kind.name not in TEXTS:
        cls = run.class_of(kind, frame)
        if cls is not None and candidates(run.names.methods[cls].get(cls.name, ()), [(atom,)]):
            return construct(run, kind, [(atom,)], node, frame)
    return (atom,)


def _as_map(run: Machine, atom: Group, kind: Type, node: Node, frame: Frame) -> Map:
    value_type = kind.arguments[1] if len(kind.arguments) > 1 else Type("")
    entries: dict[Value, Value] = {}
    is_open = False
    for each in atom.items:
        pair = only(each)
        if isinstance(pair, Group) and len(pair.items) == 2:
            entries[pair.items[0]] = converted(run, pair.items[1], value_type, node, frame)
        else:
            is_open = True
    return Map(tuple(entries.items()), is_open)


def copied(run: Machine, value: Value, node: Node, frame: Frame, *, behind: bool = False) -> Value:
    """Copy structures by value, also those in lists; nodes and all else stay who they are.

    What is on the heap is copied only from ``behind`` a pointer.
    """
    if not any(isinstance(atom, Obj | Seq | Map) for atom in value):
        return value
    return tuple(_copied(run, atom, node, frame, behind) for atom in value)


def _copied(run: Machine, atom: Atom, node: Node, frame: Frame, behind: bool) -> Atom:
    if isinstance(atom, Seq):
        items = tuple(copied(run, each, node, frame) for each in atom.items)
        return atom._replace(items=items)
    if isinstance(atom, Map):
        return atom._replace(
            entries=tuple((key, copied(run, each, node, frame)) for key, each in atom.entries)
        )
    if not isinstance(atom, Obj) or atom.cls is None or atom.node is not None or (atom.heap and not behind):
        return atom
    copy = run.object((node.start_byte, frame.file.file, frame.path, "copy", atom), atom.type, atom.cls)
    copy.bindings, copy.foreign_base = atom.bindings, atom.foreign_base
    copy_members(run, [atom], copy, node, frame)
    return copy


def copy_members(run: Machine, sources: Sequence[Obj], target: Obj, node: Node, frame: Frame) -> None:
    """Set the members of an object to those of others."""
    for cls in run.names.ancestry(target.cls):
        for name, member in cls.fields.items():
            if not member.static:
                held = join(*(run.store.get((each, name)) for each in sources))
                held = held if member.pointer else copied(run, held, node, frame)
                before = run.store.get((target, name))
                run.store.set((target, name), join(before, held) if target.several else held)


def initial_value(run: Machine, variable: Global, frame: Frame) -> Value:
    """Return what a global variable or static member holds before main."""
    frame.path = run.path("global", variable.file.file, variable.node.start_byte)
    return value_of(run, variable.type, variable.pointer, variable.value, frame, None, None, variable.node)


def declare(
    run: Machine, name: str, written: str, pointer: bool, given: Node | None, node: Node, frame: Frame
) -> Place:
    """Declare a variable of a function, with its first value."""
    value = value_of(run, written, pointer, given, frame, None, None, node)
    return local(run, frame, name, node, value, f"{written} *" if pointer else written)
