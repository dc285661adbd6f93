"""Numbers and texts as C++ computes them: division, overflow, methods of strings; what is not certain is unknown."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from nodl.infer.cpp.running.values import (
    END,
    MAX_LETTERS,
    NPOS,
    Bound,
    Const,
    Group,
    Obj,
    Param,
    Text,
    Unknown,
    Value,
    concatenated,
    join,
    literal,
    number_of,
    plain,
    unknown,
)

Computed = TypeVar("Computed")
_INT = (-(2**31), 2**31 - 1)
_LONG = (-(2**63), 2**63 - 1)
_RANGES = {
    "bool": (0, 1), "int": _INT, "short": (-(2**15), 2**15 - 1), "long": _LONG, "long long": _LONG,
    "size_t": (0, 2**64 - 1), "std::size_t": (0, 2**64 - 1), "unsigned": (0, 2**32 - 1), "unsigned int": (0, 2**32 - 1),
    "unsigned long": (0, 2**64 - 1),
    **{f"{space}uint{bits}_t": (0, 2**bits - 1) for bits in (8, 16, 32, 64) for space in ("", "std::")},
    **{f"{space}int{bits}_t": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)
       for space in ("", "std::")},
}  # fmt: skip
SIZES = {"bool": 1, "char": 1, "unsigned char": 1, "short": 2, "int": 4, "unsigned": 4, "unsigned int": 4, "float": 4,
         "double": 8, "long": 8, "size_t": 8, "std::size_t": 8,
         **{f"{sign}int{bits}_t": bits // 8 for bits in (8, 16, 32, 64) for sign in ("", "u")}}  # fmt: skip
"""Of fundamental types, on the 64 bit Linux that ROS 2 is built for."""


def _divided(left: Any, right: Any) -> Any:
    if not isinstance(left, int) or not isinstance(right, int):
        return left / right
    return abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1)


def _subtracted(left: Any, right: Any) -> Any:
    """Subtract; below zero is not certain: of sizes and other unsigned numbers it is a large one."""
    if isinstance(left, int) and isinstance(right, int) and 0 <= left < right:
        raise OverflowError
    return left - right


_ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b, "-": _subtracted, "*": lambda a, b: a * b, "/": _divided,
    "%": lambda a, b: int(math.fmod(a, b)), "<": lambda a, b: a < b, ">": lambda a, b: a > b, "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b, "|": lambda a, b: int(a) | int(b), "&": lambda a, b: int(a) & int(b),
    "^": lambda a, b: int(a) ^ int(b), "<<": lambda a, b: a << b if b < 32 else None, ">>": lambda a, b: a >> b,
}  # fmt: skip


def arithmetic(operator: str, left: object, right: object) -> Value:
    """Compute ``left operator right`` of two numbers, or the order of two texts."""
    if not isinstance(left, int | float) or not isinstance(right, int | float):
        return unknown("a computed value")
    try:
        found = _ARITHMETIC[operator](left, right)
    except (KeyError, ZeroDivisionError, TypeError, ValueError, OverflowError):
        return unknown("a computed value")
    if isinstance(found, int) and not isinstance(found, bool) and not _INT[0] <= found <= _INT[1]:
        return unknown("a number that is too large for an int")
    return (found,)


def computed(operator: str, left: object, right: object) -> Value:
    """Compute a comparison or arithmetic on two alternatives, enumerators by their number; unknown if undecided."""
    if operator in ("==", "!="):
        same = _same(left, right)
        return unknown("a comparison") if same is None else (same == (operator == "=="),)
    left, right = number_of(left), number_of(right)
    return arithmetic(operator, left, right)


def _same(left: object, right: object) -> bool | None:
    if isinstance(left, int | float) and isinstance(right, int | float):
        return left == right
    first, second = plain(left), plain(right)
    if first is not None and second is not None:
        return first == second
    if isinstance(left, Const) and isinstance(right, Const) and not {END, NPOS} & {left, right}:
        return left == right if None in (left.number, right.number) else left.number == right.number
    if (
        Const in (type(left), type(right))
        and isinstance(number_of(left), int)
        and isinstance(number_of(right), int)
    ):
        return number_of(left) == number_of(right)
    if isinstance(left, Const) and isinstance(right, Const):
        return left == right
    if END in (left, right) and isinstance(left if right == END else right, Obj | Group | Text | Bound):
        return False  # an element that was found
    if NPOS in (left, right) and isinstance(left if right == NPOS else right, int):
        return False
    return None


def added(left: Value, right: Value) -> Value:
    """Compute ``left + right``; if one is a text they are put together.

    Beside a number a text is a pointer that moves on; one letter may be a ``char``, which is a number itself.
    """
    if not any(isinstance(atom, int | float | Const) or _is_number(atom) for atom in (*left, *right)):
        return concatenated(left, right)
    return join(*(_sum(first, second) for first in left for second in right)) or unknown("a computed value")


def _sum(left: object, right: object) -> Value:
    if isinstance(left, int | float) and isinstance(right, int | float):
        return arithmetic("+", left, right)
    written, step = (plain(left), right) if isinstance(left, Text) else (plain(right), left)
    if written is not None and isinstance(step, int) and len(written) > 1 and 0 <= step <= len(written):
        return literal(written[step:])
    if not _is_number(left) and not _is_number(right) and not isinstance(step, int | float | Const):
        return concatenated((left,), (right,))
    return unknown("a computed value")


def _is_number(atom: object) -> bool:
    """Return whether it is a parameter whose default is a number."""
    return isinstance(atom, Param) and any(isinstance(each, int | float) for each in atom.default)


def as_type(name: str, value: Value) -> Value:
    """Return ``value`` as a variable of this fundamental type holds it; of other types as it was."""
    bounds = _RANGES.get(name)
    if bounds is None:
        as_float = name in ("double", "float")
        return tuple(float(atom) if as_float and type(atom) is int else atom for atom in value)
    return join(*((_held(atom, name, *bounds),) for atom in value))


def _held(atom: object, name: str, least: int, most: int) -> object:
    if isinstance(atom, Text):
        return Unknown("a letter as a number")
    if isinstance(atom, Const) and atom.number is not None:
        atom = atom.number
    if not isinstance(atom, int | float) or (isinstance(atom, bool) and name == "bool"):
        return atom
    if name == "bool":
        return bool(atom)
    if not math.isfinite(atom):
        return Unknown(f"a number that {name} cannot hold")
    whole = int(atom)
    return whole if least <= whole <= most else Unknown(f"a number that {name} cannot hold")


CHANGES_TEXT = frozenset({
    "erase", "replace", "insert", "pop_back", "assign", "resize", "remove_prefix", "remove_suffix", "swap", "clear",
    "push_back", "append",
})  # fmt: skip
"""Methods after which the text is another one."""


def asked_of_text(known: str, name: str, values: Sequence[Value]) -> Value | None:
    """Return what a method tells of the text ``known``; ``None`` if that is not certain."""
    return _computed(_ASKED.get(name), known, values)


def changed_text(known: str, name: str, values: Sequence[Value]) -> str | None:
    """Return the text ``known`` after a method that changes it; ``None`` if that is not certain."""
    after = _computed(_CHANGED.get(name), known, values)
    return after if after is not None and len(after) <= MAX_LETTERS else None


def _computed(method: Callable[..., Computed] | None, known: str, values: Sequence[Value]) -> Computed | None:
    arguments = _plain(values)
    if method is None or arguments is None:
        return None
    try:
        return method(known, *arguments)
    except (TypeError, IndexError, ValueError):
        return None


def _plain(values: Sequence[Value]) -> list[str | int] | None:
    found: list[str | int] = []
    for value in values:
        if len(value) != 1:
            return None
        one = value[0]
        known = one if isinstance(one, int) and not isinstance(one, bool) else _text(one)
        if one == NPOS:
            known = _TO_THE_END
        if known is None:
            return None
        found.append(known)
    return found


_TO_THE_END = 1 << 40


def _text(atom: object) -> str | None:
    return None if isinstance(atom, int | float) else plain(atom)


def _found(position: int) -> Value:
    return (position,) if position >= 0 else (NPOS,)


def _part(known: str, start: int = 0, count: int = _TO_THE_END) -> str:
    if not 0 <= start <= len(known):
        raise IndexError
    return known[start : start + count]


def _without(known: str, start: int = 0, count: int = _TO_THE_END) -> str:
    return known[:start] + known[len(known[:start]) + len(_part(known, start, count)) :]


def _exchanged(known: str, start: int, count: int, new: str) -> str:
    return known[:start] + _checked(new) + known[start + len(_part(known, start, count)) :]


def _with(known: str, start: int, new: str) -> str:
    return _part(known, 0, start) + _checked(new) + _part(known, start)


def _checked(new: object) -> str:
    if not isinstance(new, str):
        raise TypeError
    return new


_ASKED: dict[str, Callable[..., Value]] = {
    "find": lambda known, what, start=0: _found(known.find(_checked(what), start)),
    "rfind": lambda known, what: _found(known.rfind(_checked(what))),
    "find_first_of": lambda known, what: _found(next((i for i, c in enumerate(known) if c in what), -1)),
    "find_last_of": lambda known, what: _found(max((i for i, c in enumerate(known) if c in what), default=-1)),
    "size": lambda known: (len(known),), "length": lambda known: (len(known),), "empty": lambda known: (not known,),
    "front": lambda known: literal(known[0]), "back": lambda known: literal(known[-1]),
    "at": lambda known, at: literal(_part(known, at, 1) or _checked(None)),
    "substr": lambda known, *where: literal(_part(known, *where)),
    "starts_with": lambda known, what: (known.startswith(what),),
    "ends_with": lambda known, what: (known.endswith(what),),
    "contains": lambda known, what: (_checked(what) in known,),
    "compare": lambda known, other: ((known > _checked(other)) - (known < _checked(other)),),
}  # fmt: skip
_CHANGED: dict[str, Callable[..., str]] = {
    "erase": _without, "replace": _exchanged, "insert": _with, "pop_back": lambda known: _checked(known and known[:-1]),
    "assign": lambda known, new: _checked(new), "clear": lambda known: "",
    "push_back": lambda known, new: known + _checked(new), "append": lambda known, new: known + _checked(new),
    "resize": lambda known, size: known[:size] if size <= len(known) else _checked(None),
    "remove_prefix": lambda known, size: _part(known, size),
    "remove_suffix": lambda known, size: _part(known, 0, len(known) - size),
}  # fmt: skip
