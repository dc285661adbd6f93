"""Texts that are known in part.

A ``Text`` is a sequence of literal pieces, inputs of the program (a ROS parameter, a command line option, an
environment variable), the node's own name, and holes. A text that is known in full is a plain ``str``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from nodl.name_template import CONDITIONS, Edit

MAX_PIECES = 24
MAX_PRODUCT = 64
MAX_LENGTH = 4096


class Input(NamedTuple):
    """The value of a named input of the program.

    Attributes:
        owner: Who knows the default: a node for its parameters, ``Options`` for the rest.
        item: The index of an element of a list, or ``"each"`` of them.
        edits: A condition on the input, or what a flag stands for.
    """

    name: str
    owner: object
    item: int | str | None = None
    edits: tuple[Edit, ...] = ()

    @property
    def is_condition(self) -> bool:
        """Return True if the input adds nothing to the text, but decides whether there is one."""
        return bool(self.edits) and self.edits[-1][0] in CONDITIONS


class OwnName(NamedTuple):
    """The node's own ``name``, ``ns`` or ``fqn`` (fully qualified name), whatever launch makes of it."""

    what: str


class Hole:
    """A part that is not known. All holes are equal, whatever their reason."""

    __slots__ = ("why",)

    def __init__(self, why: str) -> None:
        self.why = why

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Hole)

    def __hash__(self) -> int:
        return 7


Piece = str | Input | OwnName | Hole


class Text(NamedTuple):
    """A text that is more than one literal."""

    pieces: tuple[Piece, ...]

    @property
    def hole(self) -> Hole | None:
        """Return the hole if the text is nothing else."""
        only = self.pieces[0]
        return only if len(self.pieces) == 1 and isinstance(only, Hole) else None


AnyText = str | Text


def text_of(pieces: Iterable[Piece]) -> AnyText:
    """Return the text made of ``pieces``. Neighbouring literals melt together, and so do neighbouring holes."""
    merged: list[Piece] = []
    for piece in pieces:
        if piece == "":
            continue
        last = merged[-1] if merged else None
        if isinstance(piece, str) and isinstance(last, str):
            merged[-1] = last + piece
        elif not (isinstance(piece, Hole) and isinstance(last, Hole)):
            merged.append(piece)
    if not merged:
        return ""
    if len(merged) > MAX_PIECES or any(isinstance(each, str) and len(each) > MAX_LENGTH for each in merged):
        return Text((Hole("a very long text"),))
    if len(merged) == 1 and isinstance(merged[0], str):
        return merged[0]
    return Text(tuple(merged))


def pieces_of(text: AnyText) -> tuple[Piece, ...]:
    """Return the pieces of a text. A ``str`` is a single piece."""
    return (text,) if isinstance(text, str) else text.pieces


def concatenations(operands: Sequence[Sequence[AnyText]]) -> list[AnyText]:
    """Return all texts made of one alternative of each operand, as one pattern where there are too many."""
    results: list[AnyText] = [""]
    for alternatives in operands:
        if len(results) * len(alternatives) > MAX_PRODUCT:
            alternatives = [common_text(alternatives, "too many possible texts")]
        if len(results) * len(alternatives) > MAX_PRODUCT:
            results = [common_text(results, "too many possible texts")]
        joined = (text_of((*pieces_of(head), *pieces_of(tail))) for head in results for tail in alternatives)
        results = list(dict.fromkeys(joined))
    return results


def common_text(texts: Sequence[AnyText], why: str) -> Text:
    """Return the common literal beginning and end of ``texts`` around a hole."""
    heads = [_literal(text, 0) for text in texts]
    tails = [_literal(text, -1)[::-1] for text in texts]
    prefix = _common_prefix(heads)
    shortest = min((len(text) for text in texts if isinstance(text, str)), default=len(prefix) + MAX_LENGTH)
    suffix = _common_prefix(tails)[: max(0, shortest - len(prefix))][::-1]
    text = text_of((prefix, Hole(why), suffix))
    return text if isinstance(text, Text) else Text((Hole(why),))


def _common_prefix(texts: Sequence[str]) -> str:
    low, high = min(texts), max(texts)
    length = next((i for i, (a, b) in enumerate(zip(low, high, strict=False)) if a != b), len(low))
    return low[:length]


def _literal(text: AnyText, index: int) -> str:
    piece = pieces_of(text)[index] if text else ""
    return piece if isinstance(piece, str) else ""


def input_of(text: object) -> Input | None:
    """Return the input whose value ``text`` is as a whole."""
    if isinstance(text, Text) and len(text.pieces) == 1 and isinstance(text.pieces[0], Input):
        return text.pieces[0]
    return None
