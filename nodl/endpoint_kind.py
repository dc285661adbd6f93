"""The kinds of endpoints of a node, with their words in NoDL."""

from __future__ import annotations

from enum import Enum


class EndpointKind(str, Enum):
    """The six ways in which a ROS 2 node takes part in communication."""

    __str__ = str.__str__

    PUBLISHER = "publisher"
    SUBSCRIPTION = "subscription"
    SERVICE_SERVER = "service_server"
    SERVICE_CLIENT = "service_client"
    ACTION_SERVER = "action_server"
    ACTION_CLIENT = "action_client"

    @property
    def family(self) -> str:
        """Return ``topic``, ``service`` or ``action``, the element of NoDL v1."""
        family, divided, _ = self.value.partition("_")
        return family if divided else "topic"

    @property
    def role(self) -> str:
        """Return ``publisher``, ``subscription``, ``server`` or ``client``, the role in NoDL v1."""
        return self.value.rpartition("_")[2]

    @property
    def type_folder(self) -> str:
        """Return ``msg``, ``srv`` or ``action``, the middle part of its interface types."""
        return {"topic": "msg", "service": "srv", "action": "action"}[self.family]

    @property
    def category(self) -> str:
        """Return ``publishers``, ``service_servers`` ..., the list of NoDL v2."""
        return f"{self.value}s"
