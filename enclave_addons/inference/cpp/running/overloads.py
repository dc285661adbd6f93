"""Which of several functions of one name a call means, by the number and the looks of its arguments."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import repeat

from enclave_addons.inference.cpp.reading.declarations import Function, FunctionParameter
from enclave_addons.inference.cpp.running.values import Bound, Lambda, Map, Obj, Seq, Text, Value, plain


def chosen(functions: Sequence[Function], arguments: Sequence[Value]) -> Function | None:
    """Choose the overload that takes so many arguments; of several, the one whose parameters look like them."""
    found = candidates(functions, arguments)
    return found[0] if found else None


def candidates(
    functions: Sequence[Function], arguments: Sequence[Value], kinds: Sequence[str] = ()
) -> Sequence[Function]:
    """Find the overloads that fit best: all of them where their looks do not tell them apart, as ``f() const`` and
    ``f()``.

    Args:
        kinds: The types of arguments that are numbers, ``text`` of texts, empty if not known.
    """
    kinds = [*kinds, *[""] * (len(arguments) - len(kinds))]
    fitting = [each for each in functions if _takes(each, len(arguments))]
    if len(fitting) <= 1:
        return fitting or (functions if len(functions) == 1 else ())
    scores = [
        sum(map(_likeness, each.parameters, arguments, kinds, repeat(each.templates))) for each in fitting
    ]
    best = max(scores)
    unsure = best < _EXACT * len(arguments)  # by a conversion that there may not be: then f(...) is meant
    rated = zip(fitting, scores, strict=True)
    return [each for each, score in rated if score == best or (unsure and each.variadic)]


def fits(function: Function, arguments: Sequence[Value]) -> bool:
    """Return whether a function takes so many arguments, none of which looks as if it were of another type."""
    if not _takes(function, len(arguments)):
        return False
    pairs = zip(function.parameters, arguments, strict=False)
    return all(_likeness(parameter, value, "", function.templates) >= 0 for parameter, value in pairs)


_EXACT = 3
"""What ``_likeness`` gives an argument that needs no conversion."""


_GENERIC = re.compile(r"(?:const )?[A-Z]\w*(?: ?[&*]+)?")


def _takes(function: Function, count: int) -> bool:
    required = sum(1 for p in function.parameters if p.default is None and "..." not in p.type)
    return function.variadic or required <= count <= len(function.parameters)


_ALIKE = {
    "uint8_t": "unsigned char", "int16_t": "short", "int32_t": "int", "uint32_t": "unsigned int",
    "unsigned": "unsigned int", "int64_t": "long", "uint64_t": "unsigned long", "size_t": "unsigned long",
}  # fmt: skip
_ARITHMETIC = re.compile(
    r"bool|char|double|float|short|(?:un)?signed(?: \w+)*|long(?: \w+)*|u?int(?:\d+_t)?|size_t"
)
_SMALL = frozenset({"bool", "char", "unsigned char", "int8_t", "short", "uint16_t"})


def as_number(written: str) -> str:
    """Return the type of a number under its shortest name; empty for any other type."""
    name = re.sub(r"\bconst\b|std::|&", "", written).strip()
    return _ALIKE.get(name, name) if _ARITHMETIC.fullmatch(name) else ""


def _of_number(parameter: FunctionParameter, kind: str, templates: Sequence[str]) -> float | None:
    """Rate a parameter that takes numbers for one of type ``kind``, which any of them may be if it is not known
    ([over.ics.rank]); ``None`` for one that takes none.
    """
    taken = as_number(parameter.type)
    if {*re.findall(r"\w+", parameter.type)} & {*templates, "auto"}:
        return 2.5 if kind else 3
    if not taken:
        return None
    return 3 if taken == kind or not kind else 2 if taken == "int" and kind in _SMALL else 1


def _likeness(parameter: FunctionParameter, value: Value, seen: str, templates: Sequence[str]) -> float:
    """Rate how well an argument fits a parameter, by their looks.

    A text may be a literal, which is rather a template's ``T`` or ``true`` than a ``std::string`` ([over.ics.rank]).
    """
    atom = value[0] if value else None
    kind = parameter.type
    is_text = "string" in kind or "char" in kind
    is_generic = _GENERIC.fullmatch(kind) is not None and "Descriptor" not in kind
    may_be_letter = isinstance(atom, Text) and not seen and len(plain(atom) or "") == 1
    seen = seen.removeprefix("text")
    if seen or type(atom) is int or may_be_letter:
        rated = _of_number(parameter, seen, templates)
        if rated is not None:
            return rated
        if seen and is_text:
            return -3
    if isinstance(atom, Text):
        is_template = not {*re.findall(r"\w+", kind)}.isdisjoint(templates)
        return 3 if is_template or _OF_TEXT.search(kind.partition("<")[0]) else 1 if is_generic else -3
    if isinstance(atom, Obj):
        names = {atom.type.last, *(c.name for c in atom.bindings)}
        if atom.node is not None and ("Node" in kind or "node" in kind):
            return 3
        return (
            3 if any(name and name in kind for name in names) else (1 if is_generic else -3 if is_text else 0)
        )
    if isinstance(atom, bool):
        return (
            3
            if "bool" in kind or not {*re.findall(r"\w+", kind)}.isdisjoint(templates)
            else 1
            if is_generic
            else -2
        )
    if isinstance(atom, int):
        return 2 if _NUMBER.search(kind) else 1 if is_generic else -2
    if isinstance(atom, Lambda | Bound):
        return 2 if "function" in kind or "allback" in kind else (1 if is_generic else -2)
    if isinstance(atom, Seq | Map):
        return 2 if re.search(r"vector|array|list|map|set", kind) else (1 if is_generic else -2)
    return 0


_OF_TEXT = re.compile(r"string|char|bool")
_NUMBER = re.compile(r"int|double|float|size_t|long")
