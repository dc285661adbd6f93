"""What an expression may be: alternatives, each a text, number, object, container, closure or unknown. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from enclave_addons.inference.cpp.reading.declarations import Class, Function
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.syntax import Node
from nodl.name_template import ParameterPart, Part, UnknownPart, melted

if TYPE_CHECKING:
    from enclave_addons.inference.cpp.engine.frames import Frame
    from enclave_addons.inference.cpp.findings import AllocatedNode

MAX_ALTERNATIVES = 24
MAX_ITEMS = 128
MAX_LETTERS = 2_000
Atom = Any  # one of the classes below, or bool, int, float
Value = tuple[Atom, ...]
BOTTOM: Value = ()


class NodeNamePart(NamedTuple):
    """What a node says of itself: its ``name``, ``ns`` or ``fqn``."""

    record: AllocatedNode
    what: str


class Text(NamedTuple):
    """A text. Its parts are literals, parameters, names of nodes and what is not known."""

    parts: tuple[Part | NodeNamePart, ...]


class Unknown(NamedTuple):
    """Something that is not known. ``why`` is what gaps say of it. All unknown values are equal."""

    why: str

    def __eq__(self, other: object) -> bool:
        return type(other) is Unknown

    def __ne__(self, other: object) -> bool:
        return type(other) is not Unknown

    def __hash__(self) -> int:
        return hash(Unknown)


class Const(NamedTuple):
    """An enumerator by its qualified name."""

    name: str


NULL = Const("nullptr")
END = Const("the end of a container")


class Param(NamedTuple):
    """The value of a parameter of a node, still under its name.

    ``item`` is the index of an element of a list. ``known`` is that element as the launch file or the default gives it.
    """

    record: AllocatedNode
    name: str
    item: int | None = None
    known: Value = ()

    @property
    def default(self) -> Value:
        """Return what the program declares, at any time."""
        return self.known or self.record.default(self.name)


class Seq(NamedTuple):
    """A vector, array, set or list. ``open``: the items may come any number of times, in any order."""

    items: tuple[Value, ...]
    open: bool = False


class Map(NamedTuple):
    """Entries of key and value. ``open``: it may hold others, or lack some."""

    entries: tuple[tuple[Value, Value], ...]
    open: bool = False


class Group(NamedTuple):
    """A pair, tuple or braced list of unlike things."""

    items: tuple[Value, ...]


class Place(NamedTuple):
    """Where a value lies: in a variable or member ``cell``, and behind ``steps`` in the container that it holds."""

    cell: tuple[object, str]
    steps: tuple[object, ...] = ()


class Pointer(NamedTuple):
    """The address of a plain variable."""

    place: Place


class Bound(NamedTuple):
    """A function, on an object if it is a method. ``fixed`` are the arguments that are bound to it."""

    function: Function
    this: Obj | None
    fixed: tuple[Value, ...] = ()


@dataclass(frozen=True)
class Lambda:
    """A lambda expression with what it captures. Two of the same place with the same captures are one."""

    key: int
    this: Obj | None
    captured: tuple[tuple[str, Place | Value], ...]
    node: Node = field(compare=False)
    frame: Frame = field(compare=False)


@dataclass(eq=False, slots=True)
class Obj:
    """An object by the place where it is made. ``cls`` is ``None`` for classes of libraries.

    ``node`` is the node that it is or stands for (``rclcpp::Node``, an interface of one).
    """

    type: Type
    cls: Class | None = None
    node: AllocatedNode | None = None
    bindings: dict[Class, dict[str, Type]] = field(default_factory=dict)
    data: dict[str, Any] = field(default_factory=dict)  # of library classes
    heap: bool = False
    foreign_base: str = ""
    is_node: bool = False  # the node itself, not something that belongs to it
    several: bool = False  # stands for several objects: what is written to it may be written to another one

    def __repr__(self) -> str:
        return f"<{self.type.name}>"


def functions_in(value: Value) -> Iterator[Lambda | Bound]:
    """Yield the functions and closures among the alternatives, and in the containers among them."""
    for atom in value:
        if isinstance(atom, Lambda | Bound):
            yield atom
        elif isinstance(atom, Seq | Group):
            for item in atom.items:
                yield from functions_in(item)
        elif isinstance(atom, Map):
            for entry in atom.entries:
                for item in entry:
                    yield from functions_in(item)


def nodes_in(value: Value) -> list[Obj]:
    """Return the nodes (or interfaces of nodes) that ``value`` may be or hold in plain containers."""
    found: list[Obj] = []
    for atom in value:
        if isinstance(atom, Obj) and atom.node is not None:
            found.append(atom)
        elif isinstance(atom, Seq | Group):
            found += [obj for item in atom.items for obj in nodes_in(item)]
    return found


def join(*values: Value) -> Value:
    """Join the alternatives of all. Too many texts become one that is not known, which absorbs all later ones."""
    first = values[0] if values else BOTTOM
    if all(value is first or value == first for value in values[1:]):
        return first
    found = tuple(dict.fromkeys(atom for value in values for atom in value))
    if len(found) <= 1:
        return found
    found = _one_container(found)
    if len(found) <= MAX_ALTERNATIVES:
        return found
    kept = tuple(atom for atom in found if not isinstance(atom, Text | int | float | Const | Param | Unknown))
    return (*kept[:MAX_ALTERNATIVES], Unknown("too many possible values"))


def _one_container(atoms: Value) -> Value:
    """Join several possible lists to one whose items come in any number, and maps to one with all their entries."""
    lists = [atom for atom in atoms if isinstance(atom, Seq)]
    maps = [atom for atom in atoms if isinstance(atom, Map)]
    if len(lists) < 3 and len(maps) < 2:
        return atoms
    found = [atom for atom in atoms if not isinstance(atom, Seq | Map)]
    if len(lists) > 2:
        found.append(open_sequence(item for atom in lists for item in atom.items))
    else:
        found += lists
    if len(maps) > 1:
        entries: dict[Value, Value] = {}
        for key, value in (entry for atom in maps for entry in atom.entries):
            entries[key] = join(entries[key], value) if key in entries else value
        found.append(as_map(entries, True))
    else:
        found += maps
    return tuple(found)


def as_map(entries: dict[Value, Value], is_open: bool) -> Map:
    """Make a map; one with too many entries has one entry that is not known."""
    if len(entries) > MAX_ITEMS:
        return Map(((unknown("one of many keys"), join(*entries.values())),), True)
    return Map(tuple(entries.items()), is_open)


def open_sequence(items: Iterable[Value]) -> Seq:
    """Make a list whose ``items`` come in any order and number."""
    found = dict.fromkeys(items)
    return Seq(tuple(found) if len(found) <= MAX_ITEMS else (join(*found),), open=True)


def unknown(why: str) -> Value:
    """Make a value that is not known, whose only alternative says ``why``."""
    return (Unknown(why),)


def is_open(value: Value) -> bool:
    """Return whether one of the alternatives is not known."""
    return any(type(atom) is Unknown for atom in value)


def literal(value: str) -> Value:
    """Make a value that is exactly this text; an empty one has no parts."""
    return (Text((value,)) if value else Text(()),)


def as_parts(atom: Atom) -> tuple[Part | NodeNamePart, ...]:
    """Return an alternative as a piece of text."""
    if isinstance(atom, Text):
        return atom.parts
    if isinstance(atom, bool):
        return ("1" if atom else "0",)
    if isinstance(atom, int):
        return (str(atom),)
    if isinstance(atom, Param):
        texts = [plain(each) for each in atom.default]
        return (ParameterPart(atom.name, texts[0] if len(texts) == 1 else None, atom.item),)
    if isinstance(atom, Unknown):
        return (UnknownPart(atom.why),)
    return (UnknownPart("a value that is not a text"),)


def concatenated(*values: Value) -> Value:
    """Put one alternative of each behind another: of two that have several it is not known which go together."""
    results: list[tuple[Part | NodeNamePart, ...]] = [()]
    for value in values:
        if len(value) > 1 and len(results) > 1:
            value = unknown("one of several texts, which go with others before them")
        if (
            sum(len(part) if isinstance(part, str) else 1 for parts in results for part in parts)
            > MAX_LETTERS
        ):
            return unknown("a text that is too long to be a name")
        pieces = [piece for atom in value for piece in _spread(atom)]
        pieces = pieces or [(UnknownPart("a text that is never set"),)]
        results = [(*head, *piece) for head in results for piece in pieces]
        if len(results) > MAX_ALTERNATIVES:
            return unknown("too many possible texts")
    return tuple(dict.fromkeys(Text(melted(part for part in parts if part != "")) for parts in results))


def _spread(atom: Atom) -> list[tuple[Part | NodeNamePart, ...]]:
    """Return ``as_parts``, once for each default of a parameter."""
    if isinstance(atom, Param) and len(atom.default) > 1:
        return [as_parts(atom._replace(known=(each,))) for each in atom.default]
    return [as_parts(atom)]


def without_covered(texts: Value) -> Value:
    """Return possible names without those that another one, of which a part is not known, covers."""
    patterns = [
        "".join(re.escape(part) if isinstance(part, str) else ".*" for part in atom.parts)
        for atom in texts
        if isinstance(atom, Text) and any(isinstance(part, UnknownPart) for part in atom.parts)
    ]
    covering = re.compile("|".join(patterns))
    known = [plain(atom) for atom in texts]
    return tuple(
        atom
        for atom, name in zip(texts, known, strict=True)
        if name is None or not patterns or covering.fullmatch(name) is None
    )


def plain(atom: Atom) -> str | None:
    """Return the text of a literal; ``None`` if it is not one."""
    if isinstance(atom, Text) and all(isinstance(part, str) for part in atom.parts):
        return "".join(str(part) for part in atom.parts)
    if isinstance(atom, bool):
        return "true" if atom else "false"
    if isinstance(atom, int):
        return str(atom)
    return None


def only(value: Value) -> Atom | None:
    """Return the one alternative of a value; ``None`` if there are none or several."""
    return value[0] if len(value) == 1 else None


def truth(value: Value) -> bool | None:
    """Return whether ``value`` is certainly true or false."""
    found = {_truth(atom) for atom in value}
    return found.pop() if len(found) == 1 else None


def _truth(atom: Atom) -> bool | None:
    if isinstance(atom, bool | int | float):
        return bool(atom)
    if atom == NULL:
        return False
    if isinstance(atom, Obj):
        return True if atom.heap or atom.cls is not None else None  # a handle of a library may hold nothing
    return True if isinstance(atom, Lambda | Bound | Pointer) else None
