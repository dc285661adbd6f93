"""What one enclave may do, in the four ways that a Zenoh router can tell apart. Pure.

Made from the DDS topics that its permissions grant, so that both middlewares enforce the same and never anything else:
what ``permissions`` decided about denials holds here too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

from keystore.formats.permissions import TopicSets, dds_rules
from keystore.formats.permissions_names import DISCOVERY_TOPIC
from keystore.formats.permissions_patterns import can_meet
from keystore.formats.policy import EnclavePolicy, Operation
from keystore.formats.zenoh.key_expressions import NotExpressible, name_expressions, type_chunk


class Use(str, Enum):
    """What is done with a key: an action is three services and two topics."""

    __hash__ = str.__hash__

    PUBLISH = "publish"
    SUBSCRIBE = "subscribe"
    CALL = "call"
    SERVE = "serve"


Types = Mapping[tuple[Use, str], tuple[str, ...]]
"""Use and absolute name -> the type chunks it has; a name that is missing may have any type."""


class Grants(NamedTuple):
    """``names``: by use, sorted. ``gaps``: what is granted on DDS and cannot be granted here, in words."""

    names: Mapping[Use, tuple[str, ...]]
    types: Types = MappingProxyType({})
    gaps: tuple[str, ...] = ()

    def of(self, use: Use) -> tuple[str, ...]:
        return self.names.get(use, ())

    def types_of(self, use: Use, name: str) -> tuple[str, ...]:
        return self.types.get((use, name), ())


def grants_of_policy(policy: EnclavePolicy, types: Types = MappingProxyType({})) -> Grants:
    """Raises ``PolicyError`` for a name that no ROS node can have."""
    rules = dds_rules(policy)
    return grants_of_topics(rules.allow, rules.deny, types)


def grants_of_topics(allow: TopicSets, deny: TopicSets, types: Types = MappingProxyType({})) -> Grants:
    """``deny``: denials of names that ``allow`` grants by a wildcard. Deny rules do not hold on Zenoh (a message on
    ``0/**`` passes a denial of ``0/secret/**``), so such a wildcard is a gap as a whole."""
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
    """Use, name, and the topics that are published and subscribed for it."""
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


def types_of_interface(
    operation: Operation, name: str, ros_type: str
) -> Iterator[tuple[Use, str, str | None]]:
    """What an interface of this type means for each of its topics and services: use, name, type chunk.

    Source for actions: rosidl (``Fibonacci_SendGoal``, ``Fibonacci_FeedbackMessage``), rcl_action's names.
    """
    if operation not in (Operation.CALL, Operation.EXECUTE):
        yield _PLAIN[operation], name, type_chunk(ros_type)
        return
    service, topic = (Use.CALL, Use.SUBSCRIBE) if operation is Operation.CALL else (Use.SERVE, Use.PUBLISH)
    own = type_chunk(ros_type)
    for part, suffix in (("send_goal", "_SendGoal_"), ("get_result", "_GetResult_")):
        yield service, f"{name}/_action/{part}", own and own[:-1] + suffix
    yield service, f"{name}/_action/cancel_goal", type_chunk("action_msgs/srv/CancelGoal")
    yield topic, f"{name}/_action/feedback", own and own[:-1] + "_FeedbackMessage_"
    yield topic, f"{name}/_action/status", type_chunk("action_msgs/msg/GoalStatusArray")


_PLAIN = {
    Operation.PUBLISH: Use.PUBLISH,
    Operation.SUBSCRIBE: Use.SUBSCRIBE,
    Operation.REQUEST: Use.CALL,
    Operation.REPLY: Use.SERVE,
}


def united_types(known: Iterable[tuple[Use, str, str | None]]) -> Types:
    """By use and name; a name is left out as soon as one of its types is not known, or it holds a wildcard."""
    found: dict[tuple[Use, str], set[str | None]] = {}
    for use, name, chunk in known:
        found.setdefault((use, name), set()).add(chunk)
    return {
        key: tuple(sorted(one for one in chunks if one is not None))
        for key, chunks in sorted(found.items())
        if None not in chunks and not any(character in key[1] for character in "*?[")
    }
