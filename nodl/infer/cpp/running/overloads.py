"""Which of several functions of one name a call means, by the number and the looks of its arguments."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import repeat

from nodl.infer.cpp.reading.declarations import Function, FunctionParameter
from nodl.infer.cpp.running.values import Bound, Lambda, Map, Obj, Seq, Text, Value


def chosen(functions: Sequence[Function], arguments: Sequence[Value]) -> Function | None:
    """Choose the overload that takes so many arguments; of several, the one whose parameters look like them."""
    found = candidates(functions, arguments)
    return found[0] if found else None


def candidates(functions: Sequence[Function], arguments: Sequence[Value]) -> Sequence[Function]:
    """Find the overloads that fit best: all of them where their looks do not tell them apart, as ``f() const`` and
    ``f()``."""
    fitting = [each for each in functions if _takes(each, len(arguments))]
    if len(fitting) <= 1:
        return fitting or (functions if len(functions) == 1 else ())
    scores = [sum(map(_likeness, each.parameters, arguments, repeat(each.templates))) for each in fitting]
    best = max(scores)
    unsure = best < _EXACT * len(arguments)  # by a conversion that there may not be: then f(...) is meant
    rated = zip(fitting, scores, strict=True)
    return [each for each, score in rated if score == best or (unsure and each.variadic)]


def fits(function: Function, arguments: Sequence[Value]) -> bool:
    """Return whether a function takes so many arguments, none of which looks as if it were of another type."""
    if not _takes(function, len(arguments)):
        return False
    return all(
        _likeness(*each, function.templates) >= 0
        for each in zip(function.parameters, arguments, strict=False)
    )


_EXACT = 3
"""What ``_likeness`` gives an argument that needs no conversion."""


_GENERIC = re.compile(r"(?:const )?[A-Z]\w*(?: ?[&*]+)?")


def _takes(function: Function, count: int) -> bool:
    required = sum(1 for p in function.parameters if p.default is None and "..." not in p.type)
    return function.variadic or required <= count <= len(function.parameters)


def _likeness(parameter: FunctionParameter, value: Value, templates: Sequence[str]) -> int:
    """Rate how well an argument fits a parameter, by their looks.

    A text may be a literal, which is rather a template's ``T`` or ``true`` than a ``std::string`` ([over.ics.rank]).
    """
    atom = value[0] if value else None
    kind = parameter.type
    is_text = "string" in kind or "char" in kind
    is_generic = _GENERIC.fullmatch(kind) is not None and "Descriptor" not in kind
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
        return 3 if "bool" in kind else (1 if is_generic else -2)
    if isinstance(atom, int):
        return (
            3
            if re.search(r"int|size_t|long", kind)
            else 2
            if _NUMBER.search(kind)
            else (1 if is_generic else -2)
        )
    if isinstance(atom, Lambda | Bound):
        return 2 if "function" in kind or "allback" in kind else (1 if is_generic else -2)
    if isinstance(atom, Seq | Map):
        return 2 if re.search(r"vector|array|list|map|set", kind) else (1 if is_generic else -2)
    return 0


_OF_TEXT = re.compile(r"string|char|bool")
_NUMBER = re.compile(r"int|double|float|size_t|long")
