"""Permissions of one enclave in the four ways that a Zenoh router can distinguish. Performs no I/O.

Made from the DDS topics that its permissions grant, so that both middlewares enforce the same and never anything else:
what ``permissions`` decided about denials holds here too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

from enclave_addons.zenoh.key_expressions import NotExpressible, name_expressions
from keystore.formats.permissions import TopicSets, dds_rules
from keystore.formats.permissions_names import DISCOVERY_TOPIC
from keystore.formats.permissions_patterns import can_meet
from keystore.formats.policy import EnclavePolicy, Operation


class Use(str, Enum):
    """Use of a key: an action is three services and two topics."""

    __hash__ = str.__hash__

    PUBLISH = "publish"
    SUBSCRIBE = "subscribe"
    CALL = "call"
    SERVE = "serve"


PLAIN_USES = {
    Operation.PUBLISH: Use.PUBLISH,
    Operation.SUBSCRIBE: Use.SUBSCRIBE,
    Operation.REQUEST: Use.CALL,
    Operation.REPLY: Use.SERVE,
}
"""Of what is not an action."""
Types = Mapping[tuple[Use, str], tuple[str, ...]]
"""Use and absolute name -> the type chunks it has; a name that is missing may have any type."""


class Grants(NamedTuple):
    """The permissions of an enclave on Zenoh. ``names``: by use, sorted. ``gaps``: what is granted on DDS and cannot
    be granted here, in words."""

    names: Mapping[Use, tuple[str, ...]]
    types: Types = MappingProxyType({})
    gaps: tuple[str, ...] = ()

    def of(self, use: Use) -> tuple[str, ...]:
        return self.names.get(use, ())

    def types_of(self, use: Use, name: str) -> tuple[str, ...]:
        return self.types.get((use, name), ())


def grants_of_policy(policy: EnclavePolicy, types: Types = MappingProxyType({})) -> Grants:
    """Return the grants of a policy; raises ``PolicyError`` for a name that no ROS node can have."""
    rules = dds_rules(policy)
    return grants_of_topics(rules.allow, rules.deny, types)


def grants_of_topics(allow: TopicSets, deny: TopicSets, types: Types = MappingProxyType({})) -> Grants:
    """Return grants of topics. ``deny``: denials of names that ``allow`` grants by a wildcard.

    Deny rules do not hold on Zenoh (a message on ``0/**`` passes a denial of ``0/secret/**``), so such a wildcard is
    a gap as a whole.
    """
    found: dict[Use, list[str]] = {use: [] for use in Use}
    gaps: list[str] = []
    published, subscribed = set(allow.publish), set(allow.subscribe)
    for use, name, topics in _uses(published, subscribed):
        denied = [
            topic for topic, other in zip(topics, (deny.publish, deny.subscribe), strict=True)
            if topic and any(can_meet(topic, one) for one in other)
        ]  # fmt: skip
        if denied:
            gaps.append(f"{use.value} {name}: a part of it is denied, and denials do not hold on Zenoh")
            continue
        try:
            name_expressions(name)
        except NotExpressible as error:
            gaps.append(f"{use.value} {error}")
            continue
        found[use].append(name)
    gaps += [f"{topic}: no ROS name" for topic in sorted(_without_ros_name(published | subscribed))]
    names = {use: tuple(sorted(each)) for use, each in found.items()}
    granted = {(use, name) for use, each in names.items() for name in each}
    return Grants(names, {key: each for key, each in types.items() if key in granted}, tuple(gaps))


def _uses(publish: set[str], subscribe: set[str]) -> Iterator[tuple[Use, str, tuple[str, str]]]:
    for topic in sorted(publish):
        if topic.startswith("rt/"):
            yield Use.PUBLISH, topic[2:], (topic, "")
        elif topic.startswith("rq/") and topic.endswith("Request"):
            reply = f"rr{topic[2:-7]}Reply"
            if reply in subscribe:
                yield Use.CALL, topic[2:-7], (topic, reply)
        elif topic.startswith("rr/") and topic.endswith("Reply"):
            request = f"rq{topic[2:-5]}Request"
            if request in subscribe:
                yield Use.SERVE, topic[2:-5], (topic, request)
    for topic in sorted(subscribe):
        if topic.startswith("rt/"):
            yield Use.SUBSCRIBE, topic[2:], ("", topic)


def _without_ros_name(topics: Iterable[str]) -> Iterator[str]:
    known = ("rt/", "rq/", "rr/")
    return (topic for topic in topics if not topic.startswith(known) and topic != DISCOVERY_TOPIC)
