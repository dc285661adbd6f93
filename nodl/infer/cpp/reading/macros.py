"""Macros: their expansion in a text and the value of an ``#if``. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

MAX_DEPTH = 12

_WORD = re.compile(
    r'R"(?P<d>[^\s()\\]{0,16})\((?:.|\n)*?\)(?P=d)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|[A-Za-z_]\w*'
)
_CLOSERS = {")": "(", "]": "[", "}": "{"}

# Compilers for ROS 2's Linux targets define or never define these (GCC and Clang, predefined macros).
_KNOWN_SYMBOLS: dict[str, bool] = {
    "_WIN32": False, "WIN32": False, "_MSC_VER": False, "__APPLE__": False, "__MINGW32__": False, "_WIN64": False,
    "__CYGWIN__": False, "__ANDROID__": False, "__QNX__": False, "__linux__": True, "__unix__": True, "__GNUC__": True,
    "__cplusplus": True, "__EMSCRIPTEN__": False, "__CUDACC__": False, "_DEBUG": False,
}  # fmt: skip
_VALUES = {"__cplusplus": 201703, "__GNUC__": 13, "true": 1, "false": 0}


class Macro(NamedTuple):
    """``parameters``: ``None`` for a macro without parentheses. ``uncertain``: defined under an open condition."""

    parameters: list[str] | None
    body: str
    uncertain: bool = False


def expanded(source: str, macros: Mapping[str, Macro], depth: int = 0) -> str:
    """Replace every use of ``macros`` in ``source``, on the line where the use begins."""
    if not macros or depth > MAX_DEPTH:
        return source
    out: list[str] = []
    position = 0
    for match in _WORD.finditer(source):
        word = match[0]
        macro = macros.get(word)
        if match.start() < position or macro is None or macro.uncertain:
            continue
        end, given = match.end(), None
        if macro.parameters is not None:
            given, end = _arguments(source, match.end())
            if given is None:
                continue
        rest = {name: each for name, each in macros.items() if name != word}
        scanned = [expanded(each, macros, depth + 1) for each in given or ()]
        body = expanded(_filled(macro, given or [], scanned), rest, depth + 1)
        out += [source[position : match.start()], body, "\n" * source.count("\n", match.start(), end)]
        position = end
    out.append(source[position:])
    return "".join(out)


def _arguments(source: str, position: int) -> tuple[list[str] | None, int]:
    """Return the texts between parentheses and the place behind them."""
    while position < len(source) and source[position].isspace():
        position += 1
    if position >= len(source) or source[position] != "(":
        return None, position
    found: list[str] = [""]
    depth = 0
    while position < len(source):
        literal = _WORD.match(source, position) if source[position] in "\"'R" else None
        piece = literal[0] if literal else source[position]
        position += len(piece)
        if piece in ("(", "[", "{"):
            depth += 1
            if depth == 1:
                continue
        elif piece in _CLOSERS:
            depth -= 1
            if depth == 0:
                return [each.strip() for each in found], position
        if piece == "," and depth == 1:
            found.append("")
        else:
            found[-1] += " " if piece == "\n" else piece
    return None, position


def _filled(macro: Macro, given: list[str], scanned: list[str]) -> str:
    """Fill the body with its arguments: as written beside ``#`` and ``##``, else ``scanned`` ([cpp.subst])."""
    if not macro.parameters:
        return macro.body
    values, expanded_ones = _by_name(macro, given), _by_name(macro, scanned)
    body = re.sub(r"(?<!#)#\s*(\w+)", lambda m: _quoted(values[m[1]]) if m[1] in values else m[0], macro.body)
    if "##" in body:
        body = re.sub(r"(\w+)(?=\s*##)|(?<=##)(\s*\w+)", lambda m: values.get(m[0].strip(), m[0]), body)
        body = re.sub(r"\s*##\s*", "", body)
    return _WORD.sub(lambda m: expanded_ones.get(m[0], m[0]), body)


def _by_name(macro: Macro, given: list[str]) -> dict[str, str]:
    names = [name for name in macro.parameters or () if name]
    values = dict(zip(names, given, strict=False))
    if names and names[-1].endswith("..."):
        values["__VA_ARGS__"] = ", ".join(given[len(names) - 1 :])
    return values


def _quoted(value: str) -> str:
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'


# --- conditions ---------------------------------------------------------------------------------------------


def decided(
    condition: str, macros: Mapping[str, Macro], complete: bool, has_include: Callable[[str], bool | None]
) -> bool | None:
    """Return the value of an ``#if``; ``None`` if a symbol in it may be defined where we cannot see it."""
    tokens = re.findall(r"[A-Za-z_]\w*|\d+|&&|\|\||[!<>=]=|[()!<>+\-*,./\"]", condition)
    try:
        value = _Condition(tokens, macros, complete, has_include).value()
    except (IndexError, ValueError, RecursionError):
        return None
    return None if value is None else bool(value)


class _Condition:
    """``||``, ``&&``, comparisons, ``!``, ``defined``; every value may be unknown."""

    def __init__(
        self,
        tokens: list[str],
        macros: Mapping[str, Macro],
        complete: bool,
        has_include: Callable[[str], bool | None],
    ):
        self.tokens, self.macros, self.complete, self.has_include = tokens, macros, complete, has_include

    def value(self) -> int | None:
        found = self._or()
        if self.tokens:
            raise ValueError(self.tokens)
        return found

    def _or(self) -> int | None:
        left = self._and()
        while self.tokens and self.tokens[0] == "||":
            self.tokens.pop(0)
            right = self._and()
            left = 1 if left or right else (None if left is None or right is None else 0)
        return left

    def _and(self) -> int | None:
        left = self._compared()
        while self.tokens and self.tokens[0] == "&&":
            self.tokens.pop(0)
            right = self._compared()
            left = 0 if left == 0 or right == 0 else (None if left is None or right is None else 1)
        return left

    def _compared(self) -> int | None:
        left = self._unary()
        while self.tokens and self.tokens[0] in ("==", "!=", "<", ">", "<=", ">="):
            operator, right = self.tokens.pop(0), self._unary()
            left = None if left is None or right is None else int(_COMPARE[operator](left, right))
        return left

    def _unary(self) -> int | None:
        token = self.tokens.pop(0)
        if token == "!":
            value = self._unary()
            return None if value is None else int(not value)
        if token == "(":
            value = self._or()
            self._expect(")")
            return value
        if token.isdigit():
            return int(token)
        if token == "defined":
            return self._defined()
        return self._symbol(token)

    def _expect(self, token: str) -> None:
        if self.tokens.pop(0) != token:
            raise ValueError(token)

    def _defined(self) -> int | None:
        parenthesis = self.tokens[0] == "("
        if parenthesis:
            self.tokens.pop(0)
        name = self.tokens.pop(0)
        if parenthesis:
            self._expect(")")
        if name == "__has_include":
            return 1
        if name in self.macros:
            return None if self.macros[name].uncertain else 1
        if name in _KNOWN_SYMBOLS:
            return int(_KNOWN_SYMBOLS[name])
        return 0 if self.complete else None

    def _version(self, name: str, given: list[str]) -> int | None:
        """Decide ``RCLCPP_VERSION_GTE(28, 0, 0)``, of the ``version.h`` that ament_generate_version_header() writes."""
        wanted = [int(token) for token in given if token.isdigit()]
        if not name.endswith("_VERSION_GTE") or len(wanted) != 3:
            return None
        stem = name.removesuffix("GTE")
        present = [self._symbol(stem + part) if stem + part in self.macros else None for part in _VERSION]
        if None in present:
            return None
        return int([number for number in present if number is not None] >= wanted)

    def _symbol(self, name: str) -> int | None:
        if self.tokens and self.tokens[0] == "(":
            inside = []
            depth = 0
            while True:
                token = self.tokens.pop(0)
                depth += (token == "(") - (token == ")")
                inside.append(token)
                if depth == 0:
                    break
            if name == "__has_include":
                found = self.has_include("".join(inside[2:-2]))
                return None if found is None else int(found)
            return self._version(name, inside)
        if name in _VALUES:
            return _VALUES[name]
        macro = self.macros.get(name)
        if macro is not None and macro.parameters is None and not macro.uncertain:
            body = macro.body.strip("() LlUu")
            return (
                int(body)
                if body.isdigit()
                else (1 if body in ("", "true", "ON") else 0 if body == "false" else None)
            )
        return 0 if self.complete and macro is None else None


_VERSION = ("MAJOR", "MINOR", "PATCH")
_COMPARE: dict[str, Callable[[int, int], bool]] = {
    "==": lambda a, b: a == b, "!=": lambda a, b: a != b, "<": lambda a, b: a < b,
    ">": lambda a, b: a > b, "<=": lambda a, b: a <= b, ">=": lambda a, b: a >= b,
}  # fmt: skip
