"""Nodes that a library brings along: their classes create interfaces of their own, which their users never name.

Source: nav2_simple_commander/robot_navigator.py (humble to rolling; the union, since older releases have fewer).
"""

from __future__ import annotations

import re
from typing import NamedTuple

from nodl.infer.models.signatures import ACTION_CLIENT, CLIENT, PUBLISHER, SUBSCRIPTION, FixedEndpoint


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
    "tf2_geometry_msgs", "tf2_py", "launch", "launch_ros", "rclpy", "rospkg", "ros2cli", "rosbags",
    "diagnostic_updater", "message_filters", "interactive_markers",
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
    if package in _MAKES_NOTHING or not rest or "(" in path or ".exceptions." in path:
        return False
    if package in _MAKERS:
        return path.rpartition(".")[2] in _MAKERS[package]
    return package in dependencies or _ROS_NAME.search(package) is not None
