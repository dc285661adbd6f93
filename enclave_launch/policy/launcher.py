"""The launcher's own node: where a launch must load components or change lifecycle states, it talks too.

Its name is fixed, so that its permissions are: real launch's ``launch_ros_<pid>`` would need wildcards."""

from __future__ import annotations

from collections.abc import Sequence

from enclave_common.source_location import SourceLocation
from enclave_launch.policy.running_node import RunningNode
from enclave_launch.process import LauncherCall
from nodl.name_template import NameTemplate
from nodl.node_interface import ClientLibrary, Endpoint, EndpointKind, NodeInterface
from nodl.remap import RemapRules

LAUNCHER_NODE = "launcher"
LAUNCHER_ENCLAVE = "/launcher"
_CHANGE_STATE = "lifecycle_msgs/srv/ChangeState"
_TRANSITION_EVENT = "lifecycle_msgs/msg/TransitionEvent"


def launcher_node(calls: Sequence[LauncherCall]) -> RunningNode:
    """Return the node that makes ``calls``; a client of transitions also follows ``transition_event``."""
    endpoints: list[Endpoint] = []
    for call in calls:
        source = SourceLocation(call.location.file, call.location.line)
        endpoints.append(_endpoint(EndpointKind.SERVICE_CLIENT, call.service, call.type, source))
        node, _, service = call.service.rpartition("/")
        if service == "change_state" and call.type == _CHANGE_STATE:
            event = f"{node}/transition_event"
            endpoints.append(_endpoint(EndpointKind.SUBSCRIPTION, event, _TRANSITION_EVENT, source))
    name, place = LAUNCHER_NODE, calls[0].location
    interface = NodeInterface(
        package=None,
        executable=name,
        plugin=None,
        name=name,
        namespace="/",
        endpoints=tuple(dict.fromkeys(endpoints)),
        source=SourceLocation(place.file, place.line),
        library=ClientLibrary.RCLPY,
    )
    return RunningNode(interface, name, name, "/", RemapRules(), {}, LAUNCHER_ENCLAVE, place, role="launcher")


def _endpoint(kind: EndpointKind, name: str, type_name: str, source: SourceLocation) -> Endpoint:
    return Endpoint(kind, NameTemplate.literal(name), type_name, source)
