"""Names whose text may depend on parameters: ``create_publisher(T, self.get_parameter('t').value)``."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

Edit = tuple[str, tuple[str, ...]]
"""A condition with its arguments: ``("only if equal", ("auto",))``. Or ``("given", ("True", "False"))``: what a flag
holds where it is there, and where it is not."""

CONDITIONS: dict[str, Callable[..., bool]] = {
    "only if equal": lambda text, other: text == other,
    "only if different": lambda text, other: text != other,
    "only if true": lambda text: text.lower() == "true",
    "only if false": lambda text: text.lower() != "true",
    "only if among": lambda text, *others: text in others,
    "only if not among": lambda text, *others: text not in others,
}
"""Edits that keep a name where they hold and drop it elsewhere."""

PARAMETER_REFERENCE = re.compile(r"\$\(param ([^ ()$]+)(?: ([^ ()$]*))?\)")
"""``$(param NAME)`` or ``$(param NAME DEFAULT)`` in the text of a template."""


class ParameterPart(NamedTuple):
    """The value of the node's parameter ``name``; ``default`` is what the code declares, if known.

    ``item``: the parameter is a list and this is its element at an index, or ``"each"`` of them.
    ``*`` in ``name`` stands for one part between dots: the names are the values of all such parameters.
    ``edits``: a condition on the value; the value is then not part of the name. Names that no ROS parameter can have
    are other inputs of the program: ``--option`` and ``<argument>`` of its command line, ``$VARIABLE`` of
    its environment.
    """

    name: str
    default: str | None = None
    item: int | str | None = None
    edits: tuple[Edit, ...] = ()

    def texts(self, parameters: Mapping[str, object]) -> tuple[str, ...]:
        """Return what this part may stand for: normally one text; none if it has no value."""
        values: Sequence[object] = () if self.default is None else (self.default,)
        given = self._given(parameters)
        if self.edits and self.edits[0][0] == "given":  # of a flag it counts only whether it is there
            values = [self.edits[0][1][0 if given else 1]]
        elif given:
            values = [value for each in given for value in self._items(each)]
        if not values and not given and self.is_condition:
            return ("",)  # what is not known may hold
        if self.is_condition:
            test, arguments = self.edits[-1]
            return ("",) if any(CONDITIONS[test](str(value), *arguments) for value in values) else ()
        return tuple(dict.fromkeys(map(str, values)))

    @property
    def is_condition(self) -> bool:
        """Return True if it adds nothing to the name, which only exists if the parameter has a certain value."""
        return bool(self.edits) and self.edits[-1][0] in CONDITIONS

    def may_be_none(self, parameters: Mapping[str, object]) -> bool:
        """Return whether it certainly stands for no text at all: an empty list, a condition that does not hold."""
        known = self.name in parameters or self.default is not None
        return self.is_condition or (self.item == "each" and known)

    def _given(self, parameters: Mapping[str, object]) -> list[object]:
        if "*" not in self.name:
            return [parameters[self.name]] if self.name in parameters else []
        pattern = re.escape(self.name).replace(r"\*", "[^.]+")
        return [parameters[name] for name in sorted(parameters) if re.fullmatch(pattern, name)]

    def _items(self, value: object) -> Sequence[object]:
        if self.item is None:
            return (value,)
        if not isinstance(value, list | tuple):
            return ()
        if not isinstance(self.item, int):
            return tuple(value)
        return tuple(value[self.item : self.item + 1] if self.item >= 0 else value[self.item :][:1])


class UnknownPart(NamedTuple):
    """Text that could not be determined; ``why`` is for the reader."""

    why: str = ""


Part = str | ParameterPart | UnknownPart


def melted(parts: Iterable[Any]) -> tuple[Any, ...]:
    """Join literal texts that stand side by side to one part of the name."""
    found: list[Any] = []
    for part in parts:
        if isinstance(part, str) and found and isinstance(found[-1], str):
            found[-1] += part
        else:
            found.append(part)
    return tuple(found)


class NameTemplate(NamedTuple):
    """A name as a sequence of parts, normally a single literal."""

    parts: tuple[Part, ...]

    @classmethod
    def literal(cls, name: str) -> NameTemplate:
        return cls((name,))

    @property
    def is_literal(self) -> bool:
        return all(isinstance(part, str) for part in self.parts)

    @property
    def unconditional(self) -> NameTemplate:
        """Return the same name without its conditions."""
        kept = tuple(p for p in self.parts if not (isinstance(p, ParameterPart) and p.is_condition))
        return self if len(kept) == len(self.parts) else NameTemplate(kept)

    def fill(self, parameters: Mapping[str, object]) -> NameTemplate:
        """Replace parameter parts by the given values, else by their defaults; elements of a list: ``fill_each``."""
        filled = self.fill_each(parameters)
        if len(filled) == 1:
            return filled[0]
        return NameTemplate((UnknownPart(f"{self} stands for {len(filled)} names, one per element"),))

    def fill_each(self, parameters: Mapping[str, object]) -> tuple[NameTemplate, ...]:
        """Fill templates over the elements of a list parameter as ``fill``: one template for each."""
        results: list[tuple[Part, ...]] = [()]
        for part in self.parts:
            choices: tuple[Part, ...] = (part,)
            if isinstance(part, ParameterPart):
                choices = part.texts(parameters)
                if not choices and not part.may_be_none(parameters):
                    choices = (UnknownPart(f"parameter {part.name!r} has no value"),)
            results = [(*result, choice) for result in results for choice in choices]
        return tuple(NameTemplate(melted(result)) for result in results)

    @property
    def text(self) -> str:
        """Return the literal text, with ``*`` for every part that is not known."""
        return "".join(part if isinstance(part, str) else "*" for part in self.parts)

    def __str__(self) -> str:
        return "".join(_shown(part) for part in self.parts)


def _shown(part: Part) -> str:
    if isinstance(part, ParameterPart):
        return "" if part.is_condition else f"param:{part.name}"
    return part if isinstance(part, str) else "?"
