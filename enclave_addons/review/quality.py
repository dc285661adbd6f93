"""Quality of service of an endpoint, and whether a writer and a reader can meet. Performs no I/O.

Rules of request and offer: DDS 1.4, 2.2.3, the table of policies with "RxO = yes". Words as NoDL v2 has them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

INFINITE = -1
_RMW_INFINITE = (1 << 63) - 1  # RMW_DURATION_INFINITE
_RELIABILITY = ("BEST_EFFORT", "RELIABLE")
_DURABILITY = ("VOLATILE", "TRANSIENT_LOCAL", "TRANSIENT", "PERSISTENT")
_LIVELINESS = ("AUTOMATIC", "MANUAL_BY_PARTICIPANT", "MANUAL_BY_TOPIC")
_OWNERSHIP = ("SHARED", "EXCLUSIVE")
# As rmw numbers them (rmw/types.h); what it has no number for is its "unknown".
_RMW_HISTORY = {"": 0, "KEEP_LAST": 1, "KEEP_ALL": 2}
_RMW_RELIABILITY = {"RELIABLE": 1, "BEST_EFFORT": 2}
_RMW_DURABILITY = {"TRANSIENT_LOCAL": 1, "VOLATILE": 2}


class Quality(NamedTuple):
    """Times in nanoseconds, ``INFINITE`` for none. ``history`` is empty where it was not announced (Fast DDS)."""

    reliability: str = "RELIABLE"
    durability: str = "VOLATILE"
    history: str = ""
    depth: int = 0
    deadline: int = INFINITE
    liveliness: str = "AUTOMATIC"
    lease: int = INFINITE
    ownership: str = "SHARED"

    @property
    def rmw_numbers(self) -> tuple[int, int, int, int]:
        """Return history, depth, reliability, durability as ``rmw_qos_profile_t`` has them; 0 if not announced."""
        return (
            _RMW_HISTORY.get(self.history, 0),
            self.depth,
            _RMW_RELIABILITY.get(self.reliability, 0),
            _RMW_DURABILITY.get(self.durability, 0),
        )


def unmet(offered: Quality, requested: Quality) -> tuple[str, ...]:
    """Return why a reader with ``requested`` gets nothing from a writer of ``offered``; empty if they meet."""
    return tuple(_unmet(offered, requested))


def _unmet(offered: Quality, requested: Quality) -> Iterator[str]:
    for what, order in (
        ("reliability", _RELIABILITY),
        ("durability", _DURABILITY),
        ("liveliness", _LIVELINESS),
    ):
        has, wants = getattr(offered, what), getattr(requested, what)
        if has in order and wants in order and order.index(has) < order.index(wants):
            yield f"{what}: {has} is offered, {wants} requested"
    for what in ("deadline", "lease"):
        has, wants = getattr(offered, what), getattr(requested, what)
        if wants != INFINITE and (has == INFINITE or has > wants):
            yield f"{_TIMES[what]}: {_seconds(has)} is offered, {_seconds(wants)} requested"
    if {offered.ownership, requested.ownership} == set(_OWNERSHIP):
        yield f"ownership: {offered.ownership} is offered, {requested.ownership} requested"


def differences(planned: Mapping[str, str | int], seen: Quality) -> tuple[str, ...]:
    """Return how ``seen`` is another than ``planned``, by NoDL v2's names; what either does not say does not count."""
    return tuple(
        f"{what} is {has}, planned is {wanted}"
        for what, has, wanted in _compared(planned, seen)
        if has not in ("", wanted)
    )


def _compared(planned: Mapping[str, str | int], seen: Quality) -> Iterator[tuple[str, str | int, str | int]]:
    for name, wanted in sorted(planned.items()):
        if name in _NODL_TIMES:
            field = _NODL_TIMES[name]
            yield _TIMES[field], _seconds(getattr(seen, field)), _seconds(int(wanted) or INFINITE)
        elif name in _WORDS or (name == "depth" and seen.history == "KEEP_LAST"):
            yield name, getattr(seen, name), wanted


_WORDS = ("history", "reliability", "durability", "liveliness")
_NODL_TIMES = {"deadline_ns": "deadline", "liveliness_lease_duration_ns": "lease"}  # 0 is rmw's word for none
_TIMES = {"deadline": "deadline", "lease": "liveliness lease"}


def _seconds(nanoseconds: int) -> str:
    return "none" if nanoseconds in (INFINITE, _RMW_INFINITE) else f"{nanoseconds / 1e9:g} s"
