"""Well-known libraries: what each of their classes and functions makes on the node that it gets.

Each row names the file that was read. A row lists interfaces with their fixed name, or with the argument that the name
comes from (counted behind the node). Rows without interfaces were read too: those classes make none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from nodl.infer.cpp.findings import NodeRecord
from nodl.infer.cpp.libraries import (
    LIBRARY_CLASSES,
    LIBRARY_METHODS,
    NODE_BASES,
    Call,
    library_class,
    library_function,
)
from nodl.infer.cpp.machine import Frame, Machine
from nodl.infer.cpp.models.interfaces import add
from nodl.infer.cpp.models.nodes import become_node
from nodl.infer.cpp.names import NO_TYPE, Type, ros_type
from nodl.infer.cpp.objects import nodes_in
from nodl.infer.cpp.values import (
    BOTTOM,
    NodePart,
    Obj,
    Param,
    Text,
    Value,
    concatenated,
    literal,
    truth,
    unknown,
)
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


_TF = "tf2_msgs/msg/TFMessage"
_IMAGE, _INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"

ROWS: dict[str, tuple[Makes, ...]] = {
    # tf2_ros/src/transform_broadcaster.cpp, static_transform_broadcaster.h, buffer_server.h, buffer_client.h
    "tf2_ros::TransformBroadcaster": (Makes(PUB, "/tf", _TF),),
    "tf2_ros::StaticTransformBroadcaster": (Makes(PUB, "/tf_static", _TF),),
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
    "robot_localization::RosRobotLocalizationListener": (
        Makes(SUB, "odom/filtered", "nav_msgs/msg/Odometry"),
        Makes(SUB, "accel/filtered", "geometry_msgs/msg/AccelWithCovarianceStamped"),
    ),
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
    "image_transport::TransportHints": (),
}


def _texts(arguments: Sequence[Value], run: Machine) -> list[Value]:
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
    texts = _texts(arguments, run)
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


def _own_node(run: Machine, this: Obj, name: Value, node: Node, frame: Frame, description: str) -> Obj:
    """A node that a library makes for itself."""
    made = run.obj(("own node", this), Type("rclcpp::Node"), heap=True)
    become_node(run, made, [name], node, frame, lifecycle=False)
    assert made.node is not None
    made.node.description = description
    return made


# --- tf2_ros ----------------------------------------------------------------------------------------------------


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
        run.endpoint(owner.node, SUB, literal(topic), _TF, node, frame)
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
    run.endpoint(owner.node, SUB, literal("/tf_static"), _TF, node, frame)
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


# --- message_filters and image_transport --------------------------------------------------------------------------


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
    texts = _texts(arguments, run)
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


def _transported(base: Value, plugin: str) -> Value:
    return concatenated(base, literal(f"/{plugin}"))


# image_transport_plugins: the transports that ros-<distro>-image-transport-plugins brings, with their types.
_TRANSPORTS = {
    "compressed": "sensor_msgs/msg/CompressedImage",
    "compressedDepth": "sensor_msgs/msg/CompressedImage",
    "theora": "theora_image_transport/msg/Packet",
    "zstd": "sensor_msgs/msg/CompressedImage",
    "ffmpeg": "ffmpeg_image_transport_msgs/msg/FFMPEGPacket",
}


def _image_publisher(run: Machine, owner: Obj, base: Value, node: Node, frame: Frame) -> None:
    """image_transport/src/publisher.cpp: one publisher for each transport plugin that is installed."""
    assert owner.node is not None
    run.endpoint(owner.node, PUB, base, _IMAGE, node, frame)
    for plugin, kind in list(_TRANSPORTS.items())[:3]:
        run.endpoint(owner.node, PUB, _transported(base, plugin), kind, node, frame)


def _info_topic(base: Value) -> Value:
    """image_transport/src/camera_common.cpp, getCameraInfoTopic: the last part of the name replaced."""
    found: list[object] = []
    for atom in base:
        if (
            isinstance(atom, Text)
            and atom.parts
            and isinstance(atom.parts[-1], str)
            and "/" in atom.parts[-1]
        ):
            head = atom.parts[-1].rpartition("/")[0]
            found += concatenated((Text((*atom.parts[:-1], head + "/")),), literal("camera_info"))
        elif isinstance(atom, Text) and all(isinstance(part, str) for part in atom.parts):
            found += literal("camera_info")
        else:
            found += unknown("the camera_info beside a topic that is not known")
    return tuple(found)


def _image(run: Machine, call: Call, what: str) -> Value:
    owner = owner_in(run, call.values) or (
        call.receiver if call.receiver is not None and call.receiver.node else None
    )
    held = call.receiver.data.get("owner") if call.receiver is not None else None
    owner = owner or held
    texts = _texts(call.values, run)
    if owner is None or owner.node is None:
        run.gap(call.node, call.frame, f"the node that image_transport makes a {what} on is not known")
        return unknown("an image interface")
    base = texts[0] if texts else unknown("a topic that is not given")
    for value in call.values:
        for atom in value:
            run.later(atom, call.frame)
    if what in ("publisher", "camera publisher"):
        _image_publisher(run, owner, base, call.node, call.frame)
    else:
        _image_subscriber(run, owner, base, call, texts)
    if what.startswith("camera"):
        kind = PUB if what.endswith("publisher") else SUB
        run.endpoint(owner.node, kind, _info_topic(base), _INFO, call.node, call.frame)
    made = run.obj(
        ("image", call.frame.file.file, call.node.start_byte, call.frame.path),
        Type(f"image_transport::{what}"),
        heap=True,
    )
    return (made,)


def _image_subscriber(run: Machine, owner: Obj, base: Value, call: Call, texts: Sequence[Value]) -> None:
    """image_transport/src/subscriber.cpp: the transport is the argument behind the callback, a hint, or ``raw``."""
    assert owner.node is not None
    transports = (
        texts[-1]
        if len(texts) > 1 and any(isinstance(a, Text | Param) for a in texts[-1])
        else literal("raw")
    )
    if call.receiver is not None and len(texts) <= 1:
        transports = literal("raw")
    for atom in transports:
        if isinstance(atom, Text) and atom.parts == ("raw",):
            run.endpoint(owner.node, SUB, base, _IMAGE, call.node, call.frame)
            continue
        run.endpoint(owner.node, SUB, base, _IMAGE, call.node, call.frame)
        run.gap(
            call.node,
            call.frame,
            f"the transport of this image subscription is chosen at run time ({_shown(atom)}); "
            "its topic is BASE for raw, BASE/TRANSPORT else",
            owner.node,
        )


def _shown(atom: object) -> str:
    return f"parameter {atom.name}" if isinstance(atom, Param) else "not known"


for _function, _what in (
    ("create_publisher", "publisher"),
    ("create_subscription", "subscription"),
    ("create_camera_publisher", "camera publisher"),
    ("create_camera_subscription", "camera subscription"),
):
    library_function(f"image_transport::{_function}")(lambda run, call, what=_what: _image(run, call, what))  # type: ignore[misc]


@library_class("image_transport::ImageTransport")
def _image_transport(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    this.data["owner"] = owner_in(run, arguments)
    if this.data["owner"] is None:
        run.gap(node, frame, "the node of this image_transport::ImageTransport is not known")
    return None


for _method, _what in (
    ("advertise", "publisher"),
    ("advertiseCamera", "camera publisher"),
    ("subscribe", "subscription"),
    ("subscribeCamera", "camera subscription"),
):
    LIBRARY_METHODS[("image_transport::ImageTransport", _method)] = lambda run, call, what=_what: _image(
        run, call, what
    )  # type: ignore[misc]


@library_class("image_transport::SubscriberFilter")
def _subscriber_filter(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    """image_transport/subscriber_filter.hpp: (node, topic, transport)."""
    if arguments:
        _image(run, Call(node, frame, arguments, []), "subscription")
    return None


def _filter(run: Machine, call: Call) -> Value:
    return _image(run, Call(call.node, call.frame, call.values, []), "subscription")


LIBRARY_METHODS[("image_transport::SubscriberFilter", "subscribe")] = _filter


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

__all__ = ["NO_TYPE", "NodePart", "NodeRecord", "truth"]
