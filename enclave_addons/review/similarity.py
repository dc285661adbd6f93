"""Enclaves that could be one, and enclaves that should be several: the paper's question of similar policies.

One enclave less is one key, one certificate and one signed document less to renew; the price is that each process in it
may then do what the others may (the excess). The same number, the other way round, is what a split saves.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

from enclave_addons.review.document import GrantedName, PlanDocument

_ALIKE = 0.5  # least similarity of two enclaves that could be one


class Merge(NamedTuple):
    """Two enclaves that could be one. ``similarity``: permissions that both have over those that either has, 0 to 1.
    ``excess``: what each gains."""

    one: str
    two: str
    similarity: float
    excess: tuple[tuple[str, tuple[GrantedName, ...]], ...]

    @property
    def cost(self) -> int:
        return sum(len(gained) for _, gained in self.excess)


class Split(NamedTuple):
    """An enclave that could be several. ``saved``: for each node of the enclave what it may do today and neither it
    nor its process requests."""

    enclave: str
    saved: tuple[tuple[str, tuple[GrantedName, ...]], ...]

    @property
    def gain(self) -> int:
        return sum(len(grants) for _, grants in self.saved)


def merges(plan: PlanDocument) -> list[Merge]:
    """Return pairs of enclaves that are alike, cheapest first; what every node has is left out of the comparison."""
    own = {path: plan.own(path) for path in plan.enclaves}
    found = [
        Merge(one, two, len(own[one] & own[two]) / len(own[one] | own[two]), _excess(own, one, two))
        for one, two in combinations(sorted(own), 2)
        if own[one] and own[two]
    ]
    alike = [merge for merge in found if merge.similarity >= _ALIKE]
    return sorted(alike, key=lambda merge: (merge.cost, -merge.similarity, merge.one, merge.two))


def splits(plan: PlanDocument) -> list[Split]:
    """Return enclaves in which nodes may do what only others request, those that save most first."""
    found = []
    for path in plan.enclaves:
        requested = plan.own(path)
        units = plan.units_of(path)
        saved = tuple(
            (unit, tuple(sorted(requested - own))) for unit, own in units.items() if requested - own
        )
        if len(units) > 1 and saved:
            found.append(Split(path, saved))
    return sorted(found, key=lambda split: (-split.gain, split.enclave))


def _excess(
    own: dict[str, frozenset[GrantedName]], one: str, two: str
) -> tuple[tuple[str, tuple[GrantedName, ...]], ...]:
    gains = ((one, tuple(sorted(own[two] - own[one]))), (two, tuple(sorted(own[one] - own[two]))))
    return tuple(gain for gain in gains if gain[1])
