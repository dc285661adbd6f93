"""Which of several functions of one name a call means, by the number and the looks of its arguments."""

from __future__ import annotations

import re
from collections.abc import Sequence

from enclave_addons.inference.cpp.engine.values import (
    Bound,
    Group,
    Lambda,
    Map,
    Obj,
    Param,
    Pointer,
    Seq,
    Text,
    Value,
)
from enclave_addons.inference.cpp.reading.declarations import Function, FunctionParameter

_GENERIC = re.compile(r"(?:const )?[A-Z]\w*(?: ?[&*]+)?|.*\bauto\b.*")
_OF_TEXT = re.compile(r"string|char")
_OF_NUMBER = re.compile(r"int|double|float|size_t|long|short|unsigned")
_OF_MANY = re.compile(r"vector|array|list|map|set|deque|Options")


def chosen(functions: Sequence[Function], arguments: Sequence[Value]) -> Function | None:
    """Choose the overload that takes so many arguments; of several, the one whose parameters look like them."""
    found = candidates(functions, arguments)
    return found[0] if found else None


def candidates(functions: Sequence[Function], arguments: Sequence[Value]) -> Sequence[Function]:
    """Return the overloads that fit best: several where their looks do not tell them apart."""
    fitting = [each for each in functions if takes(each, len(arguments))]
    if len(fitting) <= 1:
        return fitting or (functions if len(functions) == 1 else ())
    scores = [sum(map(_likeness, each.parameters, arguments, [each] * len(arguments))) for each in fitting]
    best = max(scores)
    return [each for each, score in zip(fitting, scores, strict=True) if score == best]


def takes(function: Function, count: int) -> bool:
    """Return whether a function can be called with so many arguments."""
    required = sum(1 for p in function.parameters if p.default is None and "..." not in p.type)
    return function.variadic or required <= count <= len(function.parameters)


def _likeness(parameter: FunctionParameter, value: Value, function: Function) -> int:
    """Rate how well an argument fits a parameter, by their looks."""
    atom = value[0] if value else None
    kind = parameter.type
    generic = not {*re.findall(r"\w+", kind)}.isdisjoint(function.templates) or bool(_GENERIC.fullmatch(kind))
    if isinstance(atom, Text | Param):
        fits = bool(_OF_TEXT.search(kind.partition("<")[0]))
        return 3 if fits else 1 if generic or isinstance(atom, Param) else -3
    if isinstance(atom, Obj):
        names = {atom.type.last, *(c.name for c in atom.bindings)}
        if atom.node is not None and "node" in kind.lower():
            return 3
        if any(name and re.search(rf"\b{re.escape(name)}\b", kind) for name in names):
            return 3
        return 1 if generic else -3 if _OF_TEXT.search(kind) or _OF_NUMBER.search(kind) else 0
    if isinstance(atom, bool):
        return 3 if "bool" in kind else 1 if generic else -2
    if isinstance(atom, int | float):
        is_whole = isinstance(atom, int)
        fits = bool(_OF_NUMBER.search(kind)) and not _OF_MANY.search(kind)
        exact = ("double" in kind or "float" in kind) is not is_whole
        return (3 if exact else 2) if fits else 1 if generic else -2
    if isinstance(atom, Lambda | Bound):
        return 2 if "function" in kind or "allback" in kind else 1 if generic else -2
    if isinstance(atom, Seq | Map | Group):
        return 2 if _OF_MANY.search(kind) else 1 if generic else -2 if _OF_TEXT.search(kind) else 0
    if isinstance(atom, Pointer):
        return 2 if "*" in kind else 0
    return 0
