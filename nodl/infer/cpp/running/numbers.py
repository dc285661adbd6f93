"""Numbers as C++ computes them: division, overflow, conversion to a declared type; what is not certain is unknown."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from nodl.infer.cpp.running.values import (
    Const,
    Param,
    Text,
    Unknown,
    Value,
    concatenated,
    join,
    literal,
    plain,
    unknown,
)

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
    """Of sizes and other unsigned numbers it is a large one: below zero is not certain."""
    if isinstance(left, int) and isinstance(right, int) and 0 <= left < right:
        raise OverflowError
    return left - right


_ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b, "-": _subtracted, "*": lambda a, b: a * b, "/": _divided,
    "%": lambda a, b: int(math.fmod(a, b)), "<": lambda a, b: a < b, ">": lambda a, b: a > b, "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b, "|": lambda a, b: int(a) | int(b), "&": lambda a, b: int(a) & int(b),
    "^": lambda a, b: int(a) ^ int(b), "<<": lambda a, b: a << b if b < 32 else None, ">>": lambda a, b: a >> b,
}  # fmt: skip
_OF_TEXTS: dict[str, Callable[[str, str], bool]] = {
    "<": lambda a, b: a < b, ">": lambda a, b: a > b, "<=": lambda a, b: a <= b, ">=": lambda a, b: a >= b,
}  # fmt: skip


def arithmetic(operator: str, left: object, right: object) -> Value:
    """``left operator right`` of two numbers, or the order of two texts."""
    if isinstance(left, Text) and isinstance(right, Text) and operator in _OF_TEXTS:
        texts = plain(left), plain(right)
        if texts[0] is not None and texts[1] is not None and len(texts[0]) != 1 != len(texts[1]):
            return (_OF_TEXTS[operator](texts[0], texts[1]),)
    if not isinstance(left, int | float) or not isinstance(right, int | float):
        return unknown("a computed value")
    try:
        found = _ARITHMETIC[operator](left, right)
    except (KeyError, ZeroDivisionError, TypeError, ValueError, OverflowError):
        return unknown("a computed value")
    if isinstance(found, int) and not isinstance(found, bool) and not _INT[0] <= found <= _INT[1]:
        return unknown("a number that is too large for an int")
    return (found,)


def added(left: Value, right: Value) -> Value:
    """``left + right`` where one is a text: put together. Beside a number a text is a pointer that moves on; one
    letter may be a ``char``, which is a number itself."""
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
    """A parameter whose default is a number."""
    return isinstance(atom, Param) and any(isinstance(each, int | float) for each in atom.default)


def as_type(name: str, value: Value) -> Value:
    """``value`` as a variable of this fundamental type holds it; of other types it is as it was."""
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
    whole = int(atom)
    return whole if least <= whole <= most else Unknown(f"a number that {name} cannot hold")
