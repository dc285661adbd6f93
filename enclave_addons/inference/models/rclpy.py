"""The ROS 2 Python API as tables: which call makes which endpoint, and which argument holds what.

Sources (branches humble to rolling): rclpy ``node.py``, ``lifecycle``, ``action``, ``parameter_client.py``; tf2_ros_py;
message_filters; diagnostic_updater; interactive_markers; image_transport_py. Positions count without ``self``.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from nodl.node_interface import EndpointKind

PUBLISHER = EndpointKind.PUBLISHER
SUBSCRIPTION = EndpointKind.SUBSCRIPTION
SERVER = EndpointKind.SERVICE_SERVER
CLIENT = EndpointKind.SERVICE_CLIENT
ACTION_SERVER = EndpointKind.ACTION_SERVER
ACTION_CLIENT = EndpointKind.ACTION_CLIENT


class Argument(NamedTuple):
    """Where an argument stands: position (-1: keyword only) and keyword."""

    position: int
    keyword: str


class CallbackArgument(NamedTuple):
    """An argument that is called later, with ``arity`` arguments (``None``: any number)."""

    argument: Argument
    arity: int | None


class EndpointCall(NamedTuple):
    """A call that makes one endpoint; ``node`` is ``None`` for methods of the node itself; ``qos``: position of
    ``qos_profile``, 0 where there is none."""

    kind: EndpointKind
    type: Argument
    name: Argument
    node: Argument | None = None
    callbacks: tuple[CallbackArgument, ...] = ()
    qos: int = 0


class FixedEndpoint(NamedTuple):
    """An endpoint whose name and type are fixed by the library."""

    kind: EndpointKind
    name: str
    type: str
    unless: Argument | None = None  # not made when this argument is certainly true
    below: Argument | None = None  # what this argument gives stands before the name


class Helper(NamedTuple):
    """A class or function of a library that makes endpoints with fixed names on the node it is given."""

    node: Argument
    endpoints: tuple[FixedEndpoint, ...]
    callbacks: tuple[CallbackArgument, ...] = ()


_CALLBACK = Argument(2, "callback")
_MESSAGES = Argument(0, "msg_type"), Argument(1, "topic")

NODE_ENDPOINTS: dict[str, EndpointCall] = {
    "create_publisher": EndpointCall(PUBLISHER, *_MESSAGES, qos=2),
    "create_lifecycle_publisher": EndpointCall(PUBLISHER, *_MESSAGES, qos=2),
    "create_subscription": EndpointCall(
        SUBSCRIPTION, *_MESSAGES, callbacks=(CallbackArgument(_CALLBACK, 1),), qos=3
    ),
    "create_service": EndpointCall(
        SERVER, Argument(0, "srv_type"), Argument(1, "srv_name"), callbacks=(CallbackArgument(_CALLBACK, 2),)
    ),
    "create_client": EndpointCall(CLIENT, Argument(0, "srv_type"), Argument(1, "srv_name")),
}

_NODE = Argument(0, "node")
_ACTION_TYPE, _ACTION_NAME = Argument(1, "action_type"), Argument(2, "action_name")

# Keyed by (top package, last name): ``rclpy.action.ActionClient`` and ``rclpy.action.client.ActionClient``.
ENDPOINT_CALLS: dict[tuple[str, str], EndpointCall] = {
    ("rclpy", "ActionClient"): EndpointCall(ACTION_CLIENT, _ACTION_TYPE, _ACTION_NAME, _NODE),
    ("rclpy", "ActionServer"): EndpointCall(
        ACTION_SERVER,
        _ACTION_TYPE,
        _ACTION_NAME,
        _NODE,
        callbacks=tuple(
            CallbackArgument(Argument(position, f"{name}_callback"), 1)
            for position, name in ((3, "execute"), (-1, "goal"), (-1, "handle_accepted"), (-1, "cancel"))
        ),
    ),
    ("message_filters", "Subscriber"): EndpointCall(
        SUBSCRIPTION, Argument(1, "msg_type"), Argument(2, "topic"), node=_NODE
    ),
    ("rclpy", "wait_for_message"): EndpointCall(
        SUBSCRIPTION, Argument(0, "msg_type"), Argument(2, "topic"), node=Argument(1, "node")
    ),
}

_TF = FixedEndpoint(SUBSCRIPTION, "/tf", "tf2_msgs/msg/TFMessage", unless=Argument(-1, "static_only"))
_TF_STATIC = FixedEndpoint(SUBSCRIPTION, "/tf_static", "tf2_msgs/msg/TFMessage")

HELPERS: dict[tuple[str, str], Helper] = {
    ("tf2_ros", "TransformListener"): Helper(Argument(1, "node"), (_TF, _TF_STATIC)),
    ("tf2_ros", "TransformBroadcaster"): Helper(
        _NODE, (FixedEndpoint(PUBLISHER, "/tf", "tf2_msgs/msg/TFMessage"),)
    ),
    ("tf2_ros", "StaticTransformBroadcaster"): Helper(
        _NODE, (FixedEndpoint(PUBLISHER, "/tf_static", "tf2_msgs/msg/TFMessage"),)
    ),
    ("tf2_ros", "Buffer"): Helper(
        Argument(1, "node"), (FixedEndpoint(SERVER, "tf2_frames", "tf2_msgs/srv/FrameGraph"),)
    ),
    ("diagnostic_updater", "Updater"): Helper(
        _NODE, (FixedEndpoint(PUBLISHER, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"),)
    ),
    ("interactive_markers", "InteractiveMarkerServer"): Helper(
        _NODE,
        tuple(
            FixedEndpoint(kind, name, f"visualization_msgs/{type_name}", below=Argument(1, "namespace"))
            for kind, name, type_name in (
                (SERVER, "/get_interactive_markers", "srv/GetInteractiveMarkers"),
                (PUBLISHER, "/update", "msg/InteractiveMarkerUpdate"),
                (SUBSCRIPTION, "/feedback", "msg/InteractiveMarkerFeedback"),
            )
        ),
    ),
    ("rclpy", "ParameterEventHandler"): Helper(
        _NODE, (FixedEndpoint(SUBSCRIPTION, "/parameter_events", "rcl_interfaces/msg/ParameterEvent"),)
    ),
}

# Node methods that only take callbacks.
NODE_CALLBACKS: dict[str, CallbackArgument] = {
    "create_timer": CallbackArgument(Argument(1, "callback"), 0),
    "create_guard_condition": CallbackArgument(Argument(0, "callback"), 0),
    **{
        f"{before}set_parameters_callback": CallbackArgument(Argument(0, "callback"), 1)
        for before in ("add_on_", "add_pre_", "add_post_", "")
    },
    "add_waitable": CallbackArgument(Argument(0, "waitable"), None),
}

# Methods of objects whose class is not known that take a callback.
COMMON_CALLBACKS: dict[str, CallbackArgument] = {
    "add_done_callback": CallbackArgument(Argument(0, "callback"), 1),
    "send_goal_async": CallbackArgument(Argument(1, "feedback_callback"), 1),
}

# Transitions that a lifecycle node's class overrides (rclpy/lifecycle/node.py).
LIFECYCLE_HOOKS = frozenset(
    {"on_configure", "on_activate", "on_deactivate", "on_cleanup", "on_shutdown", "on_error"}
)


class LibraryNode(NamedTuple):
    """A node class of a library. ``name``: what the node is called unless its user says otherwise."""

    name: str
    endpoints: tuple[FixedEndpoint, ...]


_ACTIONS = {
    "navigate_through_poses": "NavigateThroughPoses",
    "navigate_to_pose": "NavigateToPose",
    "follow_waypoints": "FollowWaypoints",
    "follow_gps_waypoints": "FollowGPSWaypoints",
    "follow_path": "FollowPath",
    "compute_path_to_pose": "ComputePathToPose",
    "compute_path_through_poses": "ComputePathThroughPoses",
    "smooth_path": "SmoothPath",
    "compute_route": "ComputeRoute",
    "compute_and_track_route": "ComputeAndTrackRoute",
    "spin": "Spin",
    "backup": "BackUp",
    "drive_on_heading": "DriveOnHeading",
    "assisted_teleop": "AssistedTeleop",
    "dock_robot": "DockRobot",
    "undock_robot": "UndockRobot",
    "follow_object": "FollowObject",
}
_SERVICES = {
    "map_server/load_map": "LoadMap",
    "global_costmap/clear_entirely_global_costmap": "ClearEntireCostmap",
    "local_costmap/clear_entirely_local_costmap": "ClearEntireCostmap",
    "local_costmap/clear_costmap_except_region": "ClearCostmapExceptRegion",
    "local_costmap/clear_costmap_around_robot": "ClearCostmapAroundRobot",
    "local_costmap/clear_costmap_around_pose": "ClearCostmapAroundPose",
    "global_costmap/clear_costmap_around_pose": "ClearCostmapAroundPose",
    "global_costmap/get_costmap": "GetCostmap",
    "local_costmap/get_costmap": "GetCostmap",
    "collision_monitor/toggle": "Toggle",
}
# Absolute in some releases, relative in others.
_ABSOLUTE_ONCE = tuple(name for name in _SERVICES if name.startswith(("map_server", "global_", "local_")))
_POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"

_NAVIGATOR = LibraryNode(
    "basic_navigator",
    (
        *(FixedEndpoint(ACTION_CLIENT, name, f"nav2_msgs/action/{kind}") for name, kind in _ACTIONS.items()),
        *(FixedEndpoint(CLIENT, name, f"nav2_msgs/srv/{kind}") for name, kind in _SERVICES.items()),
        *(FixedEndpoint(CLIENT, f"/{name}", f"nav2_msgs/srv/{_SERVICES[name]}") for name in _ABSOLUTE_ONCE),
        FixedEndpoint(SUBSCRIPTION, "amcl_pose", _POSE),
        FixedEndpoint(PUBLISHER, "initialpose", _POSE),
    ),
)

LIBRARY_NODES: dict[tuple[str, str], LibraryNode] = {("nav2_simple_commander", "BasicNavigator"): _NAVIGATOR}


def library_node(path: str) -> LibraryNode | None:
    """Return the node class at ``path``, by its top package and last name."""
    return LIBRARY_NODES.get((path.partition(".")[0], path.rpartition(".")[2]))


# ROS packages whose Python makes no node and no interface.
_MAKES_NOTHING = frozenset({
    "ros2_numpy", "tf_transformations", "sensor_msgs_py", "image_geometry", "cv_bridge", "rclpy_message_converter",
    "ament_index_python", "ament_copyright", "ament_flake8", "ament_pep257", "rosidl_runtime_py", "rosidl_parser",
    "tf2_geometry_msgs", "tf2_sensor_msgs", "tf2_py", "launch", "launch_ros", "rclpy", "rospkg", "ros2cli", "rosbags",
    "diagnostic_updater", "message_filters", "interactive_markers", "tf2_kdl", "PyKDL",
    "generate_parameter_library_py", "python_qt_binding",
})  # fmt: skip
# Libraries that know nothing of ROS, under names that package.xml lists too.
_NOT_OF_ROS = frozenset({
    "pinocchio", "hppfcl", "coal", "eigenpy", "crocoddyl", "example_robot_data", "casadi", "mujoco", "pybullet",
    "numpy", "scipy", "sympy", "matplotlib", "pandas", "networkx", "shapely", "transforms3d", "pyquaternion",
    "numba", "torch", "torchvision", "ultralytics", "mediapipe", "tensorflow", "onnxruntime", "open3d",
    "trimesh", "depthai", "pyrealsense2", "serial", "smbus", "smbus2", "gpiozero", "spidev", "can", "evdev",
    "pynput", "pygame", "pymavlink", "mavsdk", "pyproj", "utm", "pynmea2", "psutil", "requests", "websockets",
    "zmq", "flask", "jinja2", "yaml", "lxml", "simple_pid", "filterpy", "cvxpy", "osqp", "gtsam",
})  # fmt: skip
_MAKERS = {
    "rosbag2_py": frozenset({"Recorder", "Player"}),
    "tf2_ros": frozenset({"BufferClient"}),
}  # of a package that else makes nothing
_ROS_NAME = re.compile(
    r"(?:^|_)(?:ros\d?|ros2\w*|rcl\w*|nav2|moveit\w*|turtlebot\w*|tf2|rosbag\w*|rosbridge|rqt|irobot|controller_manager|"
    r"ament|launch|clearpath|webots_ros2|nao|spot_utilities)(?:_|$)"
)


def may_make_nodes(path: str, dependencies: frozenset[str]) -> bool:
    """Return True if the class or function at ``path`` is of a ROS package of which nothing is known here.

    ``dependencies``: what the program's package names in its ``package.xml``.
    """
    package, _, rest = path.partition(".")
    if package in _MAKES_NOTHING | _NOT_OF_ROS or not rest or "(" in path or ".exceptions." in path:
        return False
    if package in _MAKERS:
        return path.rpartition(".")[2] in _MAKERS[package]
    return package in dependencies or _ROS_NAME.search(package) is not None
