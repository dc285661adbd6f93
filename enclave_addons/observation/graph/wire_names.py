"""DDS topic and type names → what a ROS node means (ros2/design topic_and_service_names, rcl_action). No I/O."""

from __future__ import annotations

import re
from typing import NamedTuple

from nodl.names import is_full_name
from nodl.node_interface import EndpointKind
from nodl.remap import ACTION_SERVICES, ACTION_TOPICS

DISCOVERY_TOPIC = "ros_discovery_info"
TOPIC, REQUEST, REPLY = "topic", "request", "reply"

_ACTION = re.compile(r"(.+)/_action/([a-z_]+)\Z")
_SERVICE_PARTS = frozenset({REQUEST, REPLY})
_SERVER_PARTS = frozenset(
    {*(f"{each} {half}" for each in ACTION_SERVICES for half in (REQUEST, REPLY)), *ACTION_TOPICS}
)
PARTS: dict[EndpointKind, frozenset[str]] = {
    EndpointKind.PUBLISHER: frozenset({TOPIC}),
    EndpointKind.SUBSCRIPTION: frozenset({TOPIC}),
    EndpointKind.SERVICE_SERVER: _SERVICE_PARTS,
    EndpointKind.SERVICE_CLIENT: _SERVICE_PARTS,
    EndpointKind.ACTION_SERVER: _SERVER_PARTS,
    EndpointKind.ACTION_CLIENT: _SERVER_PARTS,
}
"""The DDS endpoints that each kind of ROS endpoint consists of."""

_TYPE = re.compile(r"([A-Za-z]\w*)::(msg|srv|action)::dds_::(\w+)_\Z")
_TYPE_ENDINGS = {
    "srv": ("_Request", "_Response"),
    "action": (
        "_SendGoal_Request",
        "_SendGoal_Response",
        "_GetResult_Request",
        "_GetResult_Response",
        "_FeedbackMessage",
    ),
}
_OF_EVERY_ACTION = ("cancel_goal", "status")  # their types are action_msgs', whatever the action


class Part(NamedTuple):
    """The ROS interface to which one DDS endpoint belongs. ``type`` is empty if this part does not determine it."""

    kind: EndpointKind
    name: str
    part: str
    type: str


def part_of(topic: str, type_name: str, *, writes: bool) -> Part | None:
    """Return the part of a name, None for the middleware's own topic and for what is not ROS."""
    prefix, slash, rest = topic.partition("/")
    name = slash + rest
    if prefix == "rt":
        part = _topic(name, type_name, writes)
    elif prefix == "rq" and name.endswith("Request"):
        part = _service(name[: -len("Request")], REQUEST, type_name, client=writes)
    elif prefix == "rr" and name.endswith("Reply"):
        part = _service(name[: -len("Reply")], REPLY, type_name, client=not writes)
    else:
        return None
    return part if is_full_name(part.name) else None


def ros_type(type_name: str) -> str:
    """Return ``std_msgs/msg/String`` for ``std_msgs::msg::dds_::String_``; another name stays as it is."""
    match = _TYPE.match(type_name)
    if not match:
        return type_name
    package, kind, name = match.groups()
    ending = next(filter(name.endswith, _TYPE_ENDINGS.get(kind, ())), "")
    return f"{package}/{kind}/{name.removesuffix(ending)}"


def _topic(name: str, type_name: str, writes: bool) -> Part:
    action = _ACTION.match(name)
    if action and action[2] in ACTION_TOPICS:
        kind = EndpointKind.ACTION_SERVER if writes else EndpointKind.ACTION_CLIENT
        return Part(kind, action[1], action[2], _action_type(action[2], type_name))
    kind = EndpointKind.PUBLISHER if writes else EndpointKind.SUBSCRIPTION
    return Part(kind, name, TOPIC, ros_type(type_name))


def _service(name: str, half: str, type_name: str, *, client: bool) -> Part:
    action = _ACTION.match(name)
    if action and action[2] in ACTION_SERVICES:
        kind = EndpointKind.ACTION_CLIENT if client else EndpointKind.ACTION_SERVER
        return Part(kind, action[1], f"{action[2]} {half}", _action_type(action[2], type_name))
    kind = EndpointKind.SERVICE_CLIENT if client else EndpointKind.SERVICE_SERVER
    return Part(kind, name, half, ros_type(type_name))


def _action_type(part: str, type_name: str) -> str:
    return "" if part in _OF_EVERY_ACTION else ros_type(type_name)
