"""Names whose text may depend on parameters: literal text mixed with what only launch can tell.

A manifest gives literal names. Inference also finds ``create_publisher(T, self.get_parameter('t').value)``:
the name is then the parameter ``t``, to be filled in with what the launch file sets.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ParameterPart:
    """The value of the node's parameter ``name``; ``default`` is what the code declares, if known."""

    name: str
    default: str | None = None


@dataclass(frozen=True, slots=True)
class UnknownPart:
    """Text that could not be determined; ``why`` is for the reader."""

    why: str = ""


Part = str | ParameterPart | UnknownPart


@dataclass(frozen=True, slots=True)
class NameTemplate:
    """A name as a sequence of parts, normally a single literal."""

    parts: tuple[Part, ...]

    @classmethod
    def literal(cls, name: str) -> NameTemplate:
        return cls((name,))

    @property
    def is_literal(self) -> bool:
        return all(isinstance(part, str) for part in self.parts)

    def fill(self, parameters: Mapping[str, object]) -> NameTemplate:
        """Replace parameter parts by the given values (else by their defaults, else unknown)."""
        filled: list[Part] = []
        for part in self.parts:
            piece: Part = part
            if isinstance(part, ParameterPart):
                if part.name in parameters:
                    piece = str(parameters[part.name])
                elif part.default is not None:
                    piece = part.default
                else:
                    piece = UnknownPart(f"parameter {part.name!r} has no value")
            if isinstance(piece, str) and filled and isinstance(filled[-1], str):
                filled[-1] += piece
            else:
                filled.append(piece)
        return NameTemplate(tuple(filled))

    @property
    def text(self) -> str:
        """The literal text, with ``*`` for every part that is not known."""
        return "".join(part if isinstance(part, str) else "*" for part in self.parts)

    def __str__(self) -> str:
        return "".join(_shown(part) for part in self.parts)


def _shown(part: Part) -> str:
    if isinstance(part, ParameterPart):
        return f"param:{part.name}"
    return part if isinstance(part, str) else "?"
