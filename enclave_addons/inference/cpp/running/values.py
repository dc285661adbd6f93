"""What an expression may be: alternatives, each a text, number, object, container, closure or unknown. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from enclave_addons.inference.cpp.reading.declarations import Class, Function
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.syntax import Node
from nodl.name_template import ParameterPart, Part, UnknownPart, melted

if TYPE_CHECKING:
    from enclave_addons.inference.cpp.findings import AllocatedNode
    from enclave_addons.inference.cpp.running.machine import Frame
from collections.abc import Iterator

MAX_ALTERNATIVES = 32
MAX_SEQUENCES = 6
MAX_ITEMS = 128
MAX_LETTERS = 10_000
MAX_PARTS = 2_000
"""What a value may hold in all: larger ones count as not known."""
Atom = Any  # one of the classes below, or bool, int, float
Value = tuple[Atom, ...]
BOTTOM: Value = ()


Noted = dict[tuple["Notes", str], object]  # what was asked for, and the answer at the first time
_ABSENT = object()
_WRITTEN, _OWN = object(), object()  # before it was read, if ever: what was there before does not matter


class NoteLog:
    """The notes that were read since somebody wanted to know; ``None`` while nobody does."""

    def __init__(self) -> None:
        self.noted: Noted | None = None


class Notes:
    """Values by name, equal to themselves alone. What is read is told to the log."""

    def __init__(self, log: NoteLog | None = None) -> None:
        self._log = log
        self._values: dict[str, Any] = {}

    def get(self, name: str, default: Any = None) -> Any:
        if self._log is not None and self._log.noted is not None:
            add_note(self._log.noted, (self, name), self._values.get(name, _ABSENT))
        return self._values.get(name, default)

    def __getitem__(self, name: str) -> Any:
        return self.get(name)

    def __setitem__(self, name: str, value: Any) -> None:
        if self._log is not None and self._log.noted is not None:
            add_note(self._log.noted, (self, name), _WRITTEN)
        self._values[name] = value

    def update(self, **values: Any) -> None:
        self._values.update(values)

    def __contains__(self, name: str) -> bool:
        return self.get(name, _ABSENT) is not _ABSENT

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)


def add_note(noted: Noted, key: tuple[Notes, str], said: object) -> None:
    """Add what a note says, unless it said something before; what was only written before is read now."""
    if noted.setdefault(key, said) is _WRITTEN and said is not _WRITTEN:
        noted[key] = _OWN


def notes_read(noted: Noted) -> Noted:
    """Return the notes that code read; of a note that it wrote first, with its last value."""
    return {
        (notes, name): notes._values.get(name, _ABSENT) if said is _OWN else said
        for (notes, name), said in noted.items()
        if said is not _WRITTEN
    }


def hold(noted: Noted) -> bool:
    """Return whether all these notes say what they said."""
    for (notes, name), said in noted.items():
        says = notes._values.get(name, _ABSENT)
        if says is not said and says != said:
            return False
    return True


class NodeNamePart(NamedTuple):
    """What a node says of itself: its ``name``, ``ns`` or ``fqn``."""

    record: AllocatedNode
    what: str


class Text(NamedTuple):
    """A text; its parts are literals, parameters, names of nodes and what is not known."""

    parts: tuple[Part | NodeNamePart, ...]


class Unknown(NamedTuple):
    """Something that is not known; ``why``, such as ``the result of f()``, is what gaps say of it.

    All are equal: whatever the reason, the same can be said of what is done with it.
    """

    why: str

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self)

    def __ne__(self, other: object) -> bool:
        return type(other) is not type(self)

    def __hash__(self) -> int:
        return hash(type(self))


class ReferredTo(Unknown):
    """What a reference or pointer to a plain value stands for: a write to it changes another variable."""


class Const(NamedTuple):
    """An enumerator, by its qualified name."""

    name: str


END = Const("the end of a container")


class Param(NamedTuple):
    """The value of a parameter of a node, still under its name.

    ``item``: an element of a list; ``known``: that element as the launch file or the default gives it.
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
    """A vector, array or list. ``open``: the items may come any number of times.

    ``place``: an iterator to the first of the items, or, if it is open, to any.
    """

    items: tuple[Value, ...]
    open: bool = False
    place: bool = False


class Map(NamedTuple):
    """Entries of key and value. ``open``: it may hold others, or lack some."""

    entries: tuple[tuple[Value, Value], ...]
    open: bool = False


class Group(NamedTuple):
    """A pair, tuple or braced list of unlike things."""

    items: tuple[Value, ...]


class Bound(NamedTuple):
    """A function, on an object if it is a method; ``fixed``: the arguments that are bound to it."""

    function: Function
    this: Obj | None
    fixed: tuple[Value, ...] = ()


class Lambda(NamedTuple):
    """A lambda expression with the frame of its captures."""

    node: Node
    frame: Frame


@dataclass(eq=False, slots=True)
class Obj:
    """An object by the place where it is made. ``cls`` is ``None`` for classes of libraries.

    ``node``: the node that it is or stands for (``rclcpp::Node``, an interface of one).
    """

    type: Type
    cls: Class | None = None
    node: AllocatedNode | None = None
    bindings: dict[Class, dict[str, Type]] = field(default_factory=dict)
    data: Notes = field(default_factory=Notes)  # of library classes
    heap: bool = False
    foreign_base: str = ""
    is_node: bool = False  # the node itself; else something that belongs to it
    several: bool = False  # stands for several objects: what is written to it may be written to another one
    building: Class | None = None  # the class whose constructor runs: no method of a derived class is called

    def __repr__(self) -> str:
        return f"<{self.type.name}>"


def holds_callable(atom: Atom) -> bool:
    """Return whether an alternative is or holds a function or closure."""
    return next(functions_in((atom,)), None) is not None


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


def may_name(value: Value) -> bool:
    """Return whether a text, parameter, function or object of the program is or lies in it."""
    for atom in value:
        if isinstance(atom, Text | Param | Lambda | Bound | Const):
            return True
        if isinstance(atom, Obj) and (atom.cls is not None or atom.node is not None):
            return True
        if isinstance(atom, Seq | Group) and any(map(may_name, atom.items)):
            return True
        if isinstance(atom, Map) and any(may_name(each) for entry in atom.entries for each in entry):
            return True
    return False


def bounded(value: Value) -> Value:
    """Return ``value``, or one that is not known if containers in it hold too much in all."""
    containers = [atom for atom in value if isinstance(atom, Seq | Map | Group)]
    if not containers or sum(_parts(atom, MAX_PARTS) for atom in containers) <= MAX_PARTS:
        return value
    kept = tuple(atom for atom in value if not isinstance(atom, Seq | Map | Group))
    return (*kept, Unknown("a container that holds too much"))


def _parts(atom: Atom, most: int) -> int:
    """Count the values that a container holds in all; any number above ``most`` if it is more."""
    found = 0
    waiting = [atom]
    while waiting and found <= most:
        each = waiting.pop()
        items = (pair for pair in each.entries) if isinstance(each, Map) else ((item,) for item in each.items)
        for item in (value for pair in items for value in pair):
            found += 1
            waiting += [inner for inner in item if isinstance(inner, Seq | Map | Group)]
            if found > most:
                break
    return found


def join(*values: Value) -> Value:
    """Join the alternatives of all; too many become one that is not known."""
    first = values[0] if values else BOTTOM
    if all(value is first or value == first for value in values[1:]):
        return first
    every: dict[Atom, None] = {}
    unknown_one: Unknown | None = None  # of several things that are not known
    for value in values:
        for atom in value:
            if type(atom) is Unknown:
                unknown_one = unknown_one or atom
                atom = unknown_one
            every[atom] = None
    found = tuple(every)
    if len(found) > MAX_SEQUENCES:
        found = _one_container(found)
    if len(found) <= MAX_ALTERNATIVES:
        return found
    objects = tuple(atom for atom in found if isinstance(atom, Obj))[:MAX_ALTERNATIVES]
    return (*objects, Unknown("too many possible values"))


def join_in_doubt(values: Sequence[Value], why: str) -> Value:
    """Join alternatives of which C++ takes a certain one, not known which: texts and numbers that differ are open."""
    found = join(*values)
    if any(isinstance(atom, Unknown) for atom in found):
        return found
    common = set(values[0]).intersection(*values[1:]) if values else set()
    return join(
        *(
            unknown(why) if isinstance(atom, Text | Param | int) and atom not in common else (atom,)
            for atom in found
        )
    )


def _one_container(atoms: Value) -> Value:
    crowded = any(sum(isinstance(atom, kind) for atom in atoms) > MAX_SEQUENCES for kind in (Seq, Map))
    return in_any_order(atoms) if crowded else atoms


def in_any_order(atoms: Value) -> Value:
    """Join many possible lists to one whose items come any number of times, and maps to one with all their entries."""
    lists = [atom for atom in atoms if isinstance(atom, Seq) and not atom.place]
    maps = [atom for atom in atoms if isinstance(atom, Map)]
    found: list[Atom] = [atom for atom in atoms if not isinstance(atom, Map) and atom not in lists]
    if lists:
        found.append(open_sequence(item for atom in lists for item in atom.items))
    if maps:
        found.append(as_one_map([entry for atom in maps for entry in atom.entries], True))
    return tuple(found)


def as_one_map(entries: Iterable[tuple[Value, Value]], is_open: bool) -> Map:
    """Merge entries of equal keys; if a key is not known, or they are too many, all to one that is not known."""
    found: dict[Value, Value] = {}
    for key, value in entries:
        found[key] = join_in_doubt([found[key], value], "which value a key has") if key in found else value
    strange = next((key for key in found if any(isinstance(atom, Unknown) for atom in key)), None)
    if strange is not None or len(found) > MAX_ITEMS:
        found = {strange or unknown("one of many keys"): join(*found.values())}
        is_open = True
    return Map(tuple(found.items()), is_open)


def open_sequence(items: Iterable[Value]) -> Seq:
    """Make a list whose ``items`` come in any order and number; if one is not known, or too many are, one for all."""
    found = dict.fromkeys(items)
    is_known = not any(type(atom) is Unknown for item in found for atom in item)
    return Seq(tuple(found) if is_known and len(found) <= MAX_ITEMS else (join(*found),), open=True)


def lost(value: Value, why: str, written: Value = BOTTOM) -> Value:
    """Return what is left where somebody writes: objects and closures; texts, numbers and elements are not known.

    ``written``: objects among it may be elements.
    """
    return join(*((_lost(atom, why, written),) for atom in value))


def _lost(atom: Atom, why: str, written: Value) -> Atom:
    if isinstance(atom, Seq):
        more = tuple(each for each in written if isinstance(each, Obj | Lambda | Bound))
        return Seq((lost(join(*atom.items, more, unknown(why)), why, written),), True, atom.place)
    if isinstance(atom, Map):
        items = (lost(value, why, written) for _, value in atom.entries)
        return Map(((unknown(why), join(*items, unknown(why))),), True)
    if isinstance(atom, Group):
        return Group(tuple(lost(item, why, written) for item in atom.items))
    return atom if isinstance(atom, Obj | Lambda | Bound) or atom == END else Unknown(why)


def unknown(why: str) -> Value:
    """Make a value that is not known, whose only alternative says ``why``."""
    return (Unknown(why),)


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
        return _parameter_parts(atom)
    if isinstance(atom, Unknown):
        return (UnknownPart(atom.why),)
    return (UnknownPart("a value that is not a text"),)


def _parameter_parts(param: Param) -> tuple[Part, ...]:
    texts = [plain(each) for each in param.default]
    default = texts[0] if len(texts) == 1 else None
    return (ParameterPart(param.name, default, param.item),)


def concatenated(*values: Value) -> Value:
    """Put one alternative of each behind another: of two that have several it is not known which go together."""
    results: list[tuple[Part | NodeNamePart, ...]] = [()]
    for value in values:
        if len(value) > 1 and len(results) > 1:
            value = unknown("one of several texts, which go with others before them")
        size = sum(len(part) if isinstance(part, str) else 1 for parts in results for part in parts)
        if size > MAX_LETTERS:
            return unknown("a text that is too long to be a name")
        pieces = [piece for atom in value for piece in spread(atom)] or [
            (UnknownPart("a text that is never set"),)
        ]
        results = [(*head, *piece) for head in results for piece in pieces]
        if len(results) > MAX_ALTERNATIVES:
            return unknown("too many possible texts")
    return tuple(dict.fromkeys(Text(melted(part for part in parts if part != "")) for parts in results))


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


def spread(atom: Atom) -> list[tuple[Part | NodeNamePart, ...]]:
    """Return ``as_parts``, once for each default of a parameter."""
    if isinstance(atom, Param) and len(atom.default) > 1:
        return [as_parts(atom._replace(known=(each,))) for each in atom.default]
    return [as_parts(atom)]


def plain(atom: Atom) -> str | None:
    """Return the text of a literal; ``None`` if it is not one."""
    if isinstance(atom, Text) and all(isinstance(part, str) for part in atom.parts):
        return "".join(str(part) for part in atom.parts)
    if isinstance(atom, bool):
        return "true" if atom else "false"
    if isinstance(atom, int):
        return str(atom)
    return None


def truth(value: Value) -> bool | None:
    """Return whether ``value`` is certainly true or false."""
    found = {_truth(atom) for atom in value}
    return found.pop() if len(found) == 1 else None


def _truth(atom: Atom) -> bool | None:
    if isinstance(atom, bool | int):
        return bool(atom)
    if isinstance(atom, Lambda | Bound):
        return True
    return None


def has_text(value: Value) -> bool:
    """Return whether one of the alternatives is a text or a parameter."""
    return any(isinstance(atom, Text | Param) for atom in value)
