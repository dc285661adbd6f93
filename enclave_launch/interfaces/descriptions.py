"""Join the descriptions of a program by one rule that says what the plan takes from which.

1. Each description is applied to this start (parameters, arguments, remap rules); one that leaves nothing open there is
   complete.
2. A manifest that a person wrote decides, else what was recorded, else the first complete one of source and library.
3. If the one that decides leaves something open, the next complete one takes its place, and the names that the first
   does know are added.
4. A source that is complete is what runs here: the library, which was written from another copy of it, adds nothing. A
   source that leaves something open but has a name that the library lacks is another program than the library's: it
   decides with what it leaves open.
5. A record proves what is there, never what is not: names that another description has beyond it are reported, and
   granted with ``--also unseen``. Where runs leave open what a recorded name comes from, a complete description
   that has some of its readings decides.

Takes the descriptions of one start, gives ``Found``. Performs no I/O.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence, Set
from typing import NamedTuple

from enclave_launch.plan import Described, Found, InterfaceOrigin, Named
from enclave_launch.policy.node_permissions import PolicyOptions, node_permissions
from enclave_launch.policy.running_node import (
    RunningNode,
    UnknownNodeName,
    node_of_component,
    node_of_process,
)
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from enclave_launch.ros_rules.distro import Version
from nodl.node_interface import Endpoint, NodeInterface

_MANIFESTS = (InterfaceOrigin.NAMED, InterfaceOrigin.PACKAGE)


class ProgramStart(NamedTuple):
    """One process, or one component with its container if that is known, under the rules of ``distro``."""

    started: ResolvedProcess | ResolvedComponent
    container: ResolvedProcess | None
    distro: str

    def node(self, interface: NodeInterface) -> RunningNode:
        """Return the node as it will run; its enclave does not matter here.

        Raises ``LaunchFileError`` for a remap rule at which the process would end, and ``UnknownNodeName``.
        """
        if isinstance(self.started, ResolvedProcess):
            return node_of_process(self.started, interface, "/", "node")
        return node_of_component(self.started, self.container, interface, "/")


def meeting(descriptions: Sequence[Found], start: ProgramStart, *, also_unseen: bool = False) -> Found:
    """Return what the plan takes from ``descriptions``, of which there is one at least, in the order of their origins.

    Raises ``LaunchFileError`` for a remap rule at which the process would end.
    """
    if len(descriptions) == 1:
        return descriptions[0]
    judged = [Described(each, *_names(each, start)) for each in descriptions]
    base, others = _chosen(judged, also_unseen)
    interfaces = tuple(_decided(each, judged, start) for each in base.found.interfaces)
    names = base.names
    for other in others:
        added = tuple(_decided(each, judged, start) for each in other.found.interfaces)
        interfaces = _united(interfaces, added, names.keys(), start)
        names = {**other.names, **names}
    used = (base, *others)
    described = (each._replace(used=any(each is one for one in used)) for each in judged)
    return base.found._replace(interfaces=interfaces, descriptions=tuple(described))


def _chosen(judged: Sequence[Described], also_unseen: bool) -> tuple[Described, tuple[Described, ...]]:
    """Return the description whose nodes the plan has, and those whose names are added to them."""
    first, others = judged[0], tuple(each for each in judged[1:] if not each.found.doubt)
    if first.found.origin is InterfaceOrigin.NAMED:
        return first, ()
    recorded = first.found.origin is InterfaceOrigin.RECORDED
    if recorded or first.found.origin in _MANIFESTS:
        if not first.complete:
            instead = next((each for each in judged[1:] if each.complete), None)
            return (instead, (first,)) if instead else (first, ())
        return first, others if recorded and also_unseen else ()
    library = judged[-1]
    is_other_program = not first.names.keys() <= library.names.keys()
    return (first if first.complete or is_other_program else library), ()


def _names(description: Found, start: ProgramStart) -> tuple[dict[Named, str], tuple[str, ...]]:
    """Return the final names with the places that say them, and what is left open."""
    names: dict[Named, str] = {}
    left: list[str] = []
    for interface in description.interfaces:
        try:
            node = start.node(interface)
        except UnknownNodeName as error:
            left.append(error.message)
            continue
        found, still = names_of(node, start.distro)
        names.update(found)
        left += still
    return names, tuple(left)


def names_of(
    node: RunningNode, distro: str, rcl: Version | None = None
) -> tuple[dict[Named, str], tuple[str, ...]]:
    """Return the names that ``node`` is described to need, and what its description leaves open."""
    found = node_permissions(node, distro=distro, options=PolicyOptions(), rcl=rcl)
    declared = (each for each in found.permissions if each.reason.origin == "declared")
    return {(each.operation, each.name): each.reason.place for each in declared}, tuple(
        f"{each.diagnostic.text} ({each.diagnostic.location})" for each in found.unresolved
    )


def _decided(interface: NodeInterface, judged: Sequence[Described], start: ProgramStart) -> NodeInterface:
    """Return ``interface`` without the readings of recorded names that no complete description has.

    They stay if it has none of them: then it says nothing of this name.
    """
    if not any(endpoint.readings for endpoint in interface.endpoints):
        return interface
    complete = [
        each.names.keys()
        for each in judged
        if each.complete and not each.found.doubt and each.found.origin is not InterfaceOrigin.RECORDED
    ]
    endpoints = tuple(_with_readings_of(each, interface, complete, start) for each in interface.endpoints)
    return interface._replace(endpoints=endpoints)


def _with_readings_of(
    endpoint: Endpoint, interface: NodeInterface, complete: Iterable[Set[Named]], start: ProgramStart
) -> Endpoint:
    held = [
        reading
        for reading in (endpoint.name, *endpoint.readings)
        if any(
            (names := _names_of_endpoint(endpoint._replace(name=reading, readings=()), interface, start))
            and names <= known
            for known in complete
        )
    ]
    return (
        endpoint._replace(name=held[0], readings=tuple(held[1:])) if held and endpoint.readings else endpoint
    )


def _united(
    interfaces: Iterable[NodeInterface],
    others: Iterable[NodeInterface],
    known: Iterable[Named],
    start: ProgramStart,
) -> tuple[NodeInterface, ...]:
    """Return ``interfaces`` with the endpoints of ``others`` that give a name beyond ``known``."""
    known = frozenset(known)
    united = list(interfaces)
    places = {start.node(each).fqn: place for place, each in enumerate(united)}
    for other in others:
        beyond = tuple(_beyond(other, known, start))
        place = places.get(start.node(other).fqn) if beyond else None
        if place is not None:
            united[place] = united[place]._replace(endpoints=united[place].endpoints + beyond)
        elif beyond:
            united.append(other._replace(endpoints=beyond, gaps=()))
    return tuple(united)


def _beyond(interface: NodeInterface, known: frozenset[Named], start: ProgramStart) -> Iterator[Endpoint]:
    for endpoint in interface.endpoints:
        if not _names_of_endpoint(endpoint, interface, start) <= known:
            yield endpoint


def _names_of_endpoint(endpoint: Endpoint, interface: NodeInterface, start: ProgramStart) -> Set[Named]:
    """Return the final names of one endpoint of ``interface``; none if something of it is open."""
    try:
        node = start.node(interface)
    except UnknownNodeName:
        return frozenset()
    alone = node._replace(interface=interface._replace(endpoints=(endpoint,), gaps=()))
    names, still = names_of(alone, start.distro)
    return frozenset() if still else names.keys()
