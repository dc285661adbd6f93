"""The values of the NoDL v1 Python API, made from ``nodl.node_interface`` for code that was written for it."""

from __future__ import annotations

from enum import Enum, unique
from typing import Any, TypeVar


@unique
class PubSubRole(Enum):
    """The ends of a topic that a node has."""

    PUBLISHER = "publisher"
    SUBSCRIPTION = "subscription"
    BOTH = "both"


@unique
class ServerClientRole(Enum):
    """The ends of a service or action that a node has."""

    SERVER = "server"
    CLIENT = "client"
    BOTH = "both"


class NoDLData:
    """Base of all values: shows its fields."""

    def __repr__(self) -> str:
        return str(self.__dict__)

    def __str__(self) -> str:
        return repr(self)


class NoDLInterface(NoDLData):
    """Something with a name and a type; equal to another of the same class with the same fields."""

    def __init__(self, *, name: str, value_type: str) -> None:
        self.name = name
        self.type = value_type

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.__dict__ == other.__dict__

    __hash__ = None  # type: ignore[assignment]  # mutable, as in the v1 API


class Parameter(NoDLInterface):
    """A parameter with its type."""

    def __init__(self, *, name: str, parameter_type: str) -> None:
        super().__init__(name=name, value_type=parameter_type)


class Topic(NoDLInterface):
    """A topic with its message type."""

    def __init__(self, *, name: str, message_type: str, role: PubSubRole) -> None:
        super().__init__(name=name, value_type=message_type)
        self.role = role


class Service(NoDLInterface):
    """A service with its type."""

    def __init__(self, *, name: str, service_type: str, role: ServerClientRole) -> None:
        super().__init__(name=name, value_type=service_type)
        self.role = role


class Action(NoDLInterface):
    """An action with its type."""

    def __init__(self, *, name: str, action_type: str, role: ServerClientRole) -> None:
        super().__init__(name=name, value_type=action_type)
        self.role = role


_Interface = TypeVar("_Interface", bound=NoDLInterface)


class Node(NoDLData):
    """All interfaces of one node, each kind by name. A name given twice with two roles has both."""

    def __init__(
        self,
        *,
        name: str,
        executable: str,
        actions: list[Action] | None = None,
        parameters: list[Parameter] | None = None,
        services: list[Service] | None = None,
        topics: list[Topic] | None = None,
    ) -> None:
        self.name = name
        self.executable = executable
        self.actions = _by_name(actions)
        self.parameters = _by_name(parameters)
        self.services = _by_name(services)
        self.topics = _by_name(topics)


def _by_name(interfaces: list[_Interface] | None) -> dict[str, _Interface]:
    found: dict[str, _Interface] = {}
    for interface in interfaces or []:
        known: Any = found.setdefault(interface.name, interface)
        role = getattr(interface, "role", None)
        if role is not None and known.role != role:
            known.role = type(role)("both")
    return found
