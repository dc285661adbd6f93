"""Which specialisation of a template is meant: explicit and partial ones, for given arguments ([temp.spec]). Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from nodl.infer.cpp.reading.declarations import Class, Function
from nodl.infer.cpp.reading.type_names import Type, split_type

if TYPE_CHECKING:
    from nodl.infer.cpp.reading.names import Names

Resolve = Callable[[str], Type]
_CHANGED = re.compile(r"[&*]|\b(?:const|volatile)\b|\(|\.\.\.")
_VALUE = re.compile(r"-?\d\w*|true|false|'.'")
_OPEN = re.compile(r"[A-Z][a-z\d]?|[A-Z]\w*T|.*[-+*/%()!?.].*|(?:auto|decltype|typename)\b.*")
"""A parameter of a template around it, or what the compiler computes."""


class Chosen(NamedTuple):
    """``certain``: whether no other specialisation may be meant; ``bindings``: of the parameters of a partial one."""

    cls: Class
    bindings: Mapping[str, Type]
    certain: bool = True


class Specialisations:
    """Those of a program's class templates. ``doubts``: types of which several may be meant, with one of them."""

    def __init__(self, names: Names):
        self._names = names
        self.doubts: dict[Type, Class] = {}
        self._of: dict[str, list[Class]] = {}
        for each in (c for listed in names.classes.values() for c in listed if c.specialises is not None):
            self._of.setdefault(each.qualified, []).append(each)

    def of_method(self, cls: Class, function: Function) -> Class:
        """The specialisation of ``cls`` whose method this is; else the class itself."""
        listed = self._of.get(cls.qualified, ())
        found = next((c for c in listed if c.specialises == function.specialises), None)
        if found is not None:
            function.specialises = None
        return found or cls

    def meant(self, cls: Class, kind: Type) -> Class:
        """Of the template ``cls`` the class for the arguments of ``kind``; a doubt is noted."""
        return self._chosen(cls, kind).cls if cls.qualified in self._of else cls

    def bindings(self, cls: Class, kind: Type) -> dict[str, Type]:
        """What the parameters of the template ``cls`` stand for; those of a partial specialisation by its pattern."""
        if cls.specialises is not None:
            return dict(self._chosen(cls, kind).bindings)
        return self._with_defaults(cls, kind)

    def _with_defaults(self, cls: Class, kind: Type) -> dict[str, Type]:
        bound = dict(zip(cls.templates, kind.arguments, strict=False))
        for name, default in cls.template_defaults.items():
            bound.setdefault(name, self._names.resolve(default, cls.scope, cls.file, bound))
        return bound

    def _chosen(self, cls: Class, kind: Type) -> Chosen:
        listed, names = self._of[cls.qualified], self._names
        same = [c for c in names.classes[cls.name] if c.qualified == cls.qualified and not c.specialises]
        primary = same[0] if same else cls
        bound = self._with_defaults(primary, kind)
        given = [bound[name] for name in primary.templates if name in bound] or kind.arguments
        found = specialised(primary, listed, given, lambda t: names.resolve(t, cls.scope, cls.file))
        has_parts = any(c.fields or c.declared or names.methods.get(c) for c in (primary, *listed))
        if not found.certain and has_parts:
            self.doubts.setdefault(kind, found.cls)
        return found


def specialised(
    primary: Class, others: Iterable[Class], arguments: Sequence[Type], resolve: Resolve
) -> Chosen:
    """The class that ``arguments`` select: an explicit specialisation, the partial one that fits, else the primary."""
    fitting: list[tuple[Class, dict[str, Type]]] = []
    certain = True
    for each in others:
        bindings: dict[str, Type] = {}
        fits = _fit(each.specialises or (), arguments, each.templates, bindings, resolve)
        if fits:
            fitting.append((each, bindings))
        certain = certain and fits is not None
    full = [one for one in fitting if not one[0].templates]
    if full or len(fitting) == 1:
        cls, found = (full or fitting)[0]
        return Chosen(cls, found, bool(full) or certain)
    return Chosen(primary, dict(zip(primary.templates, arguments, strict=False)), certain and not fitting)


def _fit(
    patterns: Sequence[str],
    given: Sequence[Type],
    variables: Sequence[str],
    bindings: dict[str, Type],
    resolve: Resolve,
) -> bool | None:
    """Whether the arguments are those of a specialisation; ``None`` where that is not known."""
    if len(patterns) != len(given):
        return None
    found = [
        _fits(pattern, each, variables, bindings, resolve)
        for pattern, each in zip(patterns, given, strict=True)
    ]
    return False if False in found else None if None in found else True


def _fits(
    pattern: str, given: Type, variables: Sequence[str], bindings: dict[str, Type], resolve: Resolve
) -> bool | None:
    if pattern in variables:
        return bindings.setdefault(pattern, given) == given
    if _VALUE.fullmatch(pattern) or _VALUE.fullmatch(given.name):
        both = _VALUE.fullmatch(pattern) and _VALUE.fullmatch(given.name)
        return pattern == given.name if both else None
    if _OPEN.fullmatch(given.name):
        return None
    if _CHANGED.search(pattern):
        return None if given.pointer or not pattern.rstrip().endswith("*") else False
    name, inner, rest, _ = split_type(pattern)
    kind = resolve(name if inner else pattern)
    if given.pointer != kind.pointer or rest:
        return None
    if kind.name != given.name:
        return False
    return _fit(inner, given.arguments, variables, bindings, resolve) if inner else kind == given
