"""An SROS2 access-control policy (version 0.2.0, ros2/design articles/ros2_access_control_policies) as plain values."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from typing import NamedTuple

from keystore.errors import InvalidInputError
from keystore.formats.permissions_patterns import has_wildcard


class PolicyError(InvalidInputError):
    """A policy, or a name in one, that must not become permissions. The text says what and where."""


class Operation(str, Enum):
    """The operation that a rule is about. The value is the attribute of the policy XML, which has ``call``
    for actions only. ``verb`` is the word in messages: the same for topics, services and actions everywhere."""

    __str__ = str.__str__

    PUBLISH = "publish"
    SUBSCRIBE = "subscribe"
    REPLY = "reply"  # serve a service
    REQUEST = "request"  # call a service
    EXECUTE = "execute"  # serve an action
    CALL = "call"  # call an action

    @property
    def verb(self) -> str:
        """Return the verb of ``node /a may VERB /name``."""
        return _VERBS.get(self, str(self.value))


_VERBS = {
    Operation.REPLY: "serve",
    Operation.REQUEST: "call",
    Operation.EXECUTE: "serve action",
    Operation.CALL: "call action",
}


class Qualifier(str, Enum):
    """Effect of a rule of an SROS2 policy: grant or refuse."""

    __str__ = str.__str__

    ALLOW = "ALLOW"
    DENY = "DENY"


class Rule(NamedTuple):
    """A rule of a policy. ``expression`` is absolute (``/a/b``), relative or private to the profile; it may hold
    wildcards only where a policy file had them."""

    operation: Operation
    qualifier: Qualifier
    expression: str


class Profile(NamedTuple):
    """The rules of one node: ``ns`` is an absolute namespace, ``node`` a node name."""

    ns: str
    node: str
    rules: tuple[Rule, ...]


class EnclavePolicy(NamedTuple):
    """All that one enclave may do: the union of its profiles; DENY of any beats ALLOW of any.

    ``publishes_discovery``: it holds ROS nodes, whose rmw publishes which endpoints are theirs; a mere observer does
    not.
    """

    path: str
    profiles: tuple[Profile, ...]
    publishes_discovery: bool = True


class Policy(NamedTuple):
    """Enclaves sorted by path, each path once."""

    enclaves: tuple[EnclavePolicy, ...]

    def wildcards(self) -> dict[str, tuple[str, ...]]:
        """Map each enclave to what it is allowed by wildcard: granted because a person wrote it; to be reported."""
        found = {enclave.path: tuple(sorted(set(_wildcards(enclave)))) for enclave in self.enclaves}
        return {path: expressions for path, expressions in found.items() if expressions}


def _wildcards(enclave: EnclavePolicy) -> Iterator[str]:
    for profile in enclave.profiles:
        for rule in profile.rules:
            name = rule.expression
            if name[:1] == "~" and has_wildcard(profile.node):
                name = f"{profile.ns.rstrip('/')}/{profile.node}{name[1:]}"
            if rule.qualifier is Qualifier.ALLOW and has_wildcard(name):
                yield name
