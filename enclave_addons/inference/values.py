"""The abstract values of the analysis: what an expression of the analysed program may denote, and how they are joined.

A ``Value`` is a tuple of atoms, read as "one of these". Python constants (``str``, ``int``, ``None`` ...)
stand for themselves, ``Text`` is a string known in part, ``Unknown`` is anything, the rest are the
things a program handles: modules, functions, classes, instances, containers, names of foreign libraries.
Heap objects keep their contents in ``cells``; only ``state.State`` writes there.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, ClassVar, NamedTuple, TypeAlias

from enclave_addons.inference.text import Guard, Text, common_text, constant_text

if TYPE_CHECKING:
    from enclave_addons.inference.program import SourceModule

Value: TypeAlias = tuple[object, ...]
Cells: TypeAlias = dict[object, Value]

# More different strings than this in one value become a pattern; more objects become unknown.
MAX_STRINGS = 32
MAX_ATOMS = 64
CONSTANTS = (str, int, float, bool, bytes, type(None))
TOO_MANY = "too many possible values"
COMMAND_LINE = "command line arguments"
WITHOUT_PROGRAM = "command line arguments behind the name of the program"
WITHOUT_ROS = "command line arguments without those of ROS"
OF_A_NODE = "an attribute of a node whose name is made at run time"

NONE: Value = (None,)
BOTTOM: Value = ()


class Unknown:
    """Anything; ``why`` tells the reader what the analysis would have had to know."""

    __slots__ = ("why",)

    def __init__(self, why: str):
        self.why = why

    def __repr__(self) -> str:
        return f"Unknown({self.why!r})"


_unknowns: dict[str, Value] = {}


def unknown(why: str) -> Value:
    """Return the value "anything", one shared object per reason."""
    value = _unknowns.get(why)
    if value is None:
        value = _unknowns[why] = (Unknown(why),)
    return value


ANY: Value = unknown("a value that the program computes")
BOOLEAN: Value = (True, False)
OF_LAUNCH: Value = unknown("what only a launch decides")


class Absent:
    """In a field, or in a class: it may not have been set, so that the class, or its base, is asked."""


ABSENT: Value = (Absent(),)


class FieldCells(dict[object, Value]):
    """The cells of an instance or class; the state notes when one may be absent."""


class ContentCells(FieldCells):
    """The cells of a dictionary, or of something of a library: the program's text does not name their keys."""


class FixedCells(ContentCells):
    """The cells of an object of a library whose attributes no program sets: nothing changes them later."""


class External:
    """Something of a library that is not analysed, by its dotted path: ``rclpy.node.Node``."""

    __slots__ = ("path",)

    def __init__(self, path: str):
        self.path = path

    def __repr__(self) -> str:
        return f"External({self.path})"


BUILTINS = frozenset(dir(builtins))
_externals: dict[str, Value] = {}


def external(path: str) -> Value:
    """Return the value of a library's name, one shared object per path."""
    value = _externals.get(path)
    if value is None:
        value = _externals[path] = (External(path),)
    return value


RESULT = ".()"


def result_of(path: str) -> Value:
    """Return what a library gives that keeps its hands off the program's objects: one value for each such library."""
    return external(path.partition(".")[0] + RESULT)


class ModuleCells(dict[object, Value]):
    """The global variables of a module; one that may not have been set is the built-in of its name, if there is one."""


class LocalCells(dict[object, Value]):
    """The variables of one function call.

    ``shared``: inner functions can see them. ``dead``: the call has returned and nobody can see them.
    """

    __slots__ = ("dead", "shared")

    def __init__(self) -> None:
        super().__init__()
        self.dead = False
        self.shared = False


EVERY_FIELD = -1


class HeapObject:
    """An object with mutable contents. A ``summary`` stands for several concrete ones (weak updates)."""

    __slots__ = ("cells", "escaped", "summary")

    # Cells of containers and functions that were read, by ``id``; ``EVERY_FIELD`` where all of an object were.
    looked_into: ClassVar[set[int]] = set()

    def __init__(self) -> None:
        self.cells: Cells = {}
        self.summary = False
        self.escaped = False


class Items(NamedTuple):
    """The contents of a sequence: each element if the length is known, else what any element may be."""

    exact: tuple[Value, ...] | None
    rest: Value = BOTTOM

    def any_element(self) -> Value:
        return self.rest if self.exact is None else join_all(self.exact)


ITEMS = "[items]"  # the cell of a sequence that holds its Items
OTHER = "[other]"  # the cell of a dictionary for keys that are not constants
OTHER_KEYS = "[keys]"


LAZY = "lazy"  # the kind of iterators and of views of dictionaries


class Sequence(HeapObject):
    """A list, tuple or set, or what gives elements where it is iterated over."""

    __slots__ = ("kind",)

    def __init__(self, kind: str, items: Items):
        super().__init__()
        self.kind = kind
        self.cells[ITEMS] = (items,)

    @property
    def items(self) -> Items:
        """Return the contents; others may have changed what they were handed."""
        HeapObject.looked_into.add(id(self.cells))
        items = self.cells[ITEMS][0]
        assert isinstance(items, Items)
        return Items(None, join(items.any_element(), ANY)) if self.escaped else items


class Key(NamedTuple):
    """The cell of a dictionary under a constant key."""

    constant: object


class Dictionary(HeapObject):
    """A dictionary of any kind: a cell for each constant key, and ``OTHER`` for all other keys."""

    __slots__ = ("kind",)

    def __init__(self) -> None:
        super().__init__()
        self.cells = ContentCells()
        self.kind = "dict"

    @property
    def is_open(self) -> bool:
        """It may hold keys that are not known."""
        HeapObject.looked_into.add(id(self.cells))
        return self.escaped or bool(present(self.cells.get(OTHER, BOTTOM)))

    def entries(self) -> list[tuple[Key, Value, bool]]:
        """Return known keys in order, with their values and whether they are certainly there."""
        HeapObject.looked_into.add(id(self.cells))
        return [
            (cell, present(value), not self.summary and ABSENT[0] not in value)
            for cell, value in self.cells.items()
            if isinstance(cell, Key) and value is not ABSENT and value != ABSENT
        ]

    def held(self, constant: object) -> tuple[Value, bool]:
        """Return what a key may hold, and whether it is certainly there."""
        HeapObject.looked_into.add(id(self.cells))
        value = self.cells.get(Key(constant), BOTTOM)
        return present(value), bool(value) and not self.summary and ABSENT[0] not in value


class ModuleValue(HeapObject):
    """An analysed module, whose cells are its global variables."""

    __slots__ = ("source", "stars")

    def __init__(self, source: SourceModule):
        super().__init__()
        self.cells = ModuleCells()
        self.source = source
        self.stars: list[str] = []  # foreign modules whose names were imported with *


class FunctionValue:
    """A function with what it closes over. ``owner`` is the class whose body defines it."""

    __slots__ = (
        "cached", "closure", "defaults", "kw_defaults", "module", "name", "node", "owner",
    )  # fmt: skip

    def __init__(
        self,
        node: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda,
        name: str,
        module: ModuleValue,
        closure: Frame | None,
        owner: ClassValue | None,
    ):
        self.node = node
        self.name = name
        self.module = module
        self.closure = closure
        self.owner = owner
        self.defaults: tuple[Value, ...] = ()
        self.kw_defaults: tuple[Value | None, ...] = ()
        self.cached = False  # by functools.cache


class DataField(NamedTuple):
    """A field of a dataclass or named tuple, by what its constructor does with it."""

    default: Value | None = None
    factory: tuple[Value, ast.expr, Frame] | None = (
        None  # makes the default of each object; where it is written
    )
    by_position: bool = True
    by_keyword: bool = True


class ClassValue(HeapObject):
    """An analysed class, whose cells hold what its body and later assignments set."""

    __slots__ = ("bases", "fields", "linear", "module", "name", "node")

    def __init__(self, node: ast.ClassDef, name: str, module: ModuleValue, bases: Value):
        super().__init__()
        self.cells = FieldCells()
        self.node = node
        self.name = name
        self.module = module
        self.bases = bases
        self.linear: tuple[object, ...] | None = None  # method resolution order, made on first use
        self.fields: dict[str, DataField] | None = None  # of a dataclass


class Instance(HeapObject):
    """An object of an analysed class, or of a modelled foreign class (``cls`` is then its ``External``).

    ``guards``: what held of parameters wherever it was made, so wherever it is used."""

    __slots__ = ("cls", "guards")

    def __init__(self, cls: ClassValue | External):
        super().__init__()
        self.cells = FieldCells() if isinstance(cls, ClassValue) else ContentCells()
        self.cls = cls
        self.guards: tuple[Guard, ...] = ()


class FunctionEntry(NamedTuple):
    """What runs a function: the call, in its calling context."""

    call: ast.AST
    context: int


class Frame:
    """The variables of a running function, class body or module."""

    __slots__ = (
"again", "cells", "closure", "depth", "early", "element", "entry", "forks", "function", "globals",
        "guards", "is_class", "is_comprehension", "jump", "loop_forks", "module", "nonlocals",
        "returned", "unsettled",
    )  # fmt: skip

    def __init__(self, module: ModuleValue, cells: dict[object, Value], closure: Frame | None, depth: int):
        self.module = module
        self.cells = cells
        self.closure = closure
        self.depth = depth  # of branches when the frame was entered
        self.function: FunctionValue | None = None
        self.entry: FunctionEntry | None = None
        self.returned: Value = BOTTOM
        self.early = False  # some path left before the end
        self.unsettled = ""  # the break or continue that may have happened, since the loop asked last
        self.jump = ""  # the break or continue that certainly ended the latest statement
        self.forks = 0  # undecided branches when the frame was entered, and when its innermost loop was
        self.loop_forks = 0
        self.guards = 0  # how many conditions held when the frame was entered
        self.again = False  # the cells also hold an earlier call, whose inner functions live on
        self.element: Callable[[], None] | None = None  # of a comprehension: makes the next one
        self.is_class = False
        self.is_comprehension = False
        self.globals: set[str] = set()
        self.nonlocals: set[str] = set()

    @property
    def captured(self) -> bool:
        return type(self.cells) is LocalCells and self.cells.shared

    def look_into(self) -> None:
        """Note that what runs here reads the variables that it shares with other functions."""
        frame: Frame | None = self
        while frame is not None:
            HeapObject.looked_into.add(id(frame.cells))
            frame = frame.closure

    def capture(self) -> None:
        """Let inner functions see the cells, and those around them, from now on."""
        frame: Frame | None = self
        while frame is not None and not frame.captured:
            if type(frame.cells) is LocalCells:
                frame.cells.shared = True
            frame = frame.closure


# Equal only to their own kind: ``in`` then says the same as comparing one by one, and faster.
_COMPARED_IN_C = frozenset({
    str, Text, External, Instance, Sequence, Dictionary, FunctionValue, ClassValue, ModuleValue,
})  # fmt: skip


def join(left: Value, right: Value) -> Value:
    """Return what may be ``left`` or ``right``. Returns ``left`` itself when ``right`` adds nothing."""
    if left is right or not right:
        return left
    if not left:
        return right
    joined = left
    for atom in right:
        if not contains(joined, atom):
            joined = (*joined, atom)
    return left if joined is left else _limited(joined)


def join_all(values: Iterable[Value]) -> Value:
    """Return what may be any of ``values``; ``BOTTOM`` when there are none."""
    result: Value = BOTTOM
    for value in values:
        result = join(result, value)
    return result


def contains(value: Value, atom: object) -> bool:
    """Return True if ``atom`` is one of ``value``: ``1`` is not ``True``, and unknown is unknown."""
    kind = type(atom)
    if kind in _COMPARED_IN_C:
        return atom in value
    if kind is Unknown:
        return Unknown in map(type, value)
    for other in value:  # noqa: SIM110 - called for every join; a generator takes twice as long
        if other is atom or (type(other) is kind and other == atom):
            return True
    return False


def _limited(value: Value) -> Value:
    if type(value[0]) is Items:
        return (_join_items([atom for atom in value if isinstance(atom, Items)]),)
    if len(value) <= MAX_STRINGS:
        return value
    texts = [atom for atom in value if isinstance(atom, (str, Text))]
    others = tuple(atom for atom in value if not isinstance(atom, (str, Text)))
    if len(texts) > MAX_STRINGS:
        return join(others, (widened_texts(texts),))
    if len(value) > MAX_ATOMS:
        return unknown(TOO_MANY)
    return value


def widened_texts(texts: list[str | Text]) -> object:
    """Return one pattern for all ``texts``: common prefix and suffix around a hole; ``Unknown`` without either."""
    text = common_text(texts, "too many possible names")
    return text if not text.is_hole else unknown("too many possible names")[0]


def _join_items(items: list[Items]) -> Items:
    joined = items[0]
    for other in items[1:]:
        exact = joined.exact
        if exact is not None and other.exact is not None and len(exact) == len(other.exact):
            joined = Items(tuple(join(a, b) for a, b in zip(exact, other.exact, strict=True)))
        else:
            joined = Items(None, join(joined.any_element(), other.any_element()))
    return joined


def present(value: Value) -> Value:
    """Return ``value`` where it is set."""
    return tuple(atom for atom in value if type(atom) is not Absent) if ABSENT[0] in value else value


def boolean(outcome: bool | None) -> Value:
    """Return the value of a test; ``None``: it may have either outcome."""
    return BOOLEAN if outcome is None else (outcome,)


def constant_strings(value: Value) -> list[str]:
    """Return the strings among the alternatives that are known in full, whatever condition they are meant under."""
    return [atom for atom in map(constant_text, value) if isinstance(atom, str)]


def sole(value: Value | None) -> object:
    """Return the single atom of ``value``, or ``Unknown`` when there is not exactly one."""
    return value[0] if value is not None and len(value) == 1 else ANY[0]


def unsettled(value: Value) -> Value:
    """Return ``value`` with unknown in place of its texts and numbers and beside the rest; a truth is either."""
    if value and isinstance(value[0], Items):
        return (Items(None, join(value[0].any_element(), CHANGES_MEANWHILE)),)
    if all(type(atom) is bool for atom in value):
        return (True, False)
    others = tuple(atom for atom in value if not isinstance(atom, (str, Text, int, float)))
    return join(others, CHANGES_MEANWHILE)


def mixed_with_unknown(value: Value) -> Value:
    """Return ``value``, with unknown beside it if there are several: nobody knows which is meant."""
    items = value[0] if value else None
    if isinstance(items, Items):
        mixed = mixed_with_unknown(items.any_element())
        return value if mixed == items.any_element() else (Items(None, mixed),)
    several = sum(atom is not None and type(atom) not in (bool, Absent, Unknown) for atom in value) > 1
    if not several:
        return value
    others = tuple(atom for atom in value if not isinstance(atom, (str, Text)))
    return join(others, CHANGES_MEANWHILE)


MODULES = unknown("a module out of sys.modules")
CHANGES_MEANWHILE = unknown("a variable that changes while other code runs")


def widen(old: Value, new: Value, texts_too: bool) -> Value:
    """Join for the head of a loop: counting numbers become unknown at once, growing texts a pattern."""
    if any(type(atom) is Unknown for atom in old):  # it may be any number or text already
        covered = (int, float, str, Text) if texts_too else (int, float)
        new = tuple(atom for atom in new if not isinstance(atom, covered) or contains(old, atom))
    joined = join(old, new)
    if joined is old:
        return old
    widened = _widened(old, joined, texts_too)
    return old if all(contains(old, atom) for atom in widened) else widened


def _widened(old: Value, joined: Value, texts_too: bool) -> Value:
    if isinstance(joined[0], Items) and old and isinstance(old[0], Items):
        return (_widen_items(old[0], joined[0], texts_too),)
    if any(type(atom) in (int, float) and not contains(old, atom) for atom in joined):
        if not old:
            return joined
        joined = join(tuple(atom for atom in joined if type(atom) not in (int, float)), ANY)
    texts = [atom for atom in joined if isinstance(atom, (str, Text))]
    kept = [atom for atom in joined if not isinstance(atom, (str, Text))]
    if texts_too and any(isinstance(atom, Sequence) and not contains(old, atom) for atom in kept):
        kept = [atom for atom in kept if not isinstance(atom, Sequence)]
        return join((*kept, *texts), unknown(TOO_MANY))  # containers in containers, without end
    if texts_too and len(texts) > 1 and any(not contains(old, text) for text in texts):
        return join(tuple(kept), (widened_texts(texts),))
    return joined


def _widen_items(old: Items, new: Items, texts_too: bool) -> Items:
    """Widen elements one by one while the length stays; later, and when it changes, all together."""
    if old.exact is not None and new.exact is not None and not texts_too:
        return Items(tuple(widen(a, b, texts_too) for a, b in zip(old.exact, new.exact, strict=True)))
    return Items(None, widen(old.any_element(), new.any_element(), texts_too))


# --- what is called or read through something else ----------------------------------------------------------


class BoundMethod(NamedTuple):
    """A function of the program with the object or class that becomes its first argument."""

    function: FunctionValue
    receiver: object


class NativeMethod(NamedTuple):
    """Attribute ``name`` of a string, container or modelled object."""

    receiver: object
    name: str


class ForeignMethod(NamedTuple):
    """Method ``name`` that ``receiver`` inherits from the foreign class ``path``."""

    path: str
    receiver: object
    name: str


class Partial(NamedTuple):
    """``functools.partial``: a callable with its first arguments and keywords given in advance."""

    function: Value
    positional: tuple[Value, ...]
    keywords: tuple[tuple[str, Value], ...]


class SuperProxy(NamedTuple):
    """``super()`` inside a method of ``owner`` for object ``receiver``."""

    owner: ClassValue
    receiver: object


class PropertyValue(NamedTuple):
    """A property, by what reads and what sets it."""

    getter: Value
    setter: Value = BOTTOM


class ClassMethod(NamedTuple):
    """A function under ``@classmethod``, or under ``@staticmethod`` (``static``)."""

    function: Value
    static: bool
