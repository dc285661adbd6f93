"""Find which enclaves can influence which, directly and over others. Performs no I/O.

The question of the design article "ROS 2 Security Enclaves" and of the paper's future work: a permission says what one
participant may do, but a message that it reads can change what it writes. So influence is transitive: whoever publishes
what another subscribes, calls what it serves, or serves what it calls (the answer flows back), reaches it and all that
it reaches. Every enclave is taken to let everything through; that errs on the side of flows that do not happen.

What every node has (parameter services, /rosout, /clock ...) counts only on request: almost everybody may publish
/parameter_events, which would connect all with all.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from typing import NamedTuple

from enclave_addons.review.document import GrantedName, PlanDocument
from enclave_launch.dry_run import Operation
from keystore.formats.permissions_patterns import can_meet, has_wildcard
from nodl.remap import ACTION_SERVICES, ACTION_TOPICS

# Of two enclaves, the first does this and the second that: what flows from the first to the second. The answers of a
# server flow back.
_MEETS: Mapping[Operation, Operation] = {
    "publish": "subscribe",
    "call_services": "serve_services",
    "serve_services": "call_services",
}
# What an action consists of (design article "Actions"), by what its client and its server do with it.
_PARTS_OF_ACTIONS: Mapping[Operation, tuple[Operation, Operation]] = {
    "call_actions": ("call_services", "subscribe"),
    "serve_actions": ("serve_services", "publish"),
}


class Hop(NamedTuple):
    """One way from an enclave to another: what the first does, on which name of its own permissions."""

    operation: Operation
    name: str

    def __str__(self) -> str:
        verb, _, kind = self.operation.partition("_")
        what = f"{kind.removesuffix('s') or 'topic'} {self.name}"
        return f"answers of {what}" if verb == "serve" else what


class FlowStep(NamedTuple):
    """From one enclave to the next, by any of ``hops``."""

    source: str
    target: str
    hops: tuple[Hop, ...]


FlowGraph = Mapping[str, Mapping[str, tuple[Hop, ...]]]
"""Source enclave -> target enclave -> the ways from one to the other, sorted; no enclave flows to itself."""


def flow_graph(plan: PlanDocument, *, built_in: bool = False) -> FlowGraph:
    """Return the flow between the enclaves of ``plan``; every enclave is a key.

    ``built_in``: count what every node has, too.
    """
    left_out = {path: frozenset() if built_in else plan.built_in(path) for path in plan.enclaves}
    return _graph({path: plan.enclaves[path] - left_out[path] for path in sorted(plan.enclaves)})


def shortest_paths(graph: FlowGraph, source: str, target: str) -> list[tuple[FlowStep, ...]]:
    """Return all shortest paths from ``source`` to ``target``, sorted; empty if there is none."""
    distances = _distances(graph, source)
    if target not in distances or source == target:
        return []
    return [
        tuple(FlowStep(one, two, graph[one][two]) for one, two in pairwise(path))
        for path in _paths_back(graph, distances, target)
    ]


def reached_from(graph: FlowGraph, source: str) -> frozenset[str]:
    """Return everything that ``source`` can influence, except itself."""
    return frozenset(_distances(graph, source)) - {source}


def opened_by_sharing(plan: PlanDocument) -> list[tuple[str, str, str]]:
    """Return flows that exist only because nodes share an enclave.

    Each is (enclave, node that is influenced, node that then is): in an enclave of its own the first node could not
    pass anything on to the second. Nodes of one process count as one: no enclave separates them.
    """
    units: dict[str, frozenset[GrantedName]] = {}
    for enclave in plan.enclaves:
        for unit, own in plan.units_of(enclave).items():
            units[unit] = units.get(unit, frozenset()) | own
    graph = _graph(units)
    opened = []
    for enclave in sorted(plan.enclaves):
        together = sorted(plan.units_of(enclave))
        reach = {unit: reached_from(graph, unit) for unit in together}
        opened += [
            (enclave, one, two)
            for one in together
            for two in together
            if one != two and two not in reach[one]
        ]
    return opened


def _graph(grants: Mapping[str, Iterable[GrantedName]]) -> FlowGraph:
    parts = {holder: [part for grant in own for part in _parts(grant)] for holder, own in grants.items()}
    takers = _Takers({holder: [part for part, _ in own] for holder, own in parts.items()})
    graph: dict[str, dict[str, tuple[Hop, ...]]] = {}
    for source, own in parts.items():
        hops: dict[str, set[Hop]] = {}
        for part, grant in own:
            if part.operation in _MEETS:
                for target in takers.of(GrantedName(_MEETS[part.operation], part.name)):
                    hops.setdefault(target, set()).add(Hop(*grant))
        graph[source] = {
            target: tuple(sorted(ways)) for target, ways in sorted(hops.items()) if target != source
        }
    return graph


def _parts(grant: GrantedName) -> list[tuple[GrantedName, GrantedName]]:
    """Split a grant of an action into its services and topics, each with the grant itself; others are their own
    part."""
    if grant.operation not in _PARTS_OF_ACTIONS:
        return [(grant, grant)]
    service, topic = _PARTS_OF_ACTIONS[grant.operation]
    return [
        *((GrantedName(service, f"{grant.name}/_action/{part}"), grant) for part in ACTION_SERVICES),
        *((GrantedName(topic, f"{grant.name}/_action/{part}"), grant) for part in ACTION_TOPICS),
    ]


class _Takers:
    """Finds the holders of grants that meet another: a look-up, and a comparison only where wildcards are."""

    def __init__(self, grants: Mapping[str, Iterable[GrantedName]]) -> None:
        self._holders: dict[GrantedName, set[str]] = {}
        for holder, own in grants.items():
            for grant in own:
                self._holders.setdefault(grant, set()).add(holder)
        self._patterns = [grant for grant in self._holders if has_wildcard(grant.name)]

    def of(self, wanted: GrantedName) -> set[str]:
        candidates = self._holders if has_wildcard(wanted.name) else self._patterns
        met = [
            grant
            for grant in candidates
            if grant.operation == wanted.operation and can_meet(grant.name, wanted.name)
        ]
        return self._holders.get(wanted, set()).union(*(self._holders[grant] for grant in met))


def _distances(graph: FlowGraph, source: str) -> dict[str, int]:
    distances = {source: 0}
    waiting = deque([source])
    while waiting:
        here = waiting.popleft()
        for there in graph.get(here, {}):
            if there not in distances:
                distances[there] = distances[here] + 1
                waiting.append(there)
    return distances


def _paths_back(graph: FlowGraph, distances: Mapping[str, int], target: str) -> Iterator[list[str]]:
    if distances[target] == 0:
        yield [target]
        return
    for before in sorted(graph):
        if target in graph[before] and distances.get(before) == distances[target] - 1:
            for path in _paths_back(graph, distances, before):
                yield [*path, target]
