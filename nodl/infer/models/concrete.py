"""Known values as real Python objects and back, so that pure functions of Python's library compute on them.

Only constants, containers of them and objects of a few immutable library classes become real. What is not known, and
the program's own objects, travel as ``Opaque``: they may be moved about (``zip``, ``reversed``, ``sorted`` by a key)
and refuse everything else. Functions of the program become callables that the interpreter runs.
"""

from __future__ import annotations

import collections
import itertools
import re
import string
from collections.abc import Callable, Iterable, Iterator
from pathlib import PurePosixPath
from types import GeneratorType
from typing import Any

from nodl.infer.interpreter.frames import Arguments, Call
from nodl.infer.interpreter.raising import throw
from nodl.infer.interpreter.run import Run
from nodl.infer.methods import BoundMethod, ClassMethod, ForeignMethod, Getter, NativeMethod, Partial
from nodl.infer.text import MAX_LENGTH
from nodl.infer.values import (
    ANY,
    CONSTANTS,
    ClassValue,
    Dictionary,
    External,
    FunctionValue,
    Items,
    Key,
    NativeObject,
    Sequence,
    Value,
    unknown,
)

MAX_ELEMENTS = 2_000  # of one container
MAX_NUMBER = 1 << 12  # as an argument: widths, counts
MAX_TEXT = 1 << 14
_LARGE = 1 << 256  # as a result
_CALLABLE = (
    FunctionValue, BoundMethod, Partial, Getter, ClassValue, ClassMethod, External, NativeMethod, ForeignMethod,
)  # fmt: skip
_IMMUTABLE = (re.Pattern, re.Match, PurePosixPath, string.Template)
_ITERATORS: tuple[type, ...] = (
    GeneratorType, map, filter, zip, enumerate, reversed,
    type(iter([])), type(iter(())), type(iter({})), type(iter(set())), type(iter("")), type(iter(range(0))),
    type(iter({}.items())), type(iter({}.values())), type(reversed([])),
    *(kind for kind in vars(itertools).values() if isinstance(kind, type)),
)  # fmt: skip


class NotConcrete(Exception):
    """The computation needs something that is not known."""


def _refuse(*_: object, **__: object) -> Any:
    raise NotConcrete


class Opaque:
    """A value that may be passed on and nothing else."""

    __slots__ = ("value",)

    def __init__(self, value: Value) -> None:
        self.value = value

    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = __add__ = __radd__ = _refuse
    __bool__ = __len__ = __iter__ = __getitem__ = __contains__ = __str__ = __repr__ = __format__ = _refuse
    __int__ = __float__ = __index__ = __call__ = _refuse
    __hash__ = _refuse


class Callback:
    """A function of the program (or of a library), called through the interpreter."""

    __slots__ = ("call", "run", "value")

    def __init__(self, run: Run, value: Value, call: Call) -> None:
        self.run, self.value, self.call = run, value, call

    __str__ = __repr__ = __format__ = __eq__ = __lt__ = __bool__ = __len__ = __iter__ = _refuse
    __hash__ = _refuse

    def __call__(self, *given: object) -> Any:
        arguments = [
            from_python(self.run, each, self.call, f"given {index}") for index, each in enumerate(given)
        ]
        previous = self.run.enter(("callback", id(self.call.node), next(self.run.callback_count)))
        result = self.run.call(self.value, Arguments(arguments), self.call.node, self.call.frame)
        self.run.context = previous
        return to_python(self.run, result, self.call)


def is_usable(run: Run, obj: NativeObject) -> bool:
    """An object that changes is followed as long as no undecided branch lies between its making and its use."""
    if isinstance(obj.object, _IMMUTABLE):
        return True
    return not obj.lost and run.state.forks == obj.forks


def to_python(run: Run, value: Value, call: Call, deep: bool = False, level: int = 0) -> Any:
    """The real object of ``value``; inner containers stay themselves unless ``deep``."""
    if len(value) != 1:
        return Opaque(value)
    atom = value[0]
    if isinstance(atom, CONSTANTS):
        return atom
    if isinstance(atom, NativeObject):
        if not is_usable(run, atom):
            return Opaque(value)
        return _Bounded(atom.object) if isinstance(atom.object, _ITERATORS) else atom.object
    if isinstance(atom, Sequence) and (deep or level == 0 or atom.kind == "tuple"):
        return _real_sequence(run, atom, value, call, deep, level)
    if isinstance(atom, Dictionary) and (deep or level == 0):
        return _real_dictionary(run, atom, value, call, deep, level)
    if isinstance(atom, _CALLABLE) and not (isinstance(atom, External) and "(" in atom.path):
        return Callback(run, value, call)
    return Opaque(value)


class _Bounded:
    """An iterator for someone who may ask it for everything, and for nothing else."""

    __slots__ = ("_left", "_source")

    def __init__(self, source: Any) -> None:
        self._source = source
        self._left = MAX_ELEMENTS

    def __iter__(self) -> Iterator[Any]:
        return self

    def __next__(self) -> Any:
        self._left -= 1
        if self._left < 0:
            raise NotConcrete
        return next(self._source)

    __str__ = __repr__ = __format__ = _refuse


def _real_sequence(run: Run, atom: Sequence, value: Value, call: Call, deep: bool, level: int) -> Any:
    exact = atom.items.exact
    if exact is None or atom.escaped or atom.summary or level > 20:
        return Opaque(value)
    run.spend(len(exact))
    parts = [to_python(run, part, call, deep, level + 1) for part in exact]
    if atom.kind == "tuple":
        return tuple(parts)
    return set(parts) if atom.kind in ("set", "frozenset") else parts


def _real_dictionary(run: Run, atom: Dictionary, value: Value, call: Call, deep: bool, level: int) -> Any:
    entries = atom.entries()
    if atom.is_open or atom.summary or level > 20 or not all(certain for _, _, certain in entries):
        return Opaque(value)
    if not all(isinstance(key.constant, CONSTANTS) for key, _, _ in entries):
        return Opaque(value)
    run.spend(len(entries))
    real = {key.constant: to_python(run, held, call, deep, level + 1) for key, held, _ in entries}
    return collections.Counter(real) if atom.kind == "Counter" else real


def from_python(run: Run, found: Any, call: Call, place: str = "") -> Value:
    """The value of a real object. Raises ``NotConcrete`` for what has none."""
    run.spend(1)
    if isinstance(found, Opaque | Callback):
        return found.value
    if isinstance(found, _Bounded):
        return (NativeObject(found._source, run.state.forks),)
    if isinstance(found, CONSTANTS):
        return _constant(found)
    if isinstance(found, dict):
        return _from_dictionary(run, found, call, place)
    if isinstance(found, list | tuple | set | frozenset | collections.deque | range):
        return _from_sequence(run, found, call, place)
    if isinstance(found, _IMMUTABLE + _ITERATORS) or type(found).__module__ == "configparser":
        return (NativeObject(found, run.state.forks),)
    if type(found).__name__ in ("dict_keys", "dict_values", "dict_items"):
        return _from_sequence(run, list(found), call, place)
    raise NotConcrete


def _constant(found: Any) -> Value:
    if isinstance(found, str | bytes) and len(found) > MAX_LENGTH:
        return unknown("a very long text")
    if isinstance(found, int) and abs(found) > _LARGE:
        return ANY
    if found != found:
        return ANY  # not a number: no two are equal, so that they would pile up
    return (found,)


def _from_sequence(run: Run, found: Any, call: Call, place: str) -> Value:
    if len(found) > MAX_ELEMENTS:
        raise NotConcrete
    kind = "set" if isinstance(found, set | frozenset) else "list"
    listed = in_order(found) if kind == "set" else found
    parts = tuple(from_python(run, each, call, f"{place} {index}") for index, each in enumerate(listed))
    if isinstance(found, tuple | range):
        return run.tuple_of(parts)
    obj = run.allocate(call.node, f"{kind}{place}", lambda: Sequence(kind, Items(parts)))
    if obj.summary:
        run.state.store(obj, "[items]", (Items(parts),))
    return (obj,)


def in_order(found: Iterable[Any]) -> list[Any]:
    """The elements of a set, in the same order everywhere."""
    return sorted(found, key=lambda each: (type(each).__name__, repr(each)))


def _from_dictionary(run: Run, found: dict[Any, Any], call: Call, place: str) -> Value:
    obj = run.allocate(call.node, f"dict{place}", Dictionary)
    if isinstance(found, collections.Counter):
        obj.kind = "Counter"
        obj.default = (External("builtins.int"),)
    for key, held in found.items():
        if not isinstance(key, CONSTANTS):
            raise NotConcrete
        run.state.store(obj, Key(key), from_python(run, held, call, f"{place} {key!r}"))
    return (obj,)


# --- computing ----------------------------------------------------------------------------------------------


# Of a pure function.
_ERRORS = (ValueError, TypeError, LookupError, ArithmeticError, AttributeError, re.error)


def compute(
    run: Run,
    function: Callable[..., Any],
    call: Call,
    deep: bool = False,
    owner: Any = None,
    any_size: bool = False,
) -> Value | None:
    """``function`` of the call's arguments, or ``None`` where they are not known well enough.

    An error of the function is an exception of the program.
    """
    args = call.args
    if args.more or args.more_keywords:
        return None
    try:
        positional = [to_python(run, value, call, deep) for value in args.positional]
        keywords = {name: to_python(run, value, call, deep) for name, value in args.keywords.items()}
        if not any_size:
            _check_size((*positional, *keywords.values(), owner))
    except NotConcrete:
        return None
    try:
        return from_python(run, function(*positional, **keywords), call)
    except (NotConcrete, RecursionError, MemoryError):
        return None
    except (*_ERRORS, StopIteration) as error:
        if _holds_opaque((*positional, *keywords.values(), owner)):
            return None  # it may be about what is not known
        throw(run, type(error) if type(error).__module__ == "builtins" else "ValueError", str(error))
        return ANY


def _holds_opaque(given: Iterable[object]) -> bool:
    for each in given:
        if isinstance(each, dict) and _holds_opaque(each.values()):
            return True
        if isinstance(each, list | tuple | collections.deque) and _holds_opaque(each):
            return True
        if not isinstance(each, _SEEN_THROUGH):
            return True  # an iterator, say, which may yield such
    return False


_SEEN_THROUGH = (*CONSTANTS, *_IMMUTABLE, dict, list, tuple, set, frozenset, range, collections.deque)


def _check_size(given: tuple[object, ...]) -> None:
    for each in given:
        large = isinstance(each, int) and abs(each) > MAX_NUMBER
        large = large or (isinstance(each, float) and abs(each) > 1e300)
        if large or (isinstance(each, str | bytes) and len(each) > MAX_TEXT):
            raise NotConcrete


def pulled(run: Run, obj: NativeObject, call: Call) -> Iterator[Value]:
    """The elements of a real iterable, one by one. Raises ``NotConcrete``, also where the iterable itself raises."""
    iterable: Any = obj.object
    try:
        for index, each in enumerate(iterable):
            yield from_python(run, each, call, f"pulled {index}")
    except _ERRORS as error:
        run.risks += 1
        raise NotConcrete from error


def lose(run: Run, obj: NativeObject) -> Value:
    """The object is used where it cannot be followed: from now on nobody knows what it gives."""
    if not obj.lost:
        obj.lost = True
        run.state.pulled += 1
    run.escape(Arguments(list(obj.sources)), objects=True)
    return unknown("an element of an iterator that is used in more than one place")
