"""tf2_ros: listeners, buffers and their servers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodl.infer.cpp.libraries import library_class
from nodl.infer.cpp.models.nodes import become_node
from nodl.infer.cpp.models.table import ACT, SRV, SUB, TF, Makes, make, owner_in
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import Obj, Value, concatenated, literal, unknown

if TYPE_CHECKING:
    from tree_sitter import Node


def _own_node(run: Machine, this: Obj, name: Value, node: Node, frame: Frame, description: str) -> Obj:
    """A node that a library makes for itself."""
    made = run.obj(("own node", this), Type("rclcpp::Node"), heap=True)
    become_node(run, made, [name], node, frame, lifecycle=False)
    assert made.node is not None
    made.node.description = description
    return made


@library_class("tf2_ros::TransformListener")
def _listener(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    """tf2_ros/src/transform_listener.cpp: without a node it makes one, ``transform_listener_impl_<address>``."""
    owner = owner_in(run, arguments)
    if owner is None and any(_may_be_node(value) for value in arguments[1:2]):
        run.gap(node, frame, "the node of this tf2_ros::TransformListener is not known")
        return None
    if owner is None:
        name = concatenated(literal("transform_listener_impl_"), unknown("an address"))
        owner = _own_node(run, this, name, node, frame, "tf2_ros::TransformListener")
    assert owner.node is not None
    for topic in ("/tf", "/tf_static"):
        run.endpoint(owner.node, SUB, literal(topic), TF, node, frame)
    return None


def _may_be_node(value: Value) -> bool:
    return not value or not all(isinstance(atom, bool) for atom in value)


@library_class("tf2_ros::StaticTransformListener")
def _static_listener(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    owner = owner_in(run, arguments)
    if owner is None or owner.node is None:
        run.gap(node, frame, "the node of this tf2_ros::StaticTransformListener is not known")
        return None
    run.endpoint(owner.node, SUB, literal("/tf_static"), TF, node, frame)
    return None


@library_class("tf2_ros::Buffer")
def _buffer(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    """tf2_ros/src/buffer.cpp: with a node, the service ``tf2_frames`` on it."""
    owner = owner_in(run, arguments)
    if owner is not None and owner.node is not None:
        run.endpoint(owner.node, SRV, literal("tf2_frames"), "tf2_msgs/srv/FrameGraph", node, frame)
    return None


@library_class("tf2_ros::BufferServer")
def _buffer_server(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    """tf2_ros/buffer_server.h: (buffer, node, action name, ...)."""
    make(run, (Makes(ACT, "{0}", "tf2_msgs/action/LookupTransform"),), this, arguments[1:], node, frame)
    return None


@library_class("robot_localization::RosRobotLocalizationListener")
def _robot_localization(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    """robot_localization/src/ros_robot_localization_listener.cpp: two topics, and a listener with a node of its own."""
    row = (
        Makes(SUB, "odom/filtered", "nav_msgs/msg/Odometry"),
        Makes(SUB, "acceleration/filtered", "geometry_msgs/msg/AccelWithCovarianceStamped"),
    )
    make(run, row, this, arguments, node, frame)
    return _listener(run, this, [], node, frame)
