"""Well-known libraries: what each of their classes and functions makes on the node that it gets.

Each row names the file that was read. A row lists interfaces with their fixed name, or with the argument that the name
comes from (counted behind the node). Rows without interfaces were read too: those classes make none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from nodl.infer.cpp.libraries import LIBRARY_CLASSES, LIBRARY_METHODS, NODE_BASES, Call, library_class
from nodl.infer.cpp.models.interfaces import add
from nodl.infer.cpp.models.nodes import become_node
from nodl.infer.cpp.reading.type_names import ros_type
from nodl.infer.cpp.running.contents import nodes_in
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import BOTTOM, Obj, Param, Text, Value, concatenated, literal, unknown
from nodl.node_interface import EndpointKind

if TYPE_CHECKING:
    from tree_sitter import Node


PUB, SUB = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION
SRV, CLI = EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT
ACT, CALL = EndpointKind.ACTION_SERVER, EndpointKind.ACTION_CLIENT


class Makes(NamedTuple):
    """``name``: fixed, or ``{0}``: the first text behind the node; ``type``: ``T0`` for the first template argument."""

    kind: EndpointKind
    name: str
    type: str


TF = "tf2_msgs/msg/TFMessage"

ROWS: dict[str, tuple[Makes, ...]] = {
    # tf2_ros/src/transform_broadcaster.cpp, static_transform_broadcaster.h, buffer_server.h, buffer_client.h
    "tf2_ros::TransformBroadcaster": (Makes(PUB, "/tf", TF),),
    "tf2_ros::StaticTransformBroadcaster": (Makes(PUB, "/tf_static", TF),),
    "tf2_ros::BufferClient": (Makes(CALL, "{0}", "tf2_msgs/action/LookupTransform"),),
    # diagnostic_updater/diagnostic_updater.hpp: publisher /diagnostics, parameters diagnostic_updater.*
    "diagnostic_updater::Updater": (Makes(PUB, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"),),
    # bondcpp/src/bond.cpp: publishes and subscribes the topic that it gets
    "bond::Bond": (Makes(PUB, "{0}", "bond/msg/Status"), Makes(SUB, "{0}", "bond/msg/Status")),
    # rclcpp/parameter_event_handler.hpp, parameter_client.hpp
    "rclcpp::ParameterEventHandler": (Makes(SUB, "/parameter_events", "rcl_interfaces/msg/ParameterEvent"),),
    "rclcpp::ParameterEventsSubscriber": (
        Makes(SUB, "/parameter_events", "rcl_interfaces/msg/ParameterEvent"),
    ),
    # interactive_markers/src/interactive_marker_server.cpp, topics below the namespace that it gets
    "interactive_markers::InteractiveMarkerServer": (
        Makes(SRV, "{0}/get_interactive_markers", "visualization_msgs/srv/GetInteractiveMarkers"),
        Makes(PUB, "{0}/update", "visualization_msgs/msg/InteractiveMarkerUpdate"),
        Makes(SUB, "{0}/feedback", "visualization_msgs/msg/InteractiveMarkerFeedback"),
    ),
    # nav2_util/simple_action_server.hpp, service_client.hpp, odometry_utils.hpp
    # (used where the sources of nav2_util are not in reach)
    "nav2_util::SimpleActionServer": (Makes(ACT, "{0}", "T0"),),
    "nav2::SimpleActionServer": (Makes(ACT, "{0}", "T0"),),
    "nav2_util::ServiceClient": (Makes(CLI, "{0}", "T0"),),
    "nav2_util::ServiceServer": (Makes(SRV, "{0}", "T0"),),
    "nav2::ServiceClient": (Makes(CLI, "{0}", "T0"),),
    "nav2_util::OdomSmoother": (Makes(SUB, "{0}", "nav_msgs/msg/Odometry"),),
    # no interfaces of their own: tf2_ros/create_timer_ros.h, realtime_tools, laser_geometry, message_filters
    "tf2_ros::CreateTimerROS": (),
    "realtime_tools::RealtimePublisher": (),
    "realtime_tools::RealtimeBuffer": (),
    "realtime_tools::RealtimeBox": (),
    "realtime_tools::RealtimeThreadSafeBox": (),
    "realtime_tools::RealtimeServerGoalHandle": (),
    "realtime_tools::AsyncFunctionHandler": (),
    "laser_geometry::LaserProjection": (),
    "camera_info_manager::CameraInfoManager": (
        Makes(SRV, "~/set_camera_info", "sensor_msgs/srv/SetCameraInfo"),
    ),
    "image_geometry::PinholeCameraModel": (),
    "image_geometry::StereoCameraModel": (),
    "message_filters::Connection": (),
    "message_filters::TimeSynchronizer": (),
    "message_filters::Synchronizer": (),
    "message_filters::Cache": (),
    "message_filters::Chain": (),
    "message_filters::PassThrough": (),
    "message_filters::sync_policies::ApproximateTime": (),
    "message_filters::sync_policies::ExactTime": (),
    "tf2_ros::MessageFilter": (),
    "diagnostic_updater::FrequencyStatus": (),
    "diagnostic_updater::TimeStampStatus": (),
    "diagnostic_updater::HeaderlessTopicDiagnostic": (),
    "diagnostic_updater::TopicDiagnostic": (),
    "diagnostic_updater::DiagnosedPublisher": (),
    "diagnostic_updater::FrequencyStatusParam": (),
    "diagnostic_updater::TimeStampStatusParam": (),
    "diagnostic_updater::DiagnosticStatusWrapper": (),
    "diagnostic_updater::FunctionDiagnosticTask": (),
    "diagnostic_updater::CompositeDiagnosticTask": (),
}


def texts_in(arguments: Sequence[Value], run: Machine) -> list[Value]:
    return [value for value in arguments if value and not nodes_in(run, value)]


def owner_in(run: Machine, arguments: Sequence[Value]) -> Obj | None:
    return next((obj for value in arguments for obj in nodes_in(run, value)), None)


def make(
    run: Machine, row: Sequence[Makes], this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> None:
    """The interfaces of a row, on the node among ``arguments``."""
    owner = owner_in(run, arguments)
    for value in arguments:
        for atom in value:
            run.later(atom, frame)
    if owner is None or owner.node is None:
        if row:
            run.gap(node, frame, f"the node that {this.type.name} makes interfaces on is not known")
        return
    texts = texts_in(arguments, run)
    for each in row:
        kind = each.type
        if kind == "T0":
            kind = ros_type(this.type.arguments[0]) if this.type.arguments else ""
        call = Call(node, frame, [], [], (), owner)
        add(run, owner, each.kind, _named(each.name, texts), kind, call)


def _named(name: str, texts: Sequence[Value]) -> Value:
    head, separator, tail = name.partition("{0}")
    if not separator:
        return literal(name)
    return concatenated(
        literal(head), texts[0] if texts else unknown("a name that is not given"), literal(tail)
    )


def _row(name: str, row: tuple[Makes, ...]) -> None:
    def model(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
        make(run, row, this, arguments, node, frame)
        return None

    library_class(name)(model)


for _name, _makes in ROWS.items():
    _row(_name, _makes)


# --- message_filters ----------------------------------------------------------------------------------------------


@library_class("message_filters::Subscriber")
def _filter_subscriber(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    """message_filters/subscriber.h: with a node it subscribes at once, else when ``subscribe`` is called."""
    if arguments:
        _filter_subscribe(run, this, arguments, node, frame)
    return None


def _filter_subscribe(run: Machine, this: Obj, arguments: Sequence[Value], node: Node, frame: Frame) -> None:
    owner = owner_in(run, arguments)
    texts = texts_in(arguments, run)
    kind = ros_type(this.type.arguments[0]) if this.type.arguments else ""
    if not arguments and this.data.get("topic") is not None:
        return  # the same subscription again
    if owner is None or owner.node is None:
        run.gap(node, frame, f"the node of this {this.type.name} is not known")
        return
    this.data["topic"] = True
    run.endpoint(
        owner.node, SUB, texts[0] if texts else unknown("a topic that is not given"), kind, node, frame
    )


def _subscribe(run: Machine, call: Call) -> Value:
    assert call.receiver is not None
    _filter_subscribe(run, call.receiver, call.values, call.node, call.frame)
    return BOTTOM


LIBRARY_METHODS[("message_filters::Subscriber", "subscribe")] = _subscribe


# --- nodes of libraries -------------------------------------------------------------------------------------------


def _nav2_lifecycle(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    """nav2_util/lifecycle_node.hpp: a lifecycle node with a bond to its manager."""
    record = become_node(run, this, arguments, node, frame, lifecycle=True)
    for kind in (PUB, SUB):
        run.endpoint(record, kind, literal("bond"), "bond/msg/Status", node, frame)
    return None


for _cls in ("nav2_util::LifecycleNode", "nav2::LifecycleNode"):
    NODE_BASES[_cls] = LIBRARY_CLASSES[_cls] = _nav2_lifecycle


def _component_manager(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    """rclcpp_components/component_manager.hpp: (executor, name, options); what it loads is the launch's business."""
    texts = [v for v in arguments if any(isinstance(a, Text | Param) for a in v)]
    record = become_node(
        run, this, [texts[0] if texts else literal("ComponentManager")], node, frame, lifecycle=False
    )
    for name, kind in (("load_node", "LoadNode"), ("unload_node", "UnloadNode"), ("list_nodes", "ListNodes")):
        run.endpoint(
            record, SRV, literal(f"~/_container/{name}"), f"composition_interfaces/srv/{kind}", node, frame
        )
    return None


for _cls in ("rclcpp_components::ComponentManager",):
    NODE_BASES[_cls] = LIBRARY_CLASSES[_cls] = _component_manager
