"""Announcements of DDS discovery (unverified claims) → processes, nodes and their interfaces. Performs no I/O.

Only ``ros_discovery_info`` says which node owns an endpoint. Where its list is missing, a participant with one
node owns its endpoints, and parameter services give the names of nodes (programs that publish no list, or one that this
observer may not read). What no rule gives to a node stays the process's: nothing is guessed.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import Enum
from typing import NamedTuple

from enclave_addons.observation.graph.discovery_info import ParticipantList
from enclave_addons.observation.graph.wire_names import DISCOVERY_TOPIC, PARTS, Part, part_of
from enclave_addons.review.quality import Quality
from nodl.node_interface import EndpointKind
from nodl.remap import ACTION_TOPICS

_AS_TOPICS = {
    EndpointKind.ACTION_SERVER: EndpointKind.PUBLISHER,
    EndpointKind.ACTION_CLIENT: EndpointKind.SUBSCRIPTION,
}
_ENCLAVE = re.compile(r"(?:\A|;)enclave=([^;]*);")
_PREFIX_DIGITS = 24  # 12 bytes of a GUID are the participant's, the last 4 the entity's
_HASH_DIGITS = 12
_NAMED_BY = "/get_parameters"  # every node has it, unless its program switches parameter services off


class SeenParticipant(NamedTuple):
    """A participant that was announced. ``guid``: 32 hexadecimal digits. ``enclave`` is what it says in clear; ``pid``
    is of its own pid namespace, and ``None`` where it does not say; ``own_history``: it announces how much it keeps
    (Cyclone DDS)."""

    guid: str
    enclave: str = ""
    pid: int | None = None
    host: str = ""
    program: str = ""
    own_history: bool = False

    @property
    def prefix(self) -> str:
        return self.guid[:_PREFIX_DIGITS]

    @property
    def claims_security(self) -> bool:
        """Return True if the highest bit of its GUID is set (DDS-Security 9.3.3), unlike a vendor's number."""
        return int(self.guid[:2], 16) & 0x80 != 0

    @property
    def subject_hash(self) -> int:
        """Return the first 48 bits of its GUID: of a secured one a hash of the certificate's subject."""
        return int(self.guid[:_HASH_DIGITS], 16)


class SeenEndpoint(NamedTuple):
    """One writer or reader; ``participant`` is a GUID."""

    guid: str
    participant: str
    writes: bool
    topic: str
    type: str
    quality: Quality = Quality()


def claimed_enclave(user_data: bytes) -> str:
    """Return the enclave that rmw writes into the participant's user data (``enclave=/x;``); empty for none."""
    match = _ENCLAVE.search(user_data.decode("utf-8", "replace"))
    return match[1] if match else ""


class Attribution(str, Enum):
    """The evidence for the owner of an endpoint."""

    LIST = "ros_discovery_info"
    ALONE = "the only node of its participant"
    PARAMETER_SERVICES = "parameter services"

    def __str__(self) -> str:
        return self.value


class Owner(NamedTuple):
    """A node of a participant; ``ordinal`` distinguishes several of one name."""

    fqn: str
    ordinal: int = 0


class SeenInterface(NamedTuple):
    """One ROS endpoint of a node. ``missing``: the DDS endpoints of it that were not seen (yet): it is half open."""

    kind: EndpointKind
    name: str
    type: str
    endpoints: tuple[SeenEndpoint, ...]
    missing: tuple[str, ...] = ()
    by: Attribution = Attribution.LIST

    @property
    def complete(self) -> bool:
        return not self.missing


class GraphNode(NamedTuple):
    """One node under its final name."""

    fqn: str
    interfaces: tuple[SeenInterface, ...]
    ordinal: int = 0


class GraphProcess(NamedTuple):
    """One participant. ``unowned``: ROS endpoints that no node of it is known to have; ``foreign``: what is not ROS;
    ``listed``: it published a list of its nodes, which this observer could read; ``announced``: any endpoint of it is
    known, be it only the middleware's own."""

    participant: SeenParticipant
    nodes: tuple[GraphNode, ...] = ()
    unowned: tuple[SeenInterface, ...] = ()
    foreign: tuple[SeenEndpoint, ...] = ()
    listed: bool = False
    gid_size: int = 0
    announced: bool = False

    @property
    def visible(self) -> bool:
        """Return True if the observer discovered any endpoint of it, or its list of nodes."""
        return self.announced or self.listed or bool(self.nodes)

    @property
    def interfaces(self) -> Iterator[SeenInterface]:
        for node in self.nodes:
            yield from node.interfaces
        yield from self.unowned

    @property
    def endpoints(self) -> Iterator[SeenEndpoint]:
        for interface in self.interfaces:
            yield from interface.endpoints
        yield from self.foreign


class Graph(NamedTuple):
    """All participants but the observer, sorted by their GUIDs."""

    processes: tuple[GraphProcess, ...] = ()

    @property
    def nodes(self) -> Iterator[GraphNode]:
        for process in self.processes:
            yield from process.nodes

    @property
    def half_open(self) -> bool:
        """Return True if discovery is under way: an interface lacks a part, or a participant has nothing at all."""
        return any(not each.complete for process in self.processes for each in process.interfaces) or any(
            not process.participant.claims_security and not process.announced for process in self.processes
        )


Owners = Mapping[str, Owner]
"""GUID of an endpoint → the node that has it, by all lists that were trusted."""


def process_of(
    participant: SeenParticipant,
    endpoints: Iterable[SeenEndpoint],
    listed: ParticipantList | None,
    owners: Owners,
) -> GraphProcess:
    """Return the process; ``endpoints`` are the participant's, ``listed`` the newest list that it published itself."""
    parts: list[tuple[SeenEndpoint, Part]] = []
    foreign = []
    ordered = sorted(endpoints)
    for endpoint in ordered:
        part = part_of(endpoint.topic, endpoint.type, writes=endpoint.writes)
        if part is not None:
            parts.append((endpoint, part))
        elif endpoint.topic != DISCOVERY_TOPIC:
            foreign.append(endpoint)
    attribute = _Attributor(parts, listed, owners)
    groups: dict[Owner | None, list[tuple[SeenEndpoint, Part]]] = {owner: [] for owner in attribute.nodes}
    by: dict[str, Attribution] = {}
    for endpoint, part in parts:
        owner, how = attribute.owner(endpoint, part)
        groups.setdefault(owner, []).append((endpoint, part))
        by[endpoint.guid] = how
    nodes = tuple(
        GraphNode(owner.fqn, _interfaces(group, by), owner.ordinal)
        for owner, group in sorted(groups.items(), key=lambda item: item[0] or Owner(""))
        if owner is not None
    )
    unowned = _interfaces(groups.get(None, ()), by)
    size = listed.gid_size if listed else 0
    return GraphProcess(
        participant, nodes, unowned, tuple(foreign), listed is not None, size, announced=bool(ordered)
    )


def owners_in(listed: ParticipantList) -> dict[str, Owner]:
    """Return the owner of each endpoint by what one list says."""
    return {
        guid: owner
        for owner, node in zip(_owners(listed), listed.nodes, strict=True)
        for guid in (*node.readers, *node.writers)
    }


def _owners(listed: ParticipantList) -> list[Owner]:
    found: list[Owner] = []
    for node in listed.nodes:
        found.append(Owner(node.fqn, sum(each.fqn == node.fqn for each in found)))
    return found


class _Attributor:
    def __init__(
        self, parts: Sequence[tuple[SeenEndpoint, Part]], listed: ParticipantList | None, owners: Owners
    ) -> None:
        self._owners = owners
        past = {owners[endpoint.guid] for endpoint, _ in parts if endpoint.guid in owners}
        self.nodes = sorted({*(_owners(listed) if listed else ()), *past})
        self._how = Attribution.ALONE
        if listed is None and not self.nodes:
            self.nodes = sorted(_named_by_parameter_services(parts))
            self._how = Attribution.PARAMETER_SERVICES

    def owner(self, endpoint: SeenEndpoint, part: Part) -> tuple[Owner | None, Attribution]:
        if endpoint.guid in self._owners:
            return self._owners[endpoint.guid], Attribution.LIST
        if len(self.nodes) == 1:
            return self.nodes[0], self._how
        if self._how is Attribution.PARAMETER_SERVICES and part.kind is EndpointKind.SERVICE_SERVER:
            fqn = part.name.rpartition("/")[0]
            return next((each for each in self.nodes if each.fqn == fqn), None), self._how
        return None, self._how


def _named_by_parameter_services(parts: Iterable[tuple[SeenEndpoint, Part]]) -> set[Owner]:
    return {
        Owner(part.name.removesuffix(_NAMED_BY))
        for _, part in parts
        if part.kind is EndpointKind.SERVICE_SERVER
        and part.name.endswith(_NAMED_BY)
        and part.type == "rcl_interfaces/srv/GetParameters"
    }


def _interfaces(
    group: Iterable[tuple[SeenEndpoint, Part]], by: Mapping[str, Attribution]
) -> tuple[SeenInterface, ...]:
    found: dict[tuple[EndpointKind, str], list[tuple[SeenEndpoint, Part]]] = {}
    for endpoint, part in group:
        found.setdefault((part.kind, part.name), []).append((endpoint, part))
    return tuple(
        sorted(
            (each for key, members in found.items() for each in _joined(*key, members, by)),
            key=lambda each: (each.kind.value, each.name, each.type),
        )
    )


def _joined(
    kind: EndpointKind, name: str, members: Sequence[tuple[SeenEndpoint, Part]], by: Mapping[str, Attribution]
) -> Iterator[SeenInterface]:
    """Yield the interfaces of one name; an action's topics without its services are topics (``ros2 topic echo``)."""
    if kind in _AS_TOPICS and all(part.part in ACTION_TOPICS for _, part in members):
        for endpoint, part in members:
            topic = part_of(
                "rt/_" + endpoint.topic[3:].replace("/_action/", "/_"), endpoint.type, writes=True
            )
            type_name = topic.type if topic else endpoint.type
            full = f"{name}/_action/{part.part}"
            yield SeenInterface(_AS_TOPICS[kind], full, type_name, (endpoint,), (), by[endpoint.guid])
        return
    for type_name, same in _by_type(members).items():
        endpoints = tuple(endpoint for endpoint, _ in same)
        missing = tuple(sorted(PARTS[kind] - {part.part for _, part in same}))
        yield SeenInterface(kind, name, type_name, endpoints, missing, by[endpoints[0].guid])


def _by_type(members: Sequence[tuple[SeenEndpoint, Part]]) -> dict[str, list[tuple[SeenEndpoint, Part]]]:
    types = sorted({part.type for _, part in members if part.type}) or [""]
    return {each: [(e, part) for e, part in members if part.type in ("", each)] for each in types}


class GraphState:
    """Announcements, as they come and go → what is there now, or was since the observer began. ``changes`` counts those
    that said something new.

    Each participant writes its whole list at every change, so the newest one counts; but an endpoint that has ended is
    no longer in it, so whose it was is remembered. A list is believed only of the participant that it is about: in an
    unsecured domain anybody may write lists for others.
    """

    def __init__(self, own_participant: str = "") -> None:
        self._own = own_participant
        self._participants: dict[str, SeenParticipant] = {}
        self._endpoints: dict[str, SeenEndpoint] = {}
        self._gone: set[str] = set()
        self._lists: dict[str, ParticipantList] = {}
        self._owners: dict[str, Owner] = {}
        self.changes = 0
        self.forged: list[str] = []

    def participant(self, seen: SeenParticipant) -> None:
        if seen.guid != self._own and (self._participants.get(seen.guid) != seen or seen.guid in self._gone):
            self._participants[seen.guid] = seen
            self._back(seen.guid)

    def endpoint(self, seen: SeenEndpoint) -> None:
        if seen.participant != self._own and (
            self._endpoints.get(seen.guid) != seen or seen.guid in self._gone
        ):
            self._endpoints[seen.guid] = seen
            self._back(seen.guid)

    def gone(self, guid: str) -> None:
        """Note that a participant or an endpoint has ended. The endpoints of a participant end with it."""
        known = guid in self._participants or guid in self._endpoints
        if known and guid not in self._gone:
            self._gone.add(guid)
            self.changes += 1

    def listed(self, message: ParticipantList, writer: str) -> None:
        """Note a list; ``writer``: GUID of the participant that published it, empty if unknown."""
        if writer and writer != message.participant:
            text = f"participant {writer} publishes a list of the nodes of {message.participant}; it is not believed"
            if text not in self.forged:
                self.forged.append(text)
            return
        if message.participant != self._own and self._lists.get(message.participant) != message:
            self._lists[message.participant] = message
            own = message.participant[:24]
            self._owners.update({g: owner for g, owner in owners_in(message).items() if g[:24] == own})
            self.changes += 1

    def graph(self, *, past: bool = False) -> Graph:
        """Return what is there now; with ``past`` also all that has ended meanwhile."""
        return Graph(
            tuple(self._process(guid, past) for guid in sorted(self._participants) if self._there(guid, past))
        )

    def _process(self, guid: str, past: bool) -> GraphProcess:
        endpoints = [each for each in self._endpoints.values() if each.participant == guid]
        there = [each for each in endpoints if self._there(each.guid, past)]
        return process_of(self._participants[guid], there, self._lists.get(guid), self._owners)

    def _there(self, guid: str, past: bool) -> bool:
        return past or guid not in self._gone

    def _back(self, guid: str) -> None:
        self._gone.discard(guid)
        self.changes += 1
