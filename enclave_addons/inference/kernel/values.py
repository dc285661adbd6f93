"""Abstract values: a ``Value`` is a tuple of atoms, read as "one of these".

Constants stand for themselves, a ``Text`` is known in part, ``Unknown`` may be anything. An ``Obj`` has mutable
contents in ``cells``; only the store writes them. What a function or class is, each front end defines itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple, TypeAlias

from enclave_addons.inference.kernel.texts import Text, common_text

Value: TypeAlias = tuple[object, ...]
Cells: TypeAlias = dict[object, Value]

MAX_TEXTS = 32
MAX_ATOMS = 64
MAX_NUMBERS = 12
NUMBERS = (int, float)
CONSTANTS = (str, int, float, bool, bytes, type(None))


class Unknown:
    """Anything. ``why`` tells the reader what would have to be known."""

    __slots__ = ("why",)

    def __init__(self, why: str) -> None:
        self.why = why

    def __repr__(self) -> str:
        return f"Unknown({self.why!r})"


class Absent:
    """A mark in a cell: it may not have been set."""


class External:
    """Something of a library that is not analysed, by its dotted path."""

    __slots__ = ("path",)

    def __init__(self, path: str) -> None:
        self.path = path

    def __repr__(self) -> str:
        return f"External({self.path})"


class LocalCells(dict[object, Value]):
    """The variables of one call.

    Attributes:
        dead: The call has returned and nothing can see them any more.
        reads: Where the call notes what it reads. Its own variables are none of that.
    """

    __slots__ = ("dead", "reads")

    def __init__(self, reads: object = None) -> None:
        super().__init__()
        self.dead = False
        self.reads = reads


class Obj:
    """An object with mutable contents.

    Attributes:
        summary: It stands for several objects, so that writes only add to it.
        place: Where it is made.
        guards: What held of inputs wherever it was made, and so wherever it is used.
    """

    __slots__ = ("cells", "cls", "guards", "kind", "place", "summary")

    def __init__(self, kind: str, cls: object = None) -> None:
        self.kind = kind
        self.cls = cls
        self.cells: Cells = {}
        self.summary = False
        self.place: object = None
        self.guards: tuple[Any, ...] = ()

    def __repr__(self) -> str:
        return f"Obj({self.kind}, {self.cls})"


class Items(NamedTuple):
    """The contents of a sequence: each element if the length is known, else what any element may be."""

    exact: tuple[Value, ...] | None
    rest: Value = ()

    def any_element(self) -> Value:
        return self.rest if self.exact is None else join_all(self.exact)


ITEMS = "[items]"  # the cell of a sequence
OTHER = "[other]"  # the cell of a mapping for keys that are not constants


class Key(NamedTuple):
    """The cell of a mapping under a constant key."""

    constant: object


_unknowns: dict[str, Value] = {}
_externals: dict[str, Value] = {}


def unknown(why: str) -> Value:
    """Return the value "anything"."""
    return _unknowns.setdefault(why, (Unknown(why),))


def external(path: str) -> Value:
    """Return the value of a library's name."""
    return _externals.setdefault(path, (External(path),))


BOTTOM: Value = ()
NONE: Value = (None,)
BOOLEAN: Value = (True, False)
ABSENT: Value = (Absent(),)
ANY = unknown("a value that the program computes")
RANDOM = "a value that is different at each start"
OF_LAUNCH = unknown("a value that only a launch decides")


def contains(value: Value, atom: object) -> bool:
    """Return whether ``atom`` is one of ``value``. ``1`` is not ``True``, and unknown is unknown."""
    kind = type(atom)
    if kind is Unknown:
        return any(type(each) is Unknown for each in value)
    return any(each is atom or (type(each) is kind and each == atom) for each in value)


def join(left: Value, right: Value) -> Value:
    """Return what may be ``left`` or ``right``: ``left`` itself where ``right`` adds nothing."""
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
    """Return what may be any of ``values``."""
    result: Value = BOTTOM
    for value in values:
        result = join(result, value)
    return result


def _limited(value: Value) -> Value:
    if type(value[0]) is Items:
        return (_joined_items([atom for atom in value if isinstance(atom, Items)]),)
    texts = [atom for atom in value if isinstance(atom, (str, Text))]
    if len(texts) > MAX_TEXTS:
        return join(tuple(atom for atom in value if not isinstance(atom, (str, Text))), widened(texts))
    numbers = sum(type(atom) in NUMBERS for atom in value)
    if numbers > MAX_NUMBERS:  # it counts something
        return (*(atom for atom in value if type(atom) not in NUMBERS and type(atom) is not Unknown), *ANY)
    return unknown("too many possible values") if len(value) > MAX_ATOMS else value


def widened(texts: list[str | Text]) -> Value:
    """Return one pattern for all ``texts``."""
    text = common_text(texts, "too many possible names")
    return unknown(text.hole.why) if text.hole else (text,)


def _joined_items(several: list[Items]) -> Items:
    first = several[0]
    if first.exact is not None and all(
        each.exact is not None and len(each.exact) == len(first.exact) for each in several
    ):
        return Items(
            tuple(join_all(column) for column in zip(*(each.exact or () for each in several), strict=True))
        )
    return Items(None, join_all(each.any_element() for each in several))


def widen(old: Value, new: Value, texts_too: bool) -> Value:
    """Join for a step towards a fixpoint: numbers that count become unknown, later growing texts a pattern."""
    if any(type(atom) is Unknown for atom in old):  # it covers numbers and texts already
        new = tuple(
            atom
            for atom in new
            if not (isinstance(atom, (int, float, str, Text)) and not contains(old, atom))
        )
    joined = join(old, new)
    if joined is old or not old:
        return joined
    if isinstance(joined[0], Items) and isinstance(old[0], Items):
        return (_widened_items(old[0], joined[0], texts_too),)
    fresh = [atom for atom in joined if not contains(old, atom)]
    if any(type(atom) in NUMBERS for atom in fresh):
        joined = join(tuple(atom for atom in joined if type(atom) not in NUMBERS), ANY)
    texts = [atom for atom in joined if isinstance(atom, (str, Text))]
    if texts_too and len(texts) > 1 and any(isinstance(atom, (str, Text)) for atom in fresh):
        joined = join(tuple(atom for atom in joined if not isinstance(atom, (str, Text))), widened(texts))
    if texts_too and any(isinstance(atom, Obj) for atom in fresh):
        joined = join(
            tuple(atom for atom in joined if not (isinstance(atom, Obj) and not contains(old, atom))), ANY
        )
    return joined


def _widened_items(old: Items, new: Items, texts_too: bool) -> Items:
    if old.exact is not None and new.exact is not None and not texts_too:
        return Items(tuple(widen(a, b, texts_too) for a, b in zip(old.exact, new.exact, strict=True)))
    return Items(None, widen(old.any_element(), new.any_element(), texts_too))


def present(value: Value) -> Value:
    """Return ``value`` where it is set."""
    return tuple(atom for atom in value if type(atom) is not Absent) if ABSENT[0] in value else value


def sole(value: Value | None) -> object:
    """Return the single atom of ``value``; ``Unknown`` where there is not exactly one."""
    return value[0] if value is not None and len(value) == 1 else ANY[0]


def strings(value: Value) -> list[str]:
    """Return the texts that are known in full."""
    return [atom for atom in value if isinstance(atom, str)]


def boolean(outcome: bool | None) -> Value:
    """Return the value of a test, which may have either outcome if it is not known."""
    return BOOLEAN if outcome is None else (outcome,)
