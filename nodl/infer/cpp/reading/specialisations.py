"""Which explicit specialisation of a template is meant; where a partial one may be, that is a doubt ([temp.spec])."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from nodl.infer.cpp.reading.declarations import Class, Function
from nodl.infer.cpp.reading.type_names import Type

if TYPE_CHECKING:
    from nodl.infer.cpp.reading.names import Names

_OPEN = re.compile(r"[A-Z][a-z\d]?|[A-Z]\w*T|.*[-+*/%()!?.].*|(?:auto|decltype|typename)\b.*")
"""A parameter of a template around it, or what the compiler computes."""


class Specialisations:
    """Those of a program's class templates. ``doubts``: types of which several may be meant, with one of them."""

    def __init__(self, names: Names):
        self._names = names
        self.doubts: dict[Type, Class] = {}
        self._of: dict[str, list[Class]] = {}
        for each in (c for listed in names.classes.values() for c in listed if c.specialises is not None):
            self._of.setdefault(each.qualified, []).append(each)

    def of_method(self, cls: Class, function: Function) -> Class:
        """Return the specialisation of ``cls`` whose method this is; else the class itself."""
        listed = self._of.get(cls.qualified, ())
        found = next((c for c in listed if c.specialises == function.specialises), None)
        if found is not None:
            function.specialises = None
        return found or cls

    def meant(self, cls: Class, kind: Type) -> Class:
        """Return, of the template ``cls``, the class for the arguments of ``kind``; a doubt is noted."""
        return self._chosen(cls, kind) if cls.qualified in self._of else cls

    def bindings(self, cls: Class, kind: Type) -> dict[str, Type]:
        """Return what the parameters of the template ``cls`` stand for."""
        return self._with_defaults(cls, kind) if cls.specialises is None else {}

    def _with_defaults(self, cls: Class, kind: Type) -> dict[str, Type]:
        bound = dict(zip(cls.templates, kind.arguments, strict=False))
        for name, default in cls.template_defaults.items():
            bound.setdefault(name, self._names.resolve(default, cls.scope, cls.file, bound))
        return bound

    def _chosen(self, cls: Class, kind: Type) -> Class:
        """Return the explicit specialisation for these very arguments, else the template; any other is a doubt."""
        listed, names = self._of[cls.qualified], self._names
        same = [c for c in names.classes[cls.name] if c.qualified == cls.qualified and not c.specialises]
        primary = same[0] if same else cls
        bound = self._with_defaults(primary, kind)
        given = [bound[name] for name in primary.templates if name in bound] or [*kind.arguments]
        for each in (one for one in listed if not one.templates):
            if [names.resolve(written, cls.scope, cls.file) for written in each.specialises or ()] == given:
                return each
        is_open = any(each.templates for each in listed) or any(_OPEN.fullmatch(one.name) for one in given)
        if is_open and any(c.fields or c.declared or names.methods.get(c) for c in (primary, *listed)):
            self.doubts.setdefault(kind, primary)
        return primary
