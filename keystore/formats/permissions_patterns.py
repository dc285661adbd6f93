"""Topic expressions with wildcards: what one matches, whether two can meet, whether one covers another.

``*`` (also ``/``), ``?``, ``[abc]``, ``[a-z]``, ``[!abc]``: the subset of fnmatch(3) that both DDS read alike."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache

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
    return _meet(_elements(a), _elements(b))


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


def _meet(a: tuple[Element, ...], b: tuple[Element, ...]) -> bool:
    """Walk both at once; ``reachable``: the positions in ``b`` that the part of ``a`` so far pairs with."""
    reachable = _past_stars({0}, b)
    for element in a:
        step: set[int] = set()
        for j in reachable:
            if element is _ANY_TEXT:
                step.update(range(j, len(b) + 1))
            elif j < len(b):
                other = b[j]
                if other is _ANY_TEXT:
                    step.add(j)
                elif element & other:
                    step.add(j + 1)
        reachable = _past_stars(step, b)
        if not reachable:
            return False
    return len(b) in reachable


def _past_stars(positions: set[int], pattern: tuple[Element, ...]) -> set[int]:
    """Return ``positions`` and those behind any ``*`` that follows them, for a ``*`` may match nothing."""
    result = set(positions)
    for j in positions:
        while j < len(pattern) and pattern[j] is _ANY_TEXT:
            j += 1
            result.add(j)
    return result


@lru_cache(maxsize=4096)
def _elements(pattern: str) -> tuple[Element, ...]:
    elements: list[Element] = []
    i = 0
    while i < len(pattern):
        character = pattern[i]
        if character == "*":
            elements.append(_ANY_TEXT)
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
