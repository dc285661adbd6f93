"""Numbers and texts as C++ computes them: sums, products, comparisons; what is not certain is unknown."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from typing import Any

from enclave_addons.inference.cpp.reading.declarations import BIT_FIELD
from enclave_addons.inference.cpp.running.values import (
    END,
    Const,
    Group,
    Param,
    Text,
    Unknown,
    Value,
    concatenated,
    join,
    plain,
    unknown,
)

LARGEST = 2**31 - 1
"""Larger numbers are not known; below zero neither are results: of unsigned numbers they are large ones."""
_ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
_OF_INTEGERS: dict[str, Callable[[int, int], int]] = {
    "/": operator.floordiv, "%": operator.mod, "&": operator.and_, "|": operator.or_, "^": operator.xor,
    "<<": lambda left, right: left << min(right, 64), ">>": operator.rshift,
}  # fmt: skip


def arithmetic(sign: str, left: object, right: object) -> Value:
    """Compute ``left sign right`` of two numbers."""
    if not isinstance(left, int) or not isinstance(right, int):
        return unknown("a computed value")
    found: int | float
    if sign in _ARITHMETIC:
        found = _ARITHMETIC[sign](left, right)
    elif sign in _OF_INTEGERS and isinstance(left, int) and isinstance(right, int) and min(left, right) >= 0:
        found = _OF_INTEGERS[sign](left, right) if right or sign not in ("/", "%") else -1
    else:
        return unknown("a computed value")
    return (found,) if isinstance(found, float) or 0 <= found <= LARGEST else unknown("a computed value")


def computed(sign: str, left: object, right: object) -> Value:
    """Compute a comparison or arithmetic on two alternatives; unknown if undecided."""
    if sign in ("==", "!="):
        same = _same(left, right)
        return unknown("a comparison") if same is None else (same == (sign == "=="),)
    return arithmetic(sign, left, right)


def _same(left: object, right: object) -> bool | None:
    if isinstance(left, int) and isinstance(right, int):
        return left == right
    if isinstance(left, Const) and isinstance(right, Const):
        return left == right
    if END in (left, right) and isinstance(left, Group) != isinstance(right, Group):  # what find() gives
        return False
    first, second = plain(left), plain(right)
    return None if first is None or second is None else first == second


def added(left: Value, right: Value) -> Value:
    """Compute ``left + right``: numbers are added, texts put together; beside a number a text is a pointer that moves
    on, which is not followed.
    """
    if not any(map(_is_number, (*left, *right))):
        return concatenated(left, right)
    return join(*(_sum(first, second) for first in left for second in right)) or unknown("a computed value")


def _sum(left: object, right: object) -> Value:
    if _is_number(left) or _is_number(right):
        return arithmetic("+", left, right)
    return concatenated((left,), (right,))


def _is_number(atom: object) -> bool:
    """Return whether it is a number, an enumerator, or a parameter whose default is a number."""
    default = atom.default if isinstance(atom, Param) else ()
    return any(isinstance(each, int | float | Const) for each in (atom, *default))


_INTEGER = re.compile(
    r"(?:std::)?(?:(?P<unsigned>u?)int(?P<bits>\d*)(?:_t)?|size_t|short|long(?: long)?|unsigned(?: \w+)*)"
)


def as_type(name: str, value: Value) -> Value:
    """Return ``value`` as a variable of this fundamental type holds it; of other types as it was."""
    if name in ("double", "float", BIT_FIELD) and any(isinstance(a, int | Text | Unknown) for a in value):
        return unknown("a part of a number")
    if name == "bool":
        return join(*((_as_bool(atom),) for atom in value))
    match = _INTEGER.fullmatch(name)
    return value if match is None else join(*((_held(atom, match),) for atom in value))


def _as_bool(atom: object) -> object:
    """Return a number as a condition, a text as one that is not known."""
    if isinstance(atom, Text):
        return Unknown("a condition")
    return bool(atom) if isinstance(atom, int) else atom


def _held(atom: object, kind: re.Match[str]) -> object:
    """Return a number as an integer holds it; one that not every integer of the kind has is not known."""
    if isinstance(atom, Text):
        return Unknown("a letter as a number")
    if not isinstance(atom, int):
        return atom
    is_small = "short" in kind[0] or "char" in kind[0] or kind["bits"] in ("8", "16")
    is_signed = kind[0] in ("int", "long") or (kind["unsigned"] == "" and kind["bits"])
    least, most = -128 if is_signed else 0, 127 if is_small else LARGEST
    return int(atom) if least <= atom <= most else Unknown(f"a number that {kind[0]} may not hold")
