"""A behavior tree of Nav2 (XML of BehaviorTree.CPP): the actions, services and topics that its nodes use.

Source: ros-navigation/navigation2 jazzy, nav2_behavior_tree/plugins: the names that the nodes register with, and the
ports ``server_name``, ``service_name`` and ``topic_name`` by which the tree changes them. A node that is not in the
tables is a gap unless it belongs to BehaviorTree.CPP itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from enclave_addons.library.configuration.configured import Configured, collected, endpoint_named
from enclave_common.files import read_bytes
from enclave_common.source_location import SourceLocation
from enclave_common.terminal import quoted
from enclave_common.xml_tree import XmlElement
from nodl.builtin_interfaces import DISTROS
from nodl.dependence import Situation
from nodl.errors import InvalidXMLError
from nodl.node_interface import Endpoint, EndpointKind, Gap
from nodl.xml_text import parse_xml

_MAX_BYTES = 1_000_000

# Tag -> action and its type; the port ``server_name`` changes the name.
_ACTIONS = {
    "AssistedTeleop": ("assisted_teleop", "AssistedTeleop"),
    "BackUp": ("backup", "BackUp"),
    "ComputeAndTrackRoute": ("compute_and_track_route", "ComputeAndTrackRoute"),
    "ComputePathThroughPoses": ("compute_path_through_poses", "ComputePathThroughPoses"),
    "ComputePathToPose": ("compute_path_to_pose", "ComputePathToPose"),
    "ComputeRoute": ("compute_route", "ComputeRoute"),
    "DriveOnHeading": ("drive_on_heading", "DriveOnHeading"),
    "FollowPath": ("follow_path", "FollowPath"),
    "NavigateThroughPoses": ("navigate_through_poses", "NavigateThroughPoses"),
    "NavigateToPose": ("navigate_to_pose", "NavigateToPose"),
    "SmoothPath": ("smooth_path", "SmoothPath"),
    "Spin": ("spin", "Spin"),
    "Wait": ("wait", "Wait"),
}
_CANCELS = {
    "CancelAssistedTeleop": "AssistedTeleop",
    "CancelBackUp": "BackUp",
    "CancelComputeAndTrackRoute": "ComputeAndTrackRoute",
    "CancelControl": "FollowPath",
    "CancelDriveOnHeading": "DriveOnHeading",
    "CancelSpin": "Spin",
    "CancelWait": "Wait",
}
# Tag -> type; the port ``service_name`` names it.
_SERVICES = {
    "ClearCostmapAroundPose": "nav2_msgs/srv/ClearCostmapAroundPose",
    "ClearCostmapAroundRobot": "nav2_msgs/srv/ClearCostmapAroundRobot",
    "ClearCostmapExceptRegion": "nav2_msgs/srv/ClearCostmapExceptRegion",
    "ClearEntireCostmap": "nav2_msgs/srv/ClearEntireCostmap",
    "ReinitializeGlobalLocalization": "std_srvs/srv/Empty",
}
# Tag -> port, default and type.
_TOPICS = {
    "ControllerSelector": ("topic_name", "controller_selector", "std_msgs/msg/String"),
    "GoalCheckerSelector": ("topic_name", "goal_checker_selector", "std_msgs/msg/String"),
    "PlannerSelector": ("topic_name", "planner_selector", "std_msgs/msg/String"),
    "ProgressCheckerSelector": ("topic_name", "progress_checker_selector", "std_msgs/msg/String"),
    "SmootherSelector": ("topic_name", "smoother_selector", "std_msgs/msg/String"),
    "IsBatteryCharging": ("battery_topic", "/battery_status", "sensor_msgs/msg/BatteryState"),
    "IsBatteryLow": ("battery_topic", "/battery_status", "sensor_msgs/msg/BatteryState"),
    "IsStuck": ("", "odom", "nav_msgs/msg/Odometry"),
}
_PATH_VALID = "IsPathValid"
_ONE_GOAL = DISTROS[: DISTROS.index("kilted")]
_OF_NAV2 = """
AreErrorCodesPresent ArePosesNear ConcatenatePaths DistanceController DistanceTraveled GetCurrentPose
GetPoseFromPath GlobalUpdatedGoal GoalReached GoalUpdated GoalUpdatedController InitialPoseReceived
PathExpiringTimer PathLongerOnApproach PipelineSequence RateController RecoveryNode RemovePassedGoals
RoundRobin SingleTrigger SpeedController TimeExpired TransformAvailable TruncatePath TruncatePathLocal
WouldAControllerRecoveryHelp WouldAPlannerRecoveryHelp WouldASmootherRecoveryHelp
"""
_OF_BEHAVIOR_TREE_CPP = """
root BehaviorTree TreeNodesModel include SubTree SubTreePlus Sequence SequenceStar ReactiveSequence Fallback
ReactiveFallback Parallel ParallelAll IfThenElse WhileDoElse Switch2 Switch3 Switch4 Switch5 Switch6
Inverter RetryUntilSuccessful RetryUntilSuccesful Repeat Timeout Delay ForceSuccess ForceFailure RunOnce
AlwaysSuccess AlwaysFailure KeepRunningUntilFailure SetBlackboard UnsetBlackboard Script ScriptCondition
Precondition SequenceWithMemory AsyncSequence AsyncFallback Sleep
"""
_SILENT = frozenset((*_OF_NAV2.split(), *_OF_BEHAVIOR_TREE_CPP.split()))
# What Nav2's own trees use, which a machine without Nav2 has not; the same in humble, jazzy and kilted but for the
# selectors. Source: nav2_bt_navigator/behavior_trees of humble 3c3db59d6, jazzy f4108e5b1, kilted 71a1d84f4.
_TO_POSE = "<ComputePathToPose/><FollowPath/>"
_RECOVERIES = """<BackUp/><Spin/><Wait/>
<ClearEntireCostmap service_name="global_costmap/clear_entirely_global_costmap"/>
<ClearEntireCostmap service_name="local_costmap/clear_entirely_local_costmap"/>"""
_TREES_OF_NAV2 = {
    "follow_point.xml": f"{_TO_POSE}<GoalUpdater/>",
    "nav_to_pose_with_consistent_replanning_and_if_path_becomes_invalid.xml": (
        f"{_TO_POSE}{_RECOVERIES}<IsPathValid/>"
    ),
    "navigate_through_poses_w_replanning_and_recovery.xml": (
        f"<ComputePathThroughPoses/><FollowPath/>{_RECOVERIES}"
    ),
    "navigate_to_pose_w_replanning_and_recovery.xml": f"{_TO_POSE}{_RECOVERIES}",
    "navigate_to_pose_w_replanning_goal_patience_and_recovery.xml": f"{_TO_POSE}{_RECOVERIES}",
    "navigate_w_recovery_and_replanning_only_if_path_becomes_invalid.xml": (
        f"{_TO_POSE}{_RECOVERIES}<IsPathValid/>"
    ),
    "navigate_w_replanning_distance.xml": _TO_POSE,
    "navigate_w_replanning_only_if_goal_is_updated.xml": _TO_POSE,
    "navigate_w_replanning_only_if_path_becomes_invalid.xml": f"{_TO_POSE}<IsPathValid/>",
    "navigate_w_replanning_speed.xml": _TO_POSE,
    "navigate_w_replanning_time.xml": _TO_POSE,
}
_SELECTORS = {
    "humble": "",
    "jazzy": "<ControllerSelector/><PlannerSelector/>",
    "kilted": "<ControllerSelector/><PlannerSelector/>",
}
_ALSO_IN_KILTED = {
    "navigate_through_poses_w_replanning_and_recovery.xml": "<GoalCheckerSelector/><ProgressCheckerSelector/>",
}
_MODELS = ("Action", "Condition", "Decorator", "Control")  # elements whose attribute ID is the node


def of_tree(file: str, situation: Situation) -> Configured:
    """Return what the tree in ``file`` uses in ``situation``, that of its navigator."""
    place = SourceLocation(file)
    try:
        root = parse_xml(_of_nav2(file, situation.distro) or read_bytes(file, _MAX_BYTES), file)
    except (OSError, InvalidXMLError) as error:
        return Configured(gaps=(Gap(place, f"the behavior tree cannot be read: {error}"),))
    return collected(_used(root, place, situation))


def _of_nav2(file: str, distro: str) -> str:
    """Return what Nav2's own tree of that name uses if this machine lacks it; empty for any other file."""
    path = Path(file)
    tree = _TREES_OF_NAV2.get(path.name)
    installed = path.parts[-4:-1] == ("share", "nav2_bt_navigator", "behavior_trees")
    if tree is None or not installed or distro not in _SELECTORS or path.exists():
        return ""
    later = _ALSO_IN_KILTED.get(path.name, "") if distro == "kilted" else ""
    return f"<root>{tree}{_SELECTORS[distro]}{later}</root>"


def _used(root: XmlElement, place: SourceLocation, situation: Situation) -> Iterator[Endpoint | Gap]:
    models = {part for model in root.iter("TreeNodesModel") for part in model.iter()}
    for element in root.iter():
        if element not in models:
            yield from _of_node(element, place, situation)


def _of_node(element: XmlElement, place: SourceLocation, situation: Situation) -> Iterator[Endpoint | Gap]:
    tag = element.get("ID", element.tag) if element.tag in _MODELS else element.tag
    if tag in _ACTIONS or tag in _CANCELS:
        name, type_name = _ACTIONS[_CANCELS.get(tag, tag)]
        chosen = element.get("server_name") or name
        yield _named(EndpointKind.ACTION_CLIENT, chosen, f"nav2_msgs/action/{type_name}", tag, place)
    elif tag in _SERVICES:
        yield _named(EndpointKind.SERVICE_CLIENT, element.get("service_name"), _SERVICES[tag], tag, place)
    elif tag in _TOPICS:
        port, default, type_name = _TOPICS[tag]
        yield _named(EndpointKind.SUBSCRIPTION, element.get(port) or default, type_name, tag, place)
    elif tag == _PATH_VALID:
        yield _named(EndpointKind.SERVICE_CLIENT, "is_path_valid", "nav2_msgs/srv/IsPathValid", tag, place)
    elif tag == "GoalUpdater":  # reads parameters, which the navigator hands to its trees
        goal = str(situation.parameters.get("goal_updater_topic", "goal_update"))
        yield _named(EndpointKind.SUBSCRIPTION, goal, "geometry_msgs/msg/PoseStamped", tag, place)
        if situation.distro not in _ONE_GOAL:
            goals = str(situation.parameters.get("goals_updater_topic", "goals_update"))
            yield _named(EndpointKind.SUBSCRIPTION, goals, "nav_msgs/msg/Goals", tag, place)
    elif tag not in _SILENT:
        yield Gap(place, f"what the node {quoted(tag)} of the behavior tree uses is not known")


def _named(kind: EndpointKind, name: str, type_name: str, tag: str, place: SourceLocation) -> Endpoint | Gap:
    return endpoint_named(kind, name, type_name, place, f"{tag} of the behavior tree", about=f"{tag}: ")
