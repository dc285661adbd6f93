"""Well-known libraries: what each of their classes and functions makes on the node that it gets.

Each row names the file that was read. A row lists interfaces with their fixed name, or with the argument that the name
comes from (counted behind the node). Rows without interfaces were read too: those classes make none.
"""

from __future__ import annotations

import re
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
    """``name``: fixed, or with ``{1}``, the second argument behind the node (``{1=odom}``: where it is not given);
    ``type``: ``T0`` for the first template argument, empty where a parameter decides."""

    kind: EndpointKind
    name: str
    type: str


TF = "tf2_msgs/msg/TFMessage"
_LIFECYCLE = "lifecycle_msgs/srv"

ROWS: dict[str, tuple[Makes, ...]] = {
    # ros2/geometry2 humble d0dbd516, jazzy 646342c6, rolling 1b005c65: tf2_ros/include/tf2_ros/transform_broadcaster.h,
    # static_transform_broadcaster.h, buffer_client.h
    "tf2_ros::TransformBroadcaster": (Makes(PUB, "/tf", TF),),
    "tf2_ros::StaticTransformBroadcaster": (Makes(PUB, "/tf_static", TF),),
    "tf2_ros::BufferClient": (Makes(CALL, "{0}", "tf2_msgs/action/LookupTransform"),),
    # ros/diagnostics ros2 431926f: diagnostic_updater/include/diagnostic_updater/diagnostic_updater.hpp
    "diagnostic_updater::Updater": (Makes(PUB, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"),),
    # ros/bond_core ros2 e6d0fc2: bondcpp/src/bond.cpp
    "bond::Bond": (Makes(PUB, "{0}", "bond/msg/Status"), Makes(SUB, "{0}", "bond/msg/Status")),
    # ros2/rclcpp humble 99f1d8d12, jazzy 985e320de, rolling a0a2a067d: rclcpp/parameter_event_handler.hpp
    "rclcpp::ParameterEventHandler": (Makes(SUB, "/parameter_events", "rcl_interfaces/msg/ParameterEvent"),),
    "rclcpp::ParameterEventsSubscriber": (
        Makes(SUB, "/parameter_events", "rcl_interfaces/msg/ParameterEvent"),
    ),
    # ros-visualization/interactive_markers humble b4e6a0d, rolling 165a0e6: src/interactive_marker_server.cpp
    "interactive_markers::InteractiveMarkerServer": (
        Makes(SRV, "{0}/get_interactive_markers", "visualization_msgs/srv/GetInteractiveMarkers"),
        Makes(PUB, "{0}/update", "visualization_msgs/msg/InteractiveMarkerUpdate"),
        Makes(SUB, "{0}/feedback", "visualization_msgs/msg/InteractiveMarkerFeedback"),
    ),
    # Where the sources of nav2 are not in reach. ros-navigation/navigation2 humble 3c3db59d6, jazzy f4108e5b1,
    # kilted 71a1d84f4, main a3a97043e: nav2_util (nav2_ros_common in main) simple_action_server.hpp,
    # service_client.hpp, odometry_utils.hpp, lifecycle_service_client.hpp, twist_publisher.hpp,
    # twist_subscriber.hpp (which parameter enable_stamped_cmd_vel makes Twist or TwistStamped)
    "nav2_util::SimpleActionServer": (Makes(ACT, "{0}", "T0"),),
    "nav2::SimpleActionServer": (Makes(ACT, "{0}", "T0"),),
    "nav2_util::ServiceClient": (Makes(CLI, "{0}", "T0"),),
    "nav2::ServiceClient": (Makes(CLI, "{0}", "T0"),),
    "nav2_util::OdomSmoother": (Makes(SUB, "{1=odom}", "nav_msgs/msg/Odometry"),),
    "nav2_util::TwistPublisher": (Makes(PUB, "{0}", ""),),
    "nav2_util::TwistSubscriber": (Makes(SUB, "{0}", ""),),
    "nav2_util::LifecycleServiceClient": (
        Makes(CLI, "{0}/change_state", f"{_LIFECYCLE}/ChangeState"),
        Makes(CLI, "{0}/get_state", f"{_LIFECYCLE}/GetState"),
    ),
}
NONE = (
    "tf2_ros::CreateTimerROS", "tf2_ros::MessageFilter",
    # ros-controls/realtime_tools humble 3e85fba, jazzy 0a48300, kilted bb65bfc, master 0e0bca0: all headers
    *(f"realtime_tools::{name}" for name in (
        "RealtimePublisher", "RealtimeBuffer", "RealtimeBox", "RealtimeBoxBase", "RealtimeBoxBestEffort",
        "RealtimeThreadSafeBox", "RealtimeServerGoalHandle", "RealtimeClock", "AsyncFunctionHandler",
        "AsyncFunctionHandlerParams", "AsyncSchedulingPolicy", "LockFreeQueueBase", "LockFreeSPSCQueue",
        "LockFreeMPMCQueue", "prio_inherit_mutex", "prio_inherit_recursive_mutex")),
    # ros-perception/laser_geometry humble ba53212, rolling 7688a58; vision_opencv humble 066793a, rolling 8b42d66
    "laser_geometry::LaserProjection", "image_geometry::PinholeCameraModel", "image_geometry::StereoCameraModel",
    # ros2/message_filters humble fc93cd9, jazzy d3eecd6, rolling 361e42c: include/message_filters
    *(f"message_filters::{name}" for name in (
        "Connection", "TimeSynchronizer", "Synchronizer", "Cache", "Chain", "PassThrough", "SimpleFilter",
        "InputAligner", "MessageEvent", "NullFilter", "sync_policies::ApproximateTime",
        "sync_policies::ApproximateEpsilonTime",         "sync_policies::ExactTime", "sync_policies::LatestTime")),
    *(f"diagnostic_updater::{name}" for name in (
        "FrequencyStatus", "TimeStampStatus", "SlowTimeStampStatus", "Heartbeat", "HeaderlessTopicDiagnostic",
        "TopicDiagnostic", "DiagnosedPublisher", "FrequencyStatusParam", "TimeStampStatusParam",
        "DiagnosticStatusWrapper", "FunctionDiagnosticTask", "GenericFunctionDiagnosticTask", "CompositeDiagnosticTask",
        "DiagnosticTask",         "DiagnosticTaskVector")),
    "interactive_markers::MenuHandler", "nav2_util::NodeThread", "nav2::NodeThread", "nav2_util::ExecutionTimer",
)  # fmt: skip
"""Classes that were read and make no interface on the node that they may get."""
ROWS.update(dict.fromkeys(NONE, ()))


def texts_in(arguments: Sequence[Value], run: Machine) -> list[Value]:
    """The arguments that hold something and no node: names and the like."""
    return [value for value in arguments if value and not nodes_in(run, value)]


def owner_in(run: Machine, arguments: Sequence[Value]) -> Obj | None:
    """The first node among the arguments or in lists among them; ``None`` if they hold none."""
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


_GIVEN = re.compile(r"\{(\d)(?:=([^}]*))?\}")


def _named(name: str, texts: Sequence[Value]) -> Value:
    given = _GIVEN.search(name)
    if given is None:
        return literal(name)
    position, default = int(given[1]), given[2]
    if position < len(texts):
        value = texts[position]
    else:
        value = unknown("a name that is not given") if default is None else literal(default)
    return concatenated(literal(name[: given.start()]), value, literal(name[given.end() :]))


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


for _cls in ("rclcpp_components::ComponentManager", "rclcpp_components::ComponentManagerIsolated"):
    NODE_BASES[_cls] = LIBRARY_CLASSES[_cls] = _component_manager
