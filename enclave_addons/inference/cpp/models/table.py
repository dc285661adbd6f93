"""Well-known libraries: what each of their classes and functions makes on the node that it gets.

Each row names the file that was read. A row lists interfaces with their fixed name, or with the argument that the name
comes from (counted behind the node). Rows without interfaces were read too: those classes make none. Behind the rows
stand the classes that a row cannot say.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.values import BOTTOM, Text, Value, concatenated, literal, unknown
from enclave_addons.inference.cpp.libraries import (
    LIBRARY_CLASSES,
    LIBRARY_FUNCTIONS,
    Call,
    library_class,
    library_method,
    node_class,
    node_method,
)
from enclave_addons.inference.cpp.models.interfaces import (
    ACT,
    CALL,
    CLI,
    KINDS,
    PUB,
    SRV,
    SUB,
    add,
    named_in,
    node_of,
    owner_in,
    texts_in,
)
from enclave_addons.inference.cpp.models.nodes import become_node
from enclave_addons.inference.cpp.reading.type_names import Type
from nodl.name_template import ParameterPart
from nodl.node_interface import EndpointKind


class Makes(NamedTuple):
    """``name``: fixed, or with ``{1}``, the second argument behind the node (``{1=odom}``: where it is not given);
    ``type``: ``T0`` for the first template argument, empty where a parameter decides."""

    kind: EndpointKind
    name: str
    type: str


TF = "tf2_msgs/msg/TFMessage"
_LIFECYCLE = "lifecycle_msgs/srv"
_DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"

ROWS: dict[str, tuple[Makes, ...]] = {
    # ros2/geometry2 humble d0dbd516, jazzy 646342c6, rolling 1b005c65: tf2_ros/include/tf2_ros/transform_broadcaster.h,
    # static_transform_broadcaster.h
    "tf2_ros::TransformBroadcaster": (Makes(PUB, "/tf", TF),),
    "tf2_ros::StaticTransformBroadcaster": (Makes(PUB, "/tf_static", TF),),
    # ros/diagnostics ros2 431926f: diagnostic_updater/include/diagnostic_updater/diagnostic_updater.hpp
    "diagnostic_updater::Updater": (Makes(PUB, "/diagnostics", _DIAGNOSTICS),),
    # ros/bond_core ros2 e6d0fc2: bondcpp/src/bond.cpp
    "bond::Bond": (Makes(PUB, "{0}", "bond/msg/Status"), Makes(SUB, "{0}", "bond/msg/Status")),
    # ros2/rclcpp humble 99f1d8d12, jazzy 985e320de, rolling a0a2a067d: rclcpp/parameter_event_handler.hpp
    "rclcpp::ParameterEventHandler": (Makes(SUB, "/parameter_events", "rcl_interfaces/msg/ParameterEvent"),),
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
    # autowarefoundation/autoware_utils main a17a086: logger_level_configure.hpp, diagnostics_interface.hpp,
    # processing_time_publisher.hpp, polling_subscriber.hpp
    "autoware_utils_logging::LoggerLevelConfigure": (
        Makes(SRV, "~/config_logger", "logging_demo/srv/ConfigLogger"),
    ),
    "autoware_utils_diagnostics::DiagnosticsInterface": (Makes(PUB, "/diagnostics", _DIAGNOSTICS),),
    "autoware_utils_debug::ProcessingTimePublisher": (
        Makes(PUB, "{0=~/debug/processing_time_ms}", "diagnostic_msgs/msg/DiagnosticStatus"),
    ),
    "autoware_utils_rclcpp::InterProcessPollingSubscriber": (Makes(SUB, "{0}", "T0"),),
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
    # autowarefoundation/autoware_utils main a17a086: time_keeper.hpp; lanelet2, below namespace lanelet, knows no ROS
    "autoware_utils_debug::TimeKeeper", "autoware_utils_debug::ScopedTimeTrack",
)  # fmt: skip
"""Classes that were read and make no interface on the node that they may get."""
ROWS.update(dict.fromkeys(NONE, ()))
ROWS.update({re.sub(r"^autoware_utils_\w+::", "autoware_utils::", name): row for name, row in ROWS.items()})


def _make(row: Sequence[Makes], run: Machine, call: Call) -> None:
    """Make the interfaces of a row, on the node among the arguments."""
    owner = owner_in(call.values)
    run.later(call.values)
    if owner is None:
        if row:
            why = f"the node that {call.this.type.name} makes interfaces on is not known"
            run.gap(call.node, call.frame, why)
        return
    for each in row:
        kind = call.interface if each.type == "T0" else each.type
        alone = Call(call.node, call.frame, [], receiver=owner)
        add(run, owner, each.kind, _named(each.name, texts_in(call.values)), kind, alone)


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


LIBRARY_CLASSES.update({name: partial(_make, row) for name, row in ROWS.items()})


# --- message_filters ----------------------------------------------------------------------------------------------


@library_class("message_filters::Subscriber")
def _filter_subscriber(run: Machine, call: Call) -> None:
    """Model message_filters/subscriber.h: with a node it subscribes at once, else when ``subscribe`` is called."""
    if call.values:
        _subscribe(run, call)


@library_method("message_filters::Subscriber", "subscribe")
def _subscribe(run: Machine, call: Call) -> Value:
    texts, call = texts_in(call.values), replace(call, types=call.this.type.arguments)
    if not call.values and call.this.data.get("topic") is not None:
        return BOTTOM  # the same subscription again
    record = node_of(run, call)
    if record is not None:
        call.this.data["topic"] = True
        topic = texts[0] if texts else unknown("a topic that is not given")
        run.endpoint(record, SUB, topic, call.interface, call)
    return BOTTOM


# --- tf2_ros ------------------------------------------------------------------------------------------------------


@library_class("tf2_ros::TransformListener")
def listener(run: Machine, call: Call) -> None:
    """Model tf2_ros/src/transform_listener.cpp: without a node it makes one, ``transform_listener_impl_<address>``."""
    owner = owner_in(call.values)
    if owner is None and any(_may_be_node(value) for value in call.values[1:2]):
        run.gap(call.node, call.frame, "the node of this tf2_ros::TransformListener is not known")
        return
    if owner is None:
        owner = run.object(("own node", call.this), Type("rclcpp::Node"), heap=True)
        name = concatenated(literal("transform_listener_impl_"), unknown("an address"))
        record = become_node(run, replace(call, values=[name], receiver=owner))
        record.description, record.parameter_services = "tf2_ros::TransformListener", False
    assert owner.node is not None
    for topic in ("/tf", "/tf_static"):
        run.endpoint(owner.node, SUB, literal(topic), TF, call)


def _may_be_node(value: Value) -> bool:
    return not value or not all(isinstance(atom, bool) for atom in value)


@library_class("tf2_ros::Buffer")
def _buffer(run: Machine, call: Call) -> None:
    """Model tf2_ros/src/buffer.cpp: with a node, the service ``tf2_frames`` on it."""
    owner = owner_in(call.values)
    if owner is not None and owner.node is not None:
        run.endpoint(owner.node, SRV, literal("tf2_frames"), "tf2_msgs/srv/FrameGraph", call)


# --- nav2, where its sources are not in reach: nav2_ros_common (interface_factories.hpp, lifecycle_node.hpp,
# service_server.hpp), of the commits above -------------------------------------


def _action(kind: EndpointKind, run: Machine, call: Call) -> Value:
    return add(run, call.this, kind, call.value(0), call.interface, call)


for _word in KINDS:
    LIBRARY_FUNCTIONS[f"nav2::interfaces::create_{_word}"] = LIBRARY_FUNCTIONS[f"rclcpp::create_{_word}"]
for _word, _kind in (("server", ACT), ("client", CALL)):
    _function = LIBRARY_FUNCTIONS[f"rclcpp_action::create_{_word}"]
    LIBRARY_FUNCTIONS[f"nav2::interfaces::create_action_{_word}"] = _function
    node_method(f"create_action_{_word}")(partial(_action, _kind))


@library_class("nav2_util::ServiceServer", "nav2::ServiceServer")
def _service(run: Machine, call: Call) -> None:
    """Model (name, node, callback): with the parameter ``service_introspection_mode`` also its events."""
    record, texts = node_of(run, call), texts_in(call.values)
    if record is None:
        return
    name, kind = texts[0] if texts else unknown("a name that is not given"), call.interface
    run.endpoint(record, SRV, name, kind, call)
    for mode in ("metadata", "contents"):
        part = ParameterPart("service_introspection_mode", "disabled", None, (("only if equal", (mode,)),))
        events = concatenated(name, literal("/_service_event"), (Text((part,)),))
        run.endpoint(record, PUB, events, f"{kind}_Event" if kind else "", call)
    run.later(call.values)


@node_class("nav2_util::LifecycleNode", "nav2::LifecycleNode")
def _nav2_lifecycle(run: Machine, call: Call) -> None:
    """Model nav2_util/lifecycle_node.hpp: a lifecycle node with a bond to its manager."""
    record = become_node(run, call, lifecycle=True)
    for kind in (PUB, SUB):
        run.endpoint(record, kind, literal("bond"), "bond/msg/Status", call)


# --- rclcpp_components --------------------------------------------------------------------------------------------


@node_class("rclcpp_components::ComponentManager", "rclcpp_components::ComponentManagerIsolated")
def _component_manager(run: Machine, call: Call) -> None:
    """Model rclcpp_components/component_manager.hpp: (executor, name, options); what it loads is the launch's
    business.
    """
    names = named_in(call.values)
    record = become_node(run, replace(call, values=names[:1] or [literal("ComponentManager")]))
    for name, kind in (("load_node", "LoadNode"), ("unload_node", "UnloadNode"), ("list_nodes", "ListNodes")):
        run.endpoint(record, SRV, literal(f"~/_container/{name}"), f"composition_interfaces/srv/{kind}", call)
