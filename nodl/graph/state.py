"""Announcements, as they come and go → what is there now, or was since the observer began. Pure.

Each participant writes its whole list at every change, so the newest one counts; but an endpoint that has ended is no
longer in it, so whose it was is remembered. A list is believed only of the participant that it is about: in an
unsecured domain anybody may write lists for others.
"""

from __future__ import annotations

from nodl.graph.discovery_info import ParticipantList
from nodl.graph.model import Graph, GraphProcess, Owner, owners_in, process_of
from nodl.graph.seen import SeenEndpoint, SeenParticipant


class GraphState:
    """Told of each announcement; ``changes`` counts those that said something new."""

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
        """A participant or an endpoint has ended. The endpoints of a participant end with it."""
        known = guid in self._participants or guid in self._endpoints
        if known and guid not in self._gone:
            self._gone.add(guid)
            self.changes += 1

    def listed(self, message: ParticipantList, writer: str) -> None:
        """``writer``: GUID of the participant that published ``message``; empty when that is not known."""
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
        """What is there now; with ``past`` also all that has ended meanwhile."""
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
