"""Plan and graph → findings.

A node is known by its final name, its process by what DDS-Security proves: the GUID of a secured participant begins
with a hash of its certificate's subject, so a table of the keystore's certificates says which enclave it is in.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import product
from types import MappingProxyType
from typing import Any, NamedTuple

from enclave_addons.observation.drift.expected import Expected, ExpectedNode
from enclave_addons.observation.drift.finding import DriftFinding, FindingCertainty, Kind, Level, finding
from enclave_addons.observation.graph.model import (
    Attribution,
    Graph,
    GraphNode,
    GraphProcess,
    SeenEndpoint,
    SeenInterface,
)
from enclave_addons.observation.graph.text import participant_text
from enclave_addons.observation.graph.wire_names import ros_type
from enclave_addons.review.document import GrantedName
from enclave_addons.review.quality import differences, unmet
from enclave_common.words import counted
from enclave_launch.policy.derivation import LIST_NAMES
from enclave_launch.policy.node_permissions import OPERATIONS
from keystore.formats.permissions_patterns import covers
from nodl.node_interface import EndpointKind

_TOPICS = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION)
_REACH_IT = (
    "observe it with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST if its nodes use the loopback interface only, "
    "else with its ROS_DOMAIN_ID, ROS_STATIC_PEERS and CYCLONEDDS_URI"
)
_OR_PLAN_IT = "or plan it: in the launch file or its manifests; or accept it"


class Security(NamedTuple):
    """Facts about a secured system.

    Attributes:
        enclaves: First bytes of GUIDs → enclave of this keystore.
        authenticated: The observer is in an enclave, so that what it cannot see is not what it should be.
    """

    enclaves: Mapping[int, str] = MappingProxyType({})
    authenticated: bool = True


class Circumstances(NamedTuple):
    """Inputs of a comparison beside plan and graph.

    Attributes:
        security: ``None`` if the system runs unsecured.
        accepted: Names of nodes, with wildcards, that may run beside the plan.
        strangers: Process ids on this machine that the launch did not start; empty if that is not known.
        forged: Lists of nodes that one participant published for another.
    """

    security: Security | None = None
    accepted: tuple[str, ...] = ()
    strangers: frozenset[int] = frozenset()
    forged: tuple[str, ...] = ()


def compare(
    expected: Expected,
    graph: Graph,
    circumstances: Circumstances | None = None,
    enclaves_now: Callable[[], Mapping[int, str]] | None = None,
) -> list[DriftFinding]:
    """List every difference, in the order of processes and names.

    ``enclaves_now`` reads the table of enclaves again: an enclave that is made during the watch is not of another CA.
    """
    given = circumstances or Circumstances()
    found = list(_Comparison(expected, graph, given).findings())
    if (
        given.security is None
        or enclaves_now is None
        or all(each.kind is not Kind.OTHER_CA for each in found)
    ):
        return found
    now = given.security._replace(enclaves=enclaves_now())
    return list(_Comparison(expected, graph, given._replace(security=now)).findings())


class _Comparison:
    def __init__(self, expected: Expected, graph: Graph, circumstances: Circumstances) -> None:
        self._expected = expected
        self._security = circumstances.security
        self._accepted = circumstances.accepted
        self._strangers = circumstances.strangers
        self._forged = circumstances.forged
        self._processes = [
            each for each in graph.processes if not each.nodes or not all(map(self._is_accepted, each.nodes))
        ]

    def findings(self) -> Iterator[DriftFinding]:
        for text in self._forged:
            yield finding(Kind.FORGED_LIST, text.split()[1], text)
        hidden = self._out_of_sight()
        if hidden is not None:
            yield hidden
            for process in self._processes:
                facts = self._unproved(process) if self._security else ()
                yield from (each for each in facts if each.kind is not Kind.NOT_AUTHENTICATED)
            return
        for process in self._processes:
            yield from self._of_process(process)
        yield from self._counts()
        yield from self._meeting()

    def _out_of_sight(self) -> DriftFinding | None:
        """Return why the observer cannot compare: no node and no endpoint of a program is visible to it."""
        if not any(node.always for node in self._expected.nodes.values()):
            return None
        if any(process.nodes or any(process.endpoints) for process in self._processes):
            return None
        participants = counted(len(self._processes), "participant")
        if self._security is not None and not self._security.authenticated:
            text = "the observer is in no enclave, so no secured participant shows it what it has"
            remedy = "give --enclave, of a tool enclave made with secure-keystore tool-enclave KEYSTORE --for observe"
        elif not self._processes:
            text = "no participant was discovered in this domain"
            remedy = f"if the launch runs, {_REACH_IT}"
        else:
            text = f"{participants} discovered, and nothing of what they have"
            remedy = _REACH_IT
            if self._security is None:
                remedy += "; if the system is secured, give --keystore and --enclave"
            else:
                remedy += (
                    "; or the observer's enclave is not trusted there: another CA, revoked, other governance"
                    "; or its DDS and theirs do not authenticate each other: use --with rclpy, with the "
                    "RMW_IMPLEMENTATION of the launch"
                )
        found = finding(Kind.OUT_OF_SIGHT, "", text, remedy=remedy)
        return found._replace(level=Level.CANNOT_TELL)

    def _is_accepted(self, node: GraphNode) -> bool:
        return any(covers(pattern, node.fqn) for pattern in self._accepted)

    # one participant

    def _of_process(self, process: GraphProcess) -> Iterator[DriftFinding]:
        unproved = list(self._unproved(process)) if self._security else []
        yield from unproved
        if unproved:
            return  # what it says of itself is worth nothing
        enclave = self._enclave(process)
        known = [node for node in process.nodes if self._planned(node) is not None]
        if not known and not self._is_opaque(process, enclave):
            yield self._unplanned(process, enclave)
            return
        if known and process.participant.pid in self._strangers:
            names = ", ".join(node.fqn for node in known)
            text = f"{names} runs in a process that this launch did not start"
            yield self._about(Kind.STRANGER, process, text)
        for node in process.nodes:
            yield from self._of_node(node, process, enclave)

    def _unproved(self, process: GraphProcess) -> Iterator[DriftFinding]:
        assert self._security is not None
        seen = process.participant
        if not seen.claims_security:
            text = "a participant without security is in this domain"
            yield self._about(Kind.NOT_SECURED, process, text)
        elif seen.subject_hash not in self._security.enclaves:
            text = f"its certificate is of no enclave of this keystore; it calls itself {seen.enclave or 'nothing'}"
            yield self._about(Kind.OTHER_CA, process, text)
        elif self._security.authenticated and not process.announced and not process.listed:
            enclave = self._security.enclaves[seen.subject_hash]
            text = (
                f"it claims the subject of enclave {enclave}, and shows nothing to this observer: its certificate is "
                "of another CA or revoked, its governance differs, or two DDS implementations fail to shake hands"
            )
            remedy = "check again with secure-plan drift, which repeats the handshake; otherwise stop it"
            yield self._about(Kind.NOT_AUTHENTICATED, process, text, enclave=enclave, remedy=remedy)

    def _enclave(self, process: GraphProcess) -> str:
        if self._security is None or not process.participant.claims_security:
            return ""
        return self._security.enclaves.get(process.participant.subject_hash, "")

    def _is_opaque(self, process: GraphProcess, enclave: str) -> bool:
        """Return True for a program whose nodes the plan does not know, or a node whose name it does not know."""
        unnamed = bool(process.nodes) and all(map(self._is_unnamed, process.nodes))
        return unnamed or enclave in self._expected.opaque

    def _unplanned(self, process: GraphProcess, enclave: str) -> DriftFinding:
        names = ", ".join(sorted(node.fqn for node in process.nodes))
        if not names:
            return self._nameless(process, enclave)
        kind, text = Kind.UNPLANNED_NODE, f"{names} is not planned"
        if enclave in self._expected.enclaves:
            kind = Kind.ENCLAVE_OF_ANOTHER
            text = f"{names} uses enclave {enclave}, which the plan gives to others"
        return self._about(kind, process, text, names, enclave=enclave, remedy=f"stop it, {_OR_PLAN_IT}")

    def _nameless(self, process: GraphProcess, enclave: str) -> DriftFinding:
        # One that shows only the middleware's own endpoints is an observer, or starting; one without any may have any.
        topics = sorted({endpoint.topic for endpoint in process.endpoints})
        if topics:
            text = f"a participant with {', '.join(topics[:5])} is not planned"
        elif process.visible:
            text = "a participant without endpoints is not planned"
        else:
            text = "a participant is not planned, and this observer sees none of its endpoints"
        found = self._about(Kind.UNPLANNED_PROCESS, process, text, enclave=enclave)
        if topics and process.participant.pid in self._strangers:
            # Whatever name it will have, it is not ours.
            return found._replace(certainty=FindingCertainty.FACT)
        harmless = process.visible and not topics and enclave not in self._expected.enclaves
        return found._replace(level=Level.NOTE) if harmless else found

    # one node

    def _planned(self, node: GraphNode) -> ExpectedNode | None:
        found = self._expected.nodes.get(node.fqn)
        if found is None:
            patterns = (each for fqn, each in self._expected.nodes.items() if "*" in fqn)
            found = next((each for each in patterns if covers(each.fqn, node.fqn)), None)
        return found

    def _of_node(self, node: GraphNode, process: GraphProcess, enclave: str) -> Iterator[DriftFinding]:
        planned = self._planned(node)
        if planned is None:
            if not (self._is_accepted(node) or self._is_helper(node, process) or self._is_unnamed(node)):
                text = f"{node.fqn} is not planned, in a process that is"
                yield self._about(Kind.UNPLANNED_NODE, process, text, node.fqn, enclave=enclave)
            return
        if self._security is not None and enclave != planned.enclave:
            text = f"{node.fqn} runs in enclave {enclave}, the plan has it in {planned.enclave or 'none'}"
            yield self._about(Kind.ENCLAVE_OF_ANOTHER, process, text, node.fqn, enclave=enclave)
        if planned.described:
            yield from self._beyond(node, planned, process)
            yield from self._absent(node, planned, process)

    def _is_unnamed(self, node: GraphNode) -> bool:
        return (node.fqn.rpartition("/")[0] or "/") in self._expected.unnamed

    def _is_helper(self, node: GraphNode, process: GraphProcess) -> bool:
        # All that it has is granted to a planned node of its process; the plan grants its name by pattern.
        granted = [
            each.grant
            for other in process.nodes
            if (planned := self._planned(other)) is not None
            for each in planned.interfaces
        ]
        return bool(node.interfaces) and all(_granted(_grant(each), granted) for each in node.interfaces)

    def _beyond(
        self, node: GraphNode, planned: ExpectedNode, process: GraphProcess
    ) -> Iterator[DriftFinding]:
        grants = [each.grant for each in planned.interfaces]
        types = {each.grant: each.type for each in planned.interfaces if each.type}
        for interface in node.interfaces:
            if not interface.complete:
                continue
            grant = _grant(interface)
            if not _granted(grant, grants):
                text = f"{node.fqn}: {grant} is not planned"
                found = self._about(Kind.UNPLANNED_ENDPOINT, process, text, node.fqn, name=interface.name)
                remedy = f"add it to the description of {planned.program}"
                if planned.open:
                    found = found._replace(
                        level=Level.NOTE, text=f"{text}, and the plan does not know all of it"
                    )
                yield found._replace(enclave=planned.enclave, remedy=remedy)
            elif grant in types and interface.type and types[grant] != interface.type:
                text = f"{node.fqn}: {grant} has the type {interface.type}, planned is {types[grant]}"
                yield self._about(Kind.TYPE_DIFFERS, process, text, node.fqn, name=interface.name)
            for why in _other_quality(interface, [e.qos for e in planned.interfaces if e.grant == grant]):
                text = f"{node.fqn}: {grant}: {why}"
                yield self._about(Kind.QOS_DIFFERS, process, text, node.fqn, name=interface.name)

    def _absent(
        self, node: GraphNode, planned: ExpectedNode, process: GraphProcess
    ) -> Iterator[DriftFinding]:
        if any(each.by is not Attribution.LIST for each in node.interfaces) and len(process.nodes) > 1:
            return  # what is whose is not known
        there = {_grant(each) for each in node.interfaces if each.complete}
        for each in planned.interfaces:
            if each.certain and each.grant not in there:
                text = f"{node.fqn}: {each.grant} is planned but absent"
                yield self._about(Kind.MISSING_ENDPOINT, process, text, node.fqn, name=each.grant.name)

    # all together

    def _counts(self) -> Iterator[DriftFinding]:
        running = Counter(node.fqn for process in self._processes for node in process.nodes)
        for fqn, planned in sorted(self._expected.nodes.items()):
            count = sum(times for name, times in running.items() if covers(fqn, name))
            if count == 0 and planned.always:
                text = f"{fqn} ({planned.program}) is planned but does not run"
                yield finding(Kind.MISSING_NODE, fqn, text, enclave=planned.enclave)
            elif count > planned.times and "*" not in fqn:
                text = f"{fqn} runs {count} times, planned is {planned.times}"
                where = "; ".join(
                    participant_text(process)
                    for process in self._processes
                    if any(node.fqn == fqn for node in process.nodes)
                )
                yield finding(Kind.REPEATED_NODE, fqn, text, enclave=planned.enclave, who=where)

    def _meeting(self) -> Iterator[DriftFinding]:
        by_topic: dict[str, tuple[list[_End], list[_End]]] = {}
        for end in self._ends():
            by_topic.setdefault(end.endpoint.topic, ([], []))[end.endpoint.writes].append(end)
        for topic, (readers, writers) in sorted(by_topic.items()):
            reported: set[tuple[str, str, str]] = set()
            for writer, reader in product(writers, readers):
                for found in _between(topic, writer, reader):
                    if found.key[1:] not in reported:
                        reported.add(found.key[1:])
                        yield found

    def _ends(self) -> Iterator[_End]:
        for process in self._processes:
            who = participant_text(process)
            for node in process.nodes:
                for interface in node.interfaces:
                    yield from (_End(node.fqn, who, endpoint) for endpoint in interface.endpoints)
            for endpoint in (*(e for each in process.unowned for e in each.endpoints), *process.foreign):
                yield _End(who, who, endpoint)

    def _about(
        self,
        kind: Kind,
        process: GraphProcess,
        text: str,
        subject: str = "",
        *,
        name: str = "",
        enclave: str = "",
        remedy: str = "",
    ) -> DriftFinding:
        who = participant_text(process)
        return finding(kind, subject or who, text, name=name, enclave=enclave, who=who, remedy=remedy)


class _End(NamedTuple):
    owner: str
    who: str
    endpoint: SeenEndpoint


def _between(topic: str, writer: _End, reader: _End) -> Iterator[DriftFinding]:
    types = ros_type(writer.endpoint.type), ros_type(reader.endpoint.type)
    subject = f"{writer.owner} -> {reader.owner}"
    who = f"{writer.who}; {reader.who}"
    if writer.endpoint.type != reader.endpoint.type:
        text = f"{topic}: {writer.owner} writes {types[0]}, {reader.owner} reads {types[1]}: they do not meet"
        yield finding(Kind.TYPES_DO_NOT_MEET, subject, text, name=topic, who=who)
        return
    for why in unmet(writer.endpoint.quality, reader.endpoint.quality):
        text = f"{topic}: {writer.owner} and {reader.owner} do not meet: {why}"
        yield finding(Kind.QOS_DOES_NOT_MEET, subject, text, name=topic, who=who)


def _other_quality(interface: SeenInterface, planned: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Return why the endpoint is like none of that topic in the plan, which may have several."""
    if interface.kind not in _TOPICS or not planned:
        return ()
    found = [[differences(qos, each.quality) for qos in planned] for each in interface.endpoints]
    return next((min(each, key=len) for each in found if all(each)), ())


def _grant(interface: SeenInterface) -> GrantedName:
    return GrantedName(LIST_NAMES[OPERATIONS[interface.kind]], interface.name)


def _granted(grant: GrantedName, grants: Iterable[GrantedName]) -> bool:
    return any(
        each.operation == grant.operation and (each.name == grant.name or covers(each.name, grant.name))
        for each in grants
    )
