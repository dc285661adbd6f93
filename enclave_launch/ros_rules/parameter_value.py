"""The values that a ROS 2 parameter can have (``rcl_interfaces/msg/ParameterValue``), and which of them a plain YAML
scalar is for rcl."""

from __future__ import annotations

import math
import re

Scalar = bool | int | float | str
ParameterValue = Scalar | bytes | tuple[Scalar | bytes, ...]

_BOOLEANS = {
    **dict.fromkeys(("Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"), True),
    **dict.fromkeys(("N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"), False),
}
# strtoll with base 0 and strtod; the blanks they skip are those of ASCII
_INTEGER = re.compile(r"\s*[+-]?(?:0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)", re.ASCII)
_DOUBLE = re.compile(
    r"\s*[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|inf(?:inity)?|nan)",
    re.IGNORECASE | re.ASCII,
)
_NAMED_DOUBLE = re.compile(r"([+-]?)\.(inf|Inf|INF)|()\.(nan|NaN|NAN)")
_BEGIN_NUMBERS = frozenset("+-.0123456789 \t\n\v\f\r")
_NAMES_OF_NUMBERS = frozenset(("inf", "infinity", "nan"))
_DIGITS_THAT_FIT = 19
_MOST_DIGITS = 25  # of a number in 64 bits, in whichever base
_TYPE_NAMES: dict[type, str] = {bool: "bool", int: "int", float: "double", str: "string", bytes: "byte"}
_SLOTS: dict[type, int] = {bool: 0, int: 1, float: 2, str: 3, bytes: 5}


def type_slot(value: ParameterValue) -> int:
    """Return the position in rcl's order of types: scalars, bytes, then arrays; readers take the first there is."""
    if isinstance(value, tuple):
        return 10 + (_SLOTS.get(type(value[0]), 9) if value else 9)
    return _SLOTS[type(value)]


def type_name(value: ParameterValue) -> str:
    """Return the type of a value as NoDL names it; of an empty array nothing but that."""
    if isinstance(value, tuple):
        return f"{type_name(value[0])}_array" if value else "array"
    return _TYPE_NAMES[type(value)]


def plain_scalar(text: str) -> Scalar:
    """Type a plain YAML scalar by the rules of rcl's parser (``parse.c``, ``get_value``), which are not YAML 1.1's."""
    if text in _BOOLEANS:
        return _BOOLEANS[text]
    if len(text) < _DIGITS_THAT_FIT and text.isascii():  # most numbers; the rest is for strtoll and strtod
        if text.isdigit():
            if text[0] != "0":
                return int(text)
        elif text[:1].isdigit() and text.replace(".", "", 1).isdigit() and (number := float(text)) > 0:
            return number
    if text[:1] not in _BEGIN_NUMBERS and text.lower() not in _NAMES_OF_NUMBERS:
        return text
    integer = _strtoll(text) if _INTEGER.fullmatch(text) else None
    return _strtod(text) if integer is None else integer


def _strtoll(text: str) -> int | None:
    digits = text.strip().lstrip("+-")
    base = 16 if digits[:2] in ("0x", "0X") else 8 if digits.startswith("0") else 10
    if len(digits) > _MOST_DIGITS:
        return None
    number = int(digits, base) * (-1 if "-" in text else 1)
    return number if -(2**63) <= number < 2**63 else None


def _strtod(text: str) -> float | str:
    """Convert text to a double; text that does not fit into one (``1e999``, ``1e-999``) is returned as it is."""
    if not _DOUBLE.fullmatch(text):
        named = _NAMED_DOUBLE.fullmatch(text)
        return float("".join(part for part in named.groups() if part)) if named else text
    number = float(text)
    if 0 < abs(number) < math.inf or "n" in text.lower():  # inf, nan
        return number
    has_digits = any(digit in "123456789" for digit in text.lower().partition("e")[0])
    return text if has_digits else number
