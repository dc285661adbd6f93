"""The string domain: text known in part.

A ``Text`` is a sequence of literal pieces, inputs (a ROS parameter, a command line option, an environment
variable), the node's own name, and holes. Fully known text is a plain ``str``; many texts widen to their
common prefix and suffix around a hole; a text that is only a hole says no more than unknown.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from nodl.name_template import Edit

MAX_PARTS = 24
MAX_PRODUCT = 64
MAX_LENGTH = 4096  # characters of a known text; no name is longer


class Input(NamedTuple):
    """The value of a named input of the program; ``edits``: conditions on it, or whether a flag is there."""

    name: str
    owner: object
    edits: tuple[Edit, ...] = ()


class Guard(NamedTuple):
    """What is asked of an input: the edit that keeps a name where it holds, with its arguments."""

    asked: Input
    edit: str
    given: tuple[str, ...]

    @property
    def piece(self) -> Input:
        """Return the piece of a text that is empty where the condition holds; elsewhere there is no such text."""
        return self.asked._replace(edits=(*self.asked.edits, (self.edit, self.given)))


class NodePart(NamedTuple):
    """The node's ``name``, ``namespace`` or ``fqn`` (fully qualified name), whatever launch makes of it."""

    what: str


class Hole:
    """A part of a text that is not known, and why; holes are equal whatever their reason."""

    __slots__ = ("why",)

    def __init__(self, why: str) -> None:
        self.why = why

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Hole)

    def __hash__(self) -> int:
        return 7

    def __repr__(self) -> str:
        return f"Hole({self.why!r})"


Piece = str | Input | NodePart | Hole


class Text:
    """A text with something else in it than one literal; equal whatever the reasons of its holes."""

    __slots__ = ("_hash", "pieces")

    def __init__(self, pieces: tuple[Piece, ...]) -> None:
        self.pieces = pieces
        self._hash = hash(pieces)

    def __eq__(self, other: object) -> bool:
        return self is other or (
            type(other) is Text and self._hash == other._hash and self.pieces == other.pieces
        )

    def __hash__(self) -> int:
        return self._hash

    def __repr__(self) -> str:
        return f"Text({self.pieces!r})"

    @property
    def is_hole(self) -> bool:
        return len(self.pieces) == 1 and isinstance(self.pieces[0], Hole)


TextAtom = str | Text


def text_of(pieces: Iterable[Piece]) -> TextAtom:
    """Return the text made of ``pieces``; neighbouring literals and holes melt together."""
    merged: list[Piece] = []
    last: Piece | None = None
    for piece in pieces:
        if type(piece) is str:
            if not piece:
                continue
            if len(piece) > MAX_LENGTH:
                piece = Hole("a very long text")
            elif type(last) is str:
                last = merged[-1] = last + piece
                continue
        if not (type(piece) is Hole and type(last) is Hole):
            merged.append(piece)
            last = piece
    if not merged:
        return ""
    if len(merged) == 1 and isinstance(merged[0], str):
        return merged[0]
    if len(merged) > MAX_PARTS:
        merged = [merged[0], Hole("a very long text"), merged[-1]]
    return Text(tuple(merged))


def pieces_of(text: TextAtom) -> tuple[Piece, ...]:
    """Return the pieces of a text; a ``str`` is a single one."""
    return text.pieces if isinstance(text, Text) else (text,)


def concatenate(left: TextAtom, right: TextAtom) -> TextAtom:
    """Compute ``left + right``; only where they meet can pieces melt together."""
    if type(left) is str and type(right) is str and len(left) + len(right) <= MAX_LENGTH:
        return left + right
    if not left or not right:
        return left or right
    head, tail = pieces_of(left), pieces_of(right)
    melts = len(head) + len(tail) > MAX_PARTS or type(head[-1]) is type(tail[0])
    if melts or _is_long(left) or _is_long(right):
        return text_of((*head, *tail))
    return Text((*head, *tail))


def _is_long(text: TextAtom) -> bool:
    return type(text) is str and len(text) > MAX_LENGTH


def concatenations(operands: Sequence[Sequence[TextAtom]]) -> list[TextAtom]:
    """Return all texts made of one alternative of each operand.

    Where two have alternatives, nobody knows which of them go together: but for the first these become a pattern.
    """
    several = [index for index, alternatives in enumerate(operands) if len(alternatives) > 1]
    if len(several) > 1:
        operands = [
            [common_text(each, "which texts go together")] if index in several[1:] else each
            for index, each in enumerate(operands)
        ]
    if all(len(alternatives) == 1 for alternatives in operands):
        return [text_of(piece for texts in operands for piece in pieces_of(texts[0]))]
    results: list[TextAtom] = [""]
    for alternatives in operands:
        if len(results) * len(alternatives) > MAX_PRODUCT:
            alternatives = [common_text(alternatives, "too many possible texts")]
        if len(results) * len(alternatives) > MAX_PRODUCT:
            results = [common_text(results, "too many possible texts")]
        results = list(dict.fromkeys(concatenate(head, tail) for head in results for tail in alternatives))
    return results


def common_text(texts: Sequence[TextAtom], why: str) -> Text:
    """Return the common literal prefix and suffix of ``texts`` around a hole."""
    heads = [_literal_end(text, 0) for text in texts]
    tails = [_literal_end(text, -1)[::-1] for text in texts]
    prefix = _common_prefix(heads)
    shortest = min((len(text) for text in texts if isinstance(text, str)), default=len(prefix) + 1_000)
    suffix = _common_prefix(tails)[: max(0, shortest - len(prefix))][::-1]
    text = text_of((prefix, Hole(why), suffix))
    assert isinstance(text, Text)
    return text


def _common_prefix(texts: Sequence[str]) -> str:
    """Compare character by character; the least and the greatest text differ first."""
    low, high = min(texts), max(texts)
    length = next((i for i, (a, b) in enumerate(zip(low, high, strict=False)) if a != b), len(low))
    return low[:length]


def _literal_end(text: TextAtom, index: int) -> str:
    piece = pieces_of(text)[index] if text else ""
    return piece if isinstance(piece, str) else ""


def constant_text(atom: object) -> object:
    """Return the ``str`` of a text that is known but for the conditions under which it is meant; else ``atom``."""
    if not isinstance(atom, Text):
        return atom
    last = atom.pieces[-1]
    before = atom.pieces[:-1] if isinstance(last, str) else atom.pieces
    known = all(isinstance(each, Input) and is_condition(each) for each in before)
    return (last if isinstance(last, str) else "") if known else atom


def is_of_inputs(text: Text) -> bool:
    """Return True if inputs alone decide the text: neither unknown parts nor the node's name."""
    return not any(isinstance(piece, (Hole, NodePart)) for piece in text.pieces)


def is_condition(piece: Input) -> bool:
    """Return True if the input is not part of the text, but decides whether it is meant."""
    return bool(piece.edits) and piece.edits[-1][0] != "given"


def input_of(text: object) -> Input | None:
    """Return the input whose value ``text`` is as a whole."""
    if not isinstance(text, Text) or len(text.pieces) != 1:
        return None
    piece = text.pieces[0]
    return piece if isinstance(piece, Input) and not is_condition(piece) else None
