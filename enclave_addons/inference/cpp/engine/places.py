"""Where values lie: what an expression on the left of ``=`` means, how it is read and written, of which type it is."""

from __future__ import annotations

from collections.abc import Sequence

from enclave_addons.inference.cpp.engine.frames import Frame, Variable
from enclave_addons.inference.cpp.engine.launch_values import parameter_items
from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.values import (
    BOTTOM,
    Atom,
    Const,
    Group,
    Map,
    Obj,
    Param,
    Place,
    Pointer,
    Seq,
    Text,
    Unknown,
    Value,
    as_map,
    is_open,
    join,
    only,
    open_sequence,
    unknown,
)
from enclave_addons.inference.cpp.reading.declarations import Class, FileIndex, Global, Scope
from enclave_addons.inference.cpp.reading.type_names import NO_TYPE, Type
from enclave_addons.inference.cpp.syntax import Node, children, field_of, last_name, text, unwrapped

ANY = "any"
"""The step to some element of a container, not known which."""
_TO_ELEMENT = ("at", "back", "front", "top", "value", "get", "operator[]")


def read(run: Machine, place: Place) -> Value:
    """Return what lies at a place."""
    value = run.store.get(place.cell)
    for step in place.steps:
        value = element(run, value, step)
    return value


def element(run: Machine, value: Value, step: object) -> Value:
    """Return the element of a container: at an index, under a key, or any."""
    return join(*(_element(run, atom, step) for atom in value)) if value else unknown("an element of nothing")


def _element(run: Machine, atom: Atom, step: object) -> Value:
    if isinstance(atom, Param):
        listed, exact = parameter_items(run, atom)
        atom = Seq(tuple(listed), not exact)
    if isinstance(atom, Map):
        return _entry(atom, step)
    if isinstance(atom, Seq | Group):
        items = atom.items
        if isinstance(step, int) and not getattr(atom, "open", False):
            return (
                items[step] if -len(items) <= step < len(items) else unknown("an element that is not there")
            )
        found = join(*items) if items else BOTTOM
        return found or unknown("an element of an empty list")
    if isinstance(atom, Text | Obj):
        return unknown("a part of a value")
    return (atom,) if isinstance(atom, Unknown) else unknown("an element")


def _entry(atom: Map, key: object) -> Value:
    for each, value in atom.entries:
        if each == key and not is_open(each) and len(each) == 1:
            return value
    certain = isinstance(key, tuple) and len(key) == 1 and not is_open(key) and not isinstance(key[0], Param)
    if certain and not atom.open and all(len(k) == 1 and not is_open(k) for k, _ in atom.entries):
        return BOTTOM
    values = [value for _, value in atom.entries]
    return (
        join(*values, unknown("an entry of a map"))
        if atom.open
        else join(*values) or unknown("an entry of a map")
    )


def write(run: Machine, place: Place, value: Value) -> None:
    """Set what lies at a place; of several objects that one stands for, any may be meant."""
    before = run.store.get(place.cell)
    value = _replaced(run, before, place.steps, value)
    owner = place.cell[0]
    if isinstance(owner, Obj) and owner.several:
        value = join(before, value)
    run.store.set(place.cell, value)


def write_all(run: Machine, places: Sequence[Place], value: Value) -> None:
    """Set what lies at one of these places, not known which."""
    for place in places:
        write(run, place, value if len(places) == 1 else join(read(run, place), value))


def _replaced(run: Machine, container: Value, steps: Sequence[object], value: Value) -> Value:
    if not steps:
        return value
    step, rest = steps[0], steps[1:]
    found: list[Atom] = []
    for atom in container or (Map(()) if isinstance(step, tuple) else Seq((), True),):
        if isinstance(atom, Seq | Group):
            found.append(_with_item(run, atom, step, rest, value))
        elif isinstance(atom, Map):
            key = step if isinstance(step, tuple) else unknown("a key")
            entries = dict(atom.entries)
            inner = _replaced(run, entries.get(key, BOTTOM), rest, value)
            certain = not is_open(key) and len(key) == 1
            if not certain:
                inner = join(entries.get(key, BOTTOM), inner)
            found.append(as_map({**entries, key: inner}, atom.open or not certain))
        else:
            found.append(atom)
    return tuple(found)


def _with_item(run: Machine, atom: Seq | Group, step: object, rest: Sequence[object], value: Value) -> Atom:
    items = list(atom.items)
    if isinstance(step, int) and -len(items) <= step < len(items) and not getattr(atom, "open", False):
        items[step] = _replaced(run, items[step], rest, value)
        return atom._replace(items=tuple(items))
    new = _replaced(run, join(*items), rest, value)
    if isinstance(atom, Group):
        return Group(tuple(join(each, new) for each in items))
    return open_sequence([*items, new])


# --- what an expression means -------------------------------------------------------------------------------------


def places_of(run: Machine, node: Node | None, frame: Frame) -> list[Place]:
    """Return the places that an expression may mean; none if it is a value of its own."""
    node = unwrapped(node)
    if node is None:
        return []
    if node.type in ("identifier", "qualified_identifier", "field_identifier"):
        found = place_of_name(run, text(node), frame)
        return [found] if found is not None else []
    if node.type == "field_expression":
        return _of_member(run, node, frame)
    if node.type == "subscript_expression":
        index = field_of(node, "indices") or field_of(node, "index")
        given = children(index) if index is not None and index.type == "subscript_argument_list" else [index]
        return _of_element(run, field_of(node, "argument"), given[0] if given else None, frame)
    if node.type == "pointer_expression" and text(node).startswith("*"):
        inner = run.evaluate(field_of(node, "argument"), frame)
        pointers = [atom.place for atom in inner if isinstance(atom, Pointer)]
        return pointers or places_of(run, field_of(node, "argument"), frame)
    if node.type == "call_expression":
        function = field_of(node, "function")
        given = children(field_of(node, "arguments"))
        name = last_name(function)
        if function is not None and function.type == "field_expression" and name in _TO_ELEMENT:
            return _of_element(run, field_of(function, "argument"), given[0] if given else None, frame, name)
        if name in ("move", "forward", "ref") and len(given) == 1:
            return places_of(run, given[0], frame)
    return []


def _of_member(run: Machine, node: Node, frame: Frame) -> list[Place]:
    argument, name = field_of(node, "argument"), text(field_of(node, "field"))
    found = run.evaluate(argument, frame)
    objects = [atom for atom in found if isinstance(atom, Obj)]
    if objects:
        return [Place((_owner(run, each, name), name)) for each in objects]
    if name in ("first", "second") and any(isinstance(atom, Group | Map | Seq) for atom in found):
        step = 0 if name == "first" else 1
        return [place._replace(steps=(*place.steps, step)) for place in places_of(run, argument, frame)]
    pointed = [atom.place for atom in found if isinstance(atom, Pointer)]
    return [place for place in pointed if isinstance(only(read(run, place)), Obj)]


def _owner(run: Machine, obj: Obj, name: str) -> object:
    """Return who has a member: the object, or its class if it is static."""
    for cls in run.names.ancestry(obj.cls):
        if name in cls.fields:
            return cls if cls.fields[name].static else obj
    return obj


def _of_element(
    run: Machine, base: Node | None, index: Node | None, frame: Frame, word: str = "at"
) -> list[Place]:
    value = run.evaluate(base, frame)
    if not any(isinstance(atom, Seq | Map | Group | Param) for atom in value) and value:
        return []
    found = places_of(run, base, frame)
    step = step_of(run, value, run.evaluate(index, frame) if index is not None else BOTTOM, word)
    return [place._replace(steps=(*place.steps, step)) for place in found]


def step_of(run: Machine, container: Value, index: Value, word: str = "at") -> object:
    """Return the step to the element that ``container[index]``, ``front()`` or ``back()`` means."""
    if any(isinstance(atom, Map) for atom in container):
        return index
    if word in ("back", "front", "top"):
        return 0 if word == "front" else -1
    found = only(index)
    if not container and not isinstance(found, int):
        return index  # an entry of a map that is not there yet
    return found if isinstance(found, int) and not isinstance(found, bool) else ANY


def place_of_name(run: Machine, name: str, frame: Frame) -> Place | None:
    """Return the place of the variable that a name means: local, a member, static, or global."""
    name = "".join(name.split())
    variable = frame.variables.get(name)
    if variable is not None:
        return variable.place
    if (
        "::" not in name
        and frame.this is not None
        and frame.function is not None
        and not frame.function.static
    ):
        owner = _member_owner(run, frame.this, name)
        if owner is not None:
            return Place((owner, name))
    return static_place(run, name, frame.scope, frame.file)


def _member_owner(run: Machine, this: Obj, name: str) -> object | None:
    for cls in run.names.ancestry(this.cls):
        if name in cls.fields:
            return static_owner(run, cls, name) if cls.fields[name].static else this
    return this if (this, name) in run.store else None


def static_place(run: Machine, name: str, scope: Scope, file: FileIndex) -> Place | None:
    """Return the place of a static member or global, initialised when it is first asked for."""
    head, _, last = name.rpartition("::")
    cls = run.names.find_class(head, scope, file) if head else None
    around: Sequence[Class] = [cls] if cls is not None else []
    if not head:
        around = [c for n in range(len(scope), 0, -1) for c in run.names.classes.get(scope[n - 1], ())
                  if c.qualified == "::".join(scope[:n])]  # fmt: skip
    for each in (base for one in around for base in run.names.ancestry(one)):
        if last in each.fields and each.fields[last].static:
            static_owner(run, each, last)
            return Place((each, last))
    found = run.names.find_global(name, scope, file)
    if found is None:
        return None
    if (found, last) not in run.store:
        run.store.set((found, last), BOTTOM)
        begin(run, Place((found, last)), run.calls.initial_value(run, found, Frame(found.file, found.scope)))
    return Place((found, last))


def begin(run: Machine, place: Place, value: Value) -> None:
    """Set the first value of a variable that is there before anybody uses it."""
    if any(isinstance(atom, Obj) for atom in value):
        run.store.set(place.cell, value)  # what its constructor wrote is undone with it
    else:
        run.store.initialise(place.cell, value)


def static_owner(run: Machine, cls: Class, name: str) -> Class:
    """Return the class of a static member, whose initial value is set."""
    if (cls, name) not in run.store:
        run.store.set((cls, name), BOTTOM)
        member = cls.fields[name]
        defined = run.names.find_global(f"{cls.qualified}::{name}", (), cls.file)
        if defined is not None and member.default is None:
            value = run.calls.initial_value(run, defined, Frame(defined.file, defined.scope))
        else:
            here = Global(name, member.type, member.default, member.node, cls.scope, cls.file, member.pointer)
            value = run.calls.initial_value(run, here, Frame(cls.file, cls.scope))
        begin(run, Place((cls, name)), value)
    return cls


def named_constant(run: Machine, name: str) -> Value | None:
    """Return the enumerator of a name."""
    name = "".join(name.split()).lstrip(":")
    full = run.names.enumerators.get(name)
    if full is None and "::" in name:
        full = run.names.enumerators.get("::".join(name.split("::")[-2:]))
    return (Const(full),) if full is not None else None


# --- types --------------------------------------------------------------------------------------------------------


def declared_type(run: Machine, node: Node | None, frame: Frame) -> Type:
    """Return the type that the variable, member or element was declared with; ``NO_TYPE`` if that is not known."""
    node = unwrapped(node)
    if node is None:
        return NO_TYPE
    if node.type == "identifier":
        variable = frame.variables.get(text(node))
        if variable is not None:
            return run.type_of(variable.type, frame) if variable.type else NO_TYPE
        return _type_of_member(run, frame.this, text(node)) if frame.this is not None else NO_TYPE
    if node.type == "field_expression":
        owners = run.evaluate(field_of(node, "argument"), frame)
        first = next((atom for atom in owners if isinstance(atom, Obj)), None)
        return _type_of_member(run, first, text(field_of(node, "field"))) if first is not None else NO_TYPE
    if node.type == "subscript_expression":
        inner = declared_type(run, field_of(node, "argument"), frame)
        return inner.arguments[-1 if "map" in inner.last else 0] if inner.arguments else NO_TYPE
    return NO_TYPE


def _type_of_member(run: Machine, obj: Obj, name: str) -> Type:
    for cls in run.names.ancestry(obj.cls):
        if name in cls.fields:
            member = cls.fields[name]
            found = run.names.resolve(member.type, cls.scope, cls.file, obj.bindings.get(cls))
            return found._replace(pointer=found.pointer or member.pointer)
    return NO_TYPE


def local(run: Machine, frame: Frame, name: str, node: Node, value: Value, written_type: str = "") -> Place:
    """Declare a variable of a function."""
    place = Place((frame.path, f"{name}@{node.start_byte}"))
    frame.variables[name] = Variable(place, written_type)
    run.store.set(place.cell, value)
    return place
