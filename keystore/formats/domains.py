"""ROS domain ids that governance and permissions apply to: single ids or full ranges within 0..230.

Cyclone DDS 0.10.2 crashes on a range without ``min``, and refuses ids above 230."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple
from xml.etree.ElementTree import Element

from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError

LOWEST_ID = 0
HIGHEST_ID = 230


class _Ranges(NamedTuple):
    ranges: tuple[tuple[int, int], ...]


class Domains(_Ranges):
    """A set of domain ids. ``ranges``: pairs (first, last), both included, sorted, neither touching nor overlapping.

    Raises InvalidInputError for what are not domain ids.
    """

    __slots__ = ()

    def __new__(cls, ranges: Iterable[tuple[int, int]]) -> Domains:
        given = tuple(ranges)
        if not given:
            raise InvalidInputError("at least one ROS domain id is needed")
        for first, last in given:
            if not LOWEST_ID <= first <= last <= HIGHEST_ID:
                raise InvalidInputError(
                    f"domain ids {_text(first, last)} are not a range within {LOWEST_ID}..{HIGHEST_ID}"
                )
        return super().__new__(cls, tuple(_merged(given)))

    @classmethod
    def single(cls, domain_id: int) -> Domains:
        return cls(((domain_id, domain_id),))

    @classmethod
    def every(cls) -> Domains:
        return cls(((LOWEST_ID, HIGHEST_ID),))

    @classmethod
    def parse(cls, text: str) -> Domains:
        """Parse ``0``, ``0-10``, ``0,5,7-9`` or ``all``; raises ``InvalidInputError``."""
        if text.strip() == "all":
            return cls.every()
        ranges = []
        for part in text.split(","):
            match = re.fullmatch(r"([0-9]{1,3})(?:-([0-9]{1,3}))?", part.strip())
            if match is None:
                raise InvalidInputError(f"{quoted(text)} are not domain ids; write 0, 0-10 or 0,5,7-9")
            ranges.append((int(match[1]), int(match[2] or match[1])))
        return cls(tuple(ranges))

    def covers(self, other: Domains) -> bool:
        """Return whether every domain of ``other`` is among these."""
        return all(
            any(low <= first and last <= high for low, high in self.ranges) for first, last in other.ranges
        )

    def __str__(self) -> str:
        return ",".join(_text(first, last) for first, last in self.ranges)

    def xml(self) -> str:
        """Render the ``domains`` element of governance and permissions: one line, no blanks in leaves."""
        return f"<domains>{''.join(_element(first, last) for first, last in self.ranges)}</domains>"


def read_domains(element: Element, lost: list[str]) -> Domains:
    """Read a ``domains`` element, adding to ``lost`` what cannot be written again: ids that no ROS domain has.

    Raises InvalidInputError for a number that DDS implementations read in different ways, and where nothing is left.
    """
    found = []
    for part in element:
        texts = [(number.text or "").strip() for number in ([part] if part.tag == "id" else part)]
        # To Cyclone DDS a leading zero means octal. A range with ``min`` alone is that id to both.
        if not all(re.fullmatch(r"0|[1-9][0-9]*", text) for text in texts) or (
            len(part) and part[0].tag == "max"
        ):
            raise InvalidInputError(
                f"domain id {quoted(' '.join(texts))}: DDS implementations read it in different ways"
            )
        first, last = int(texts[0]), int(texts[-1])
        if first > HIGHEST_ID:
            lost.append(f"domain ids from {first}")
            continue
        if last > HIGHEST_ID:
            lost.append(f"domain ids from {HIGHEST_ID + 1} to {last}")
        found.append((first, min(last, HIGHEST_ID)))
    return Domains(found)


def _element(first: int, last: int) -> str:
    if first == last:
        return f"<id>{first}</id>"
    return f"<id_range><min>{first}</min><max>{last}</max></id_range>"


def _text(first: int, last: int) -> str:
    return str(first) if first == last else f"{first}-{last}"


def _merged(ranges: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    merged: list[tuple[int, int]] = []
    for first, last in sorted(ranges):
        if merged and first <= merged[-1][1] + 1:
            merged[-1] = (merged[-1][0], max(last, merged[-1][1]))
        else:
            merged.append((first, last))
    return merged
