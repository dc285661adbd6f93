"""Topic expressions with wildcards: what one matches, whether two can meet, whether one covers another.

``*`` (also ``/``), ``?``, ``[abc]``, ``[a-z]``, ``[!abc]``: the subset of fnmatch(3) that both DDS read alike."""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Iterable
from functools import lru_cache
from typing import NamedTuple

from keystore.errors import InvalidInputError

_ALPHABET = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_/")
_WILDCARDS = frozenset("*?[")
_ANY_TEXT = None  # stands for "*" among the elements of a pattern

Element = frozenset[str] | None

_TOPICS = (
    "tf", "chatter", "robot1/cmd_vel", "arm/joint_7/state", "front/camera/image_raw", "parameter_events", "X", "z/9/_a",
)  # fmt: skip
EVERY_KIND = {
    "every topic": tuple(f"rt/{name}" for name in _TOPICS),
    "every request": tuple(f"rq/{name}Request" for name in _TOPICS),
    "every reply": tuple(f"rr/{name}Reply" for name in _TOPICS),
}
"""DDS topics of each kind that have nothing in common, to try out what an enclave may do."""


def any_matches(expressions: Collection[str], topic: str) -> bool:
    """Return whether one of the expressions matches this topic."""
    return topic in expressions or any(has_wildcard(one) and can_meet(one, topic) for one in expressions)


def has_wildcard(name: str) -> bool:
    """Return whether it stands for more than one name."""
    return not _WILDCARDS.isdisjoint(name)


def can_meet(a: str, b: str) -> bool:
    """Return whether some name matches both expressions."""
    return _meet(_elements(a), _positions(b))


def covers(wide: str, narrow: str) -> bool:
    """Return whether every match of ``narrow`` surely matches ``wide``.

    Exact if ``narrow`` is a plain name; else true only for the evident cases (equal, or ``wide`` is a plain prefix
    and ``*``), so that "no" may also mean "not evident".
    """
    if wide == narrow:
        return True
    if not has_wildcard(narrow):
        return can_meet(wide, narrow)
    prefix = wide[:-1]
    return wide.endswith("*") and not has_wildcard(prefix) and narrow.startswith(prefix)


class Expressions:
    """Many expressions, to find those that one more can meet: only such as begin and end alike are compared.

    Comparing is bounded: raises InvalidInputError for expressions that meet in more ways than anybody could review.
    """

    def __init__(self, expressions: Iterable[str]) -> None:
        self._all = frozenset(expressions)
        self._by_head, self._by_tail = _Ends(self._all, _head), _Ends(self._all, _tail)
        self._work = 0

    def meeting(self, expression: str) -> list[str]:
        """Return those that some name matches together with ``expression``, sorted."""
        if expression in self._all and not has_wildcard(expression):
            alike = {expression}
        else:
            alike = set()
        head, tail = _head(expression), _tail(expression)
        sides = ((self._by_head, self._by_head.alike(head)), (self._by_tail, self._by_tail.alike(tail)))
        ends, spans = min(sides, key=lambda side: sum(map(len, side[1])))
        for one in (ends.expressions[at] for span in spans for at in span):
            self._count(1)
            if one in alike or not (has_wildcard(one) or has_wildcard(expression)):
                continue
            if _is_alike(_head(one), head) and _is_alike(_tail(one), tail):
                self._count(len(one) + len(expression))
                if can_meet(one, expression):
                    alike.add(one)
        return sorted(alike)

    def cover(self, expression: str) -> bool:
        """Return whether one of them surely matches all that ``expression`` matches."""
        return expression in self._all or any(covers(one, expression) for one in self.meeting(expression))

    def _count(self, work: int) -> None:
        self._work += work
        if self._work > _MOST_WORK:
            raise InvalidInputError(
                "wildcards and denials meet in too many ways to be compared; name the topics one by one"
            )


_MOST_WORK = 1_500_000
"""Characters that are compared; a second or two."""


class _Ends:
    """Expressions by the plain text at one of their ends."""

    def __init__(self, expressions: Iterable[str], end: Callable[[str], str]) -> None:
        pairs = sorted((end(one), one) for one in expressions)
        self.expressions = [one for _, one in pairs]
        self._texts = [text for text, _ in pairs]

    def alike(self, text: str) -> list[range]:
        """Return where those stand whose end begins with ``text``, or is a beginning of it."""
        found = [self._between(text[:length], text[:length]) for length in range(len(text))]
        return [*filter(len, found), self._between(text, text + _LAST)]

    def _between(self, first: str, last: str) -> range:
        return range(bisect_left(self._texts, first), bisect_right(self._texts, last))


_LAST = chr(0x10FFFF)


def _is_alike(a: str, b: str) -> bool:
    return a.startswith(b) or b.startswith(a)


@lru_cache(maxsize=16384)
def _head(expression: str) -> str:
    return re.split(r"[*?\[]", expression, maxsplit=1)[0]


@lru_cache(maxsize=16384)
def _tail(expression: str) -> str:
    return re.split(r"[*?\]]", expression)[-1][::-1]


def _meet(a: tuple[Element, ...], b: _Positions) -> bool:
    """Walk both at once; ``reachable``: a bit for each position in ``b`` that the part of ``a`` so far pairs with."""
    reachable = 1 | (1 & b.stars) << 1
    for element in a:
        if element is _ANY_TEXT:
            lowest = reachable & -reachable
            reachable = b.end * 2 - lowest
        else:
            fitting = 0
            for character in element:
                fitting |= b.of_character.get(character, 0)
            reachable = (reachable & fitting) << 1 | reachable & b.stars
        reachable |= (reachable & b.stars) << 1
        if not reachable:
            return False
    return bool(reachable & b.end)


class _Positions(NamedTuple):
    """Positions in a pattern by the characters that may stand there, as bits. ``end``: behind its last element."""

    of_character: dict[str, int]
    stars: int
    end: int


@lru_cache(maxsize=16384)
def _positions(pattern: str) -> _Positions:
    of_character: dict[str, int] = {}
    stars = 0
    elements = _elements(pattern)
    for at, element in enumerate(elements):
        if element is _ANY_TEXT:
            stars |= 1 << at
        else:
            for character in element:
                of_character[character] = of_character.get(character, 0) | 1 << at
    return _Positions(of_character, stars, 1 << len(elements))


@lru_cache(maxsize=16384)
def _elements(pattern: str) -> tuple[Element, ...]:
    elements: list[Element] = []
    i = 0
    while i < len(pattern):
        character = pattern[i]
        if character == "*":
            elements += (
                [] if elements[-1:] == [_ANY_TEXT] else [_ANY_TEXT]
            )  # two in a row match the same as one
        elif character == "?":
            elements.append(_ALPHABET)
        elif character == "[" and "]" in pattern[i:]:
            end = pattern.index("]", i)
            elements.append(_character_set(pattern[i + 1 : end]))
            i = end
        else:
            elements.append(frozenset(character))
        i += 1
    return tuple(elements)


def _character_set(body: str) -> frozenset[str]:
    negated = body.startswith("!")
    text = body[1:] if negated else body
    members: set[str] = set()
    i = 0
    while i < len(text):
        if i + 2 < len(text) and text[i + 1] == "-":
            members.update(chr(code) for code in range(ord(text[i]), ord(text[i + 2]) + 1))
            i += 3
        else:
            members.add(text[i])
            i += 1
    return _ALPHABET - members if negated else frozenset(members)
