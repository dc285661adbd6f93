"""What a class hides of its bases, and what an object has of one of them twice. Pure."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from nodl.infer.cpp.reading.declarations import Class

if TYPE_CHECKING:
    from nodl.infer.cpp.reading.names import Names


def hidden(names: Names, cls: Class) -> frozenset[str]:
    """Names of members, and of methods that are not virtual, which the class or a base of it hides from another."""
    if cls not in names.hidden:
        listed = [name for each in names.ancestry(cls) for name in {*each.fields, *_fixed(names, each)}]
        names.hidden[cls] = frozenset(name for name, times in Counter(listed).items() if times > 1)
    return names.hidden[cls]


def _fixed(names: Names, cls: Class) -> set[str]:
    """Methods that the class seen at compile time decides, without constructors and destructors."""
    found = [*names.methods.get(cls, {}).items(), *cls.declared.items()]
    virtual = {name for name, listed in found if any(each.virtual for each in listed)}
    return {name for name, _ in found if name != cls.name and not name.startswith("~")} - virtual


def repeated_base(names: Names, cls: Class) -> Class | None:
    """A base with members of its own that an object of the class has twice."""
    if len(cls.bases) < 2:
        return None
    listed = Counter(each for _, base in names.bases(cls) if base is not None for each in _parts(names, base))
    return next((each for each, times in listed.items() if times > 1 and each.fields), None)


def _parts(names: Names, cls: Class) -> list[Class]:
    own = [base for written, base in names.bases(cls) if written not in cls.virtual_bases and base is not cls]
    return [cls, *(part for base in own if base is not None for part in _parts(names, base))]
