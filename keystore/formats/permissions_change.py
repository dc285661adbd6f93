"""What one permissions document grants and another does not. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from keystore.formats.permissions_patterns import can_meet, covers
from keystore.formats.permissions_read import DdsRule, Grant, parse_permissions
from keystore.formats.policy import Qualifier

Domains = tuple[tuple[int, int | None], ...]
_HIGHEST = 1 << 16


class Permitted(NamedTuple):
    """One topic expression of a rule, with its direction (``publish``, ``subscribe``) and domains."""

    direction: str
    topic: str
    domains: Domains

    def __str__(self) -> str:
        return f"{self.direction} {self.topic}"


def grant_for(document: bytes, subject: str, place: str) -> Grant | None:
    """The grant that DDS uses for ``subject``: the first. Raises InvalidInputError for another kind of document."""
    grants = parse_permissions(document, place)
    return next((grant for grant in grants if grant.subject_name.strip() == subject), None)


def rules_text(grant: Grant) -> str:
    """What the grant allows, apart from its subject and dates; equal for equal rules however they are laid out."""
    return f"{grant.default.value} {[_plain(rule) for rule in grant.rules]}"


def _plain(rule: DdsRule) -> tuple[str, Domains, tuple[str, ...], tuple[str, ...]]:
    return rule.qualifier.value, rule.domains, rule.publish, rule.subscribe


def taken_away(old: Grant, new: Grant) -> tuple[str, ...]:
    """What ``old`` permits and ``new`` surely or possibly does not, in words (``publish rt/chatter``); sorted."""
    lost = {str(one) for one in _lost(old, new)}
    if old.default is Qualifier.ALLOW and new.default is not Qualifier.ALLOW:
        lost.add("everything that no rule names")
    return tuple(sorted(lost))


def _lost(old: Grant, new: Grant) -> Iterator[Permitted]:
    allowed, present = _permitted(old, Qualifier.ALLOW), _permitted(new, Qualifier.ALLOW)
    exact = set(present)
    for one in allowed:
        if one not in exact and not any(_includes(other, one) for other in present):
            yield one
    denied = _permitted(old, Qualifier.DENY)
    for denial in _permitted(new, Qualifier.DENY):
        if not any(_includes(before, denial) for before in denied):
            yield from (one for one in allowed if _concerns(denial, one))


def _permitted(grant: Grant, qualifier: Qualifier) -> list[Permitted]:
    return [
        Permitted(direction, topic, rule.domains)
        for rule in grant.rules
        if rule.qualifier is qualifier
        for direction, topics in (("publish", rule.publish), ("subscribe", rule.subscribe))
        for topic in topics
    ]


def _includes(wide: Permitted, narrow: Permitted) -> bool:
    return (
        wide.direction == narrow.direction
        and covers(wide.topic, narrow.topic)
        and all(any(_within(inner, outer) for outer in wide.domains) for inner in narrow.domains)
    )


def _within(inner: tuple[int, int | None], outer: tuple[int, int | None]) -> bool:
    last, end = (_HIGHEST if high is None else high for high in (inner[1], outer[1]))
    return outer[0] <= inner[0] and last <= end


def _concerns(denial: Permitted, one: Permitted) -> bool:
    return denial.direction == one.direction and can_meet(denial.topic, one.topic)
