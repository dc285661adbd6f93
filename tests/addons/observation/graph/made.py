"""Graphs as values, for tests that need no DDS."""

from __future__ import annotations

from enclave_addons.observation.graph.discovery_info import ListedNode, ParticipantList
from enclave_addons.observation.graph.model import Graph, GraphState, SeenEndpoint, SeenParticipant
from enclave_addons.review.quality import Quality

RELIABLE = Quality()


class Made:
    """Announcements of participants, one after another."""

    def __init__(self) -> None:
        self.state = GraphState()
        self._entities = 0

    def participant(
        self, number: int, *, pid: int | None = None, enclave: str = "/", prefix: str = "0110"
    ) -> str:
        guid = f"{prefix}{number:0{24 - len(prefix)}x}000001c1"
        self.state.participant(SeenParticipant(guid, enclave, pid))
        return guid

    def node(self, participant: str, fqn: str, *commands: str, quality: Quality = RELIABLE) -> ListedNode:
        """``commands`` as of ``nodes.py``: ``writer TOPIC TYPE``."""
        owned: dict[str, list[str]] = {"reader": [], "writer": []}
        for command in commands:
            verb, topic, type_name, *_ = command.split()
            self._entities += 1
            guid = f"{participant[:24]}{self._entities:06x}03"
            self.state.endpoint(SeenEndpoint(guid, participant, verb == "writer", topic, type_name, quality))
            owned[verb].append(guid)
        return ListedNode(fqn, tuple(owned["reader"]), tuple(owned["writer"]))

    def listed(self, participant: str, *nodes: ListedNode) -> None:
        self.state.listed(ParticipantList(participant, nodes, 16), participant)

    def graph(self) -> Graph:
        return self.state.graph()


def one_node(fqn: str, *commands: str, pid: int | None = None) -> Graph:
    made = Made()
    participant = made.participant(1, pid=pid)
    made.listed(participant, made.node(participant, fqn, *commands))
    return made.graph()
