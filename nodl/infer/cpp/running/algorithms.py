"""Algorithms of the standard library that get closures: what these write to the elements, and to what they captured."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial

from nodl.infer.cpp.reading.declarations import parameters_of
from nodl.infer.cpp.reading.writes import writes_of
from nodl.infer.cpp.running.constructors import is_written_back
from nodl.infer.cpp.running.machine import NEXT, Frame, Machine
from nodl.infer.cpp.running.values import Bound, Lambda, Obj, Value, unknown
from nodl.infer.cpp.syntax import Node, field_of

_BY_ARGUMENT = re.compile(
    r"for_each(?:_n)?|transform|(?:stable_|partial_)?sort|reverse|rotate|shuffle|fill(?:_n)?|generate(?:_n)?|copy(?:_if|_n)?|"
    r"replace(?:_if)?|remove_if|unique|iota|(?:stable_)?partition|swap(?:_ranges)?|iter_swap|accumulate|getline|"
    r"(?:all|any|none)_of|(?:count|find)(?:_if)?"
)
_KEEPS = re.compile(
    r"std::(?:thread|jthread|async|bind\w*|function|make_\w+|pair|tuple|optional|any|\w+_ptr|forward_as_tuple|tie)"
)
"""Takes copies of its arguments, or only keeps them."""
_CALLS = frozenset({"std::for_each", "std::invoke", "std::apply", "std::visit"})


def as_algorithm(name: str, given: Sequence[Node]) -> str:
    """``for_each(v.begin(), ...)`` is found in ``std`` by its arguments ([basic.lookup.argdep])."""
    return f"std::{name}" if len(given) > 1 and _BY_ARGUMENT.fullmatch(name) else name


def writes_elements(run: Machine, name: str, values: Sequence[Value]) -> bool:
    """Whether a function of the standard library calls something that writes to what it gets by reference."""
    if not name.startswith("std::") or _KEEPS.fullmatch(name):
        return False
    atoms = [atom for value in values for atom in value]
    called = [a for a in atoms if isinstance(a, Lambda | Bound) or (isinstance(a, Obj) and _callable(run, a))]
    return any(_writes(run, atom) for atom in called) or (name in _CALLS and not called)


def _callable(run: Machine, atom: Obj) -> bool:
    return bool(run.methods_of(atom, "operator()") or atom.data.get("partial"))


def _writes(run: Machine, atom: object) -> bool:
    if isinstance(atom, Lambda):
        declarator = field_of(atom.node, "declarator")
        given = [p.name for p in parameters_of(declarator) if is_written_back(p)] if declarator else []
        return bool(given) and not writes_of(atom.node).changed.isdisjoint(given)
    if isinstance(atom, Bound):
        given = [p.name for p in atom.function.parameters if is_written_back(p)]
        return bool(given) and not writes_of(atom.function.node).changed.isdisjoint(given)
    if isinstance(atom, Obj) and atom.data.get("partial"):
        return any(_writes(run, each) for each in atom.data["partial"][0])
    return any(_writes(run, Bound(each, None)) for each in run.methods_of(atom, "operator()"))


def called_now(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> None:
    """Closures that write to what they captured may be called before what follows, or not."""
    from nodl.infer.cpp.running.invocation import call_lambda

    def once(atom: Lambda) -> int:
        call_lambda(run, atom, [unknown("an argument")] * 8, node, frame)
        return NEXT

    for atom in (atom for value in values for atom in value if isinstance(atom, Lambda)):
        if writes_of(atom.node).changed:
            run.branches([partial(once, atom), lambda: NEXT])
