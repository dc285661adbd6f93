"""nav2's own factories and classes that read parameters, where its sources are not in reach.

Source: ros-navigation/navigation2 humble 3c3db59d6, jazzy f4108e5b1, kilted 71a1d84f4, main a3a97043e: nav2_util,
nav2_ros_common (interface_factories.hpp, lifecycle_node.hpp, service_server.hpp), nav_2d_utils (odom_subscriber.hpp).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodl.infer.cpp.libraries import LIBRARY_FUNCTIONS, Call, library_class, node_method
from nodl.infer.cpp.models.interfaces import KINDS, add
from nodl.infer.cpp.models.parameters import read
from nodl.infer.cpp.models.table import ACT, CALL, PUB, SRV, SUB, owner_in, texts_in
from nodl.infer.cpp.reading.type_names import ros_type
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import Obj, Text, Value, concatenated, literal, unknown
from nodl.name_template import ParameterPart
from nodl.node_interface import EndpointKind

if TYPE_CHECKING:
    from tree_sitter import Node

for _word in KINDS:
    LIBRARY_FUNCTIONS[f"nav2::interfaces::create_{_word}"] = LIBRARY_FUNCTIONS[f"rclcpp::create_{_word}"]
for _word in ("server", "client"):
    LIBRARY_FUNCTIONS[f"nav2::interfaces::create_action_{_word}"] = LIBRARY_FUNCTIONS[
        f"rclcpp_action::create_{_word}"
    ]


def _action(word: str, kind: EndpointKind) -> None:
    def method(run: Machine, call: Call) -> Value:
        assert call.receiver is not None
        return add(
            run, call.receiver, kind, call.value(0), ros_type(call.types[0]) if call.types else "", call
        )

    node_method(f"create_action_{word}")(method)


_action("server", ACT)
_action("client", CALL)


@library_class("nav2_util::ServiceServer", "nav2::ServiceServer")
def _service(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    """(name, node, callback): with the parameter ``service_introspection_mode`` also its events."""
    owner = owner_in(run, arguments)
    if owner is None or owner.node is None:
        run.gap(node, frame, f"the node of this {this.type.name} is not known")
        return None
    texts = texts_in(arguments, run)
    name = texts[0] if texts else unknown("a name that is not given")
    kind = ros_type(this.type.arguments[0]) if this.type.arguments else ""
    run.endpoint(owner.node, SRV, name, kind, node, frame)
    for mode in ("metadata", "contents"):
        part = ParameterPart("service_introspection_mode", "disabled", None, (("only if equal", (mode,)),))
        events = concatenated(name, literal("/_service_event"), (Text((part,)),))
        run.endpoint(owner.node, PUB, events, f"{kind}_Event" if kind else "", node, frame)
    for argument in arguments:
        for atom in argument:
            run.later(atom, frame)
    return None


@library_class("nav_2d_utils::OdomSubscriber")
def _odometry(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    """(node, default topic): the parameter ``odom_topic`` names it."""
    owner = owner_in(run, arguments)
    if owner is None or owner.node is None:
        run.gap(node, frame, f"the node of this {this.type.name} is not known")
        return None
    texts = texts_in(arguments, run)
    topic = read(run, owner.node, literal("odom_topic"), texts[0] if texts else literal("odom"))
    run.endpoint(owner.node, SUB, topic, "nav_msgs/msg/Odometry", node, frame)
    return None
