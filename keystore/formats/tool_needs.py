"""What each ROS tool needs to work on a secured robot: the one table of it. Pure; docs/running-systems.md shows it.

The last five are known from their sources. The others were recorded and tried on real ROS 2 jazzy: a ``ros2`` command
is a node ``/_ros2cli_<pid>`` that publishes ``/rosout`` and ``/parameter_events`` and serves ``get_type_description``
below its own name (the pid is in it, so a wildcard stands there); ``service call`` and ``action send_goal`` make a node
named after the interface's type, which serves parameters, too; ``param``, even ``get``, is a client of all six
parameter services of its target. ``ros_discovery_info`` is granted to all, and must not be published only by
``observe``, which is not an rmw.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError
from keystore.formats.compact import PARAMETER_SERVICES
from keystore.formats.permissions_names import full_name
from keystore.formats.permissions_patterns import has_wildcard
from keystore.formats.policy import EnclavePolicy, Operation, Profile, Qualifier, Rule

FOLDER = "/tools"
"""All enclaves of tools are below it: a person finds them, and no robot's enclave is overwritten."""

Need = tuple[Operation, str]


class ToolTarget(Enum):
    """Kind of subject of a tool. The value is the word in messages."""

    NOTHING = ""
    TOPIC = "TOPIC"
    SERVICE = "SERVICE"
    ACTION = "ACTION"
    NODE = "NODE"


class Tool(NamedTuple):
    """A ROS tool and its permissions. ``node``: the name of the tool's own node, empty where it is none. ``own``: what
    it needs whatever its target, ``each``: for each target, which stands for ``{}``. ``example``: a command line
    that works with it, of the first or of all targets."""

    name: str
    what: str
    target: ToolTarget
    node: str
    own: tuple[Need, ...]
    each: tuple[Need, ...]
    example: str
    optional_target: bool = False


_P, _S, _R, _Q, _C = (
    Operation.PUBLISH,
    Operation.SUBSCRIBE,
    Operation.REPLY,
    Operation.REQUEST,
    Operation.CALL,
)
_LIFECYCLE_SERVICES = (
    "change_state",
    "get_state",
    "get_available_states",
    "get_available_transitions",
    "get_transition_graph",
)
_CONTAINER_SERVICES = ("_container/load_node", "_container/unload_node", "_container/list_nodes")
_RECORDER_SERVICES = ("is_paused", "pause", "resume", "record", "stop", "snapshot", "split_bagfile")
_PLAYER_SERVICES = (
    *("burst", "get_rate", "is_paused", "pause", "play", "play_next"),
    *("resume", "seek", "set_rate", "stop", "toggle_paused"),
)
_RVIZ_TOOLS = ("/clicked_point", "/goal_pose", "/initialpose")

_CLI_NODE = "/_ros2cli_*"
_CALLER = "/_ros2cli_requester_*"  # and the type: ros2service call.py
_GOAL_SENDER = "/_ros2cli_send_goal_*"  # and the type: ros2action send_goal.py
_ANY_NODE: tuple[Need, ...] = ((_P, "/rosout"), (_P, "/parameter_events"), (_R, "~/get_type_description"))
_RCLPY_NODE: tuple[Need, ...] = (*_ANY_NODE, *((_R, f"~/{name}") for name in PARAMETER_SERVICES))
_RCLCPP_NODE: tuple[Need, ...] = (*_RCLPY_NODE, (_S, "/parameter_events"))
_RECORDER: tuple[Need, ...] = (  # recorder.cpp: start_parameter_event_publisher(false)
    *(need for need in _RCLCPP_NODE if need != (_P, "/parameter_events")),
    *((_R, f"~/{name}") for name in _RECORDER_SERVICES),
    (_P, "/events/write_split"),
)
_PLAYER: tuple[Need, ...] = (
    *_RCLCPP_NODE,
    *((_R, f"~/{name}") for name in _PLAYER_SERVICES),
    (_P, "/events/read_split"),
)
_TF_LISTENER: tuple[Need, ...] = (
    (_S, "/tf"),
    (_S, "/tf_static"),
    (_R, "/transform_listener_impl_*/get_type_description"),
)
_RVIZ: tuple[Need, ...] = (*_RCLCPP_NODE, *_TF_LISTENER, (_R, "~/reset_time"))
_ROSBRIDGE: tuple[Need, ...] = (*_RCLPY_NODE, (_P, "/client_count"), (_P, "/connected_clients"))


_FOXGLOVE_MANAGER = (
    "/foxglove_bridge_component_manager"  # foxglove_bridge main.cpp, with a node named dummy beside it
)
_FOXGLOVE: tuple[Need, ...] = (
    *_RCLCPP_NODE,
    *((operation, name.replace("~", "/dummy", 1)) for operation, name in _RCLCPP_NODE),
    (_R, f"{_FOXGLOVE_MANAGER}/get_type_description"),
    *((_R, f"{_FOXGLOVE_MANAGER}/{name}") for name in _CONTAINER_SERVICES),
)


def _below(operation: Operation, names: tuple[str, ...]) -> tuple[Need, ...]:
    return tuple((operation, f"{{}}/{name}") for name in names)


TABLE: tuple[Tool, ...] = (
    Tool("observe", "secure-nodl observe, secure-plan drift: discovery is read, nothing else", ToolTarget.NOTHING, "",
         (), (), "secure-nodl observe --keystore {keystore} --enclave {enclave}"),
    Tool("list", "ros2 node list|info, topic list|info, service list, action list", ToolTarget.NOTHING, _CLI_NODE,
         _ANY_NODE, (), "ros2 node list --no-daemon"),
    Tool("daemon", "the ROS daemon, which answers the commands of list", ToolTarget.NOTHING, _CLI_NODE, _ANY_NODE, (),
         "ros2 daemon start"),
    Tool("echo", "ros2 topic echo, hz, bw, delay", ToolTarget.TOPIC, _CLI_NODE, _ANY_NODE, ((_S, "{}"),),
         "ros2 topic echo --no-daemon {target}"),
    Tool("pub", "ros2 topic pub", ToolTarget.TOPIC, _CLI_NODE, _ANY_NODE, ((_P, "{}"),),
         "ros2 topic pub --once {target} TYPE VALUES"),
    Tool("param", "ros2 param list, get, set, describe, dump", ToolTarget.NODE, _CLI_NODE, _ANY_NODE,
         _below(_Q, PARAMETER_SERVICES), "ros2 param list --no-daemon {target}"),
    Tool("call", "ros2 service call", ToolTarget.SERVICE, _CALLER, _RCLPY_NODE, ((_Q, "{}"),),
         "ros2 service call {target} TYPE VALUES"),
    Tool("action", "ros2 action send_goal", ToolTarget.ACTION, _GOAL_SENDER, _RCLPY_NODE, ((_C, "{}"),),
         "ros2 action send_goal {target} TYPE GOAL"),
    Tool("lifecycle", "ros2 lifecycle get, set, list", ToolTarget.NODE, _CLI_NODE, _ANY_NODE,
         _below(_Q, _LIFECYCLE_SERVICES), "ros2 lifecycle get --no-daemon {target}"),
    Tool("component", "ros2 component list, load, unload", ToolTarget.NODE, _CLI_NODE, _ANY_NODE,
         _below(_Q, _CONTAINER_SERVICES), "ros2 component list --no-daemon {target}"),
    Tool("record", "ros2 bag record", ToolTarget.TOPIC, "/rosbag2_recorder", _RECORDER, ((_S, "{}"),),
         "ros2 bag record {targets}"),
    Tool("play", "ros2 bag play: it moves the robot as the topics do", ToolTarget.TOPIC, "/rosbag2_player", _PLAYER,
         ((_P, "{}"),), "ros2 bag play BAG --topics {targets}"),
    Tool("rviz", "rviz2 that shows topics, without tools that publish", ToolTarget.TOPIC, "/rviz", _RVIZ, ((_S, "{}"),),
         "rviz2 -d CONFIG", True),
    Tool("rviz-control", "rviz2 with its tools for goals, poses and points: it can move the robot", ToolTarget.TOPIC,
         "/rviz", (*_RVIZ, *((_P, name) for name in _RVIZ_TOOLS)), ((_S, "{}"),), "rviz2 -d CONFIG", True),
    Tool("rqt-graph", "rqt_graph", ToolTarget.NOTHING, "/rqt_gui_py_node_*", _RCLPY_NODE, (),
         "ros2 run rqt_graph rqt_graph"),
    Tool("teleop", "teleop_twist_keyboard: it moves the robot", ToolTarget.TOPIC, "/teleop_twist_keyboard", _RCLPY_NODE,
         ((_P, "{}"),), "ros2 run teleop_twist_keyboard teleop_twist_keyboard --ros-args -r cmd_vel:={target}"),
    Tool("plotjuggler", "PlotJuggler that shows topics", ToolTarget.TOPIC, "/plotjuggler", _RCLCPP_NODE, ((_S, "{}"),),
         "ros2 run plotjuggler plotjuggler"),
    Tool("foxglove", "foxglove_bridge that shows topics; who reaches its port sees them", ToolTarget.TOPIC,
         "/foxglove_bridge", _FOXGLOVE, ((_S, "{}"),),
         "ros2 run foxglove_bridge foxglove_bridge --ros-args -p 'capabilities:=[connectionGraph]'"),
    Tool("rosbridge", "rosbridge_websocket that shows topics; who reaches its port sees them", ToolTarget.TOPIC,
         "/rosbridge_websocket", _ROSBRIDGE, ((_S, "{}"),), "ros2 run rosbridge_server rosbridge_websocket"),
)  # fmt: skip
TOOLS = {tool.name: tool for tool in TABLE}


def is_tool_enclave(enclave: str) -> bool:
    """Returns whether an enclave is a tool's: short-lived, and renewed only by name."""
    return enclave.startswith(f"{FOLDER}/")


def tool_enclave_name(tool: Tool, targets: tuple[str, ...]) -> str:
    """Name the tool's enclave: ``/tools/echo/front/scan``; of several targets the first, and how many more."""
    rest = f"_and_{len(targets) - 1}_more" if len(targets) > 1 else ""
    kind = tool.name.replace("-", "_")
    return f"{FOLDER}/{kind}{targets[0] if targets else ''}{rest}"


def tool_targets(tool: Tool, words: tuple[str, ...]) -> tuple[str, ...]:
    """Return absolute names of what the tool works on. Raises ``InvalidInputError`` or ``PolicyError``."""
    if tool.target is ToolTarget.NOTHING and words:
        raise InvalidInputError(f"--for {tool.name} works on the whole graph: it takes no target")
    if tool.target is not ToolTarget.NOTHING and not words and not tool.optional_target:
        raise InvalidInputError(f"--for {tool.name} needs the {tool.target.value} that it works on")
    targets = tuple(dict.fromkeys(word if word.startswith("/") else f"/{word}" for word in words))
    for target in targets:
        if has_wildcard(target) or "~" in target:
            raise InvalidInputError(
                f"{quoted(target)}: a tool is given its targets one by one, without wildcards"
            )
        full_name(target, Profile("/", "tool", ()))
    return targets


def takes_planned_topics(tool: Tool) -> bool:
    """Return whether a tool can be given all topics of a plan: it only reads them."""
    return tool.target is ToolTarget.TOPIC and tool.each == ((_S, "{}"),)


def tool_policy(tool: Tool, targets: tuple[str, ...], enclave: str) -> EnclavePolicy:
    """Return exactly what the table says, for these targets."""
    needs = [(operation, name.replace("~", tool.node, 1)) for operation, name in tool.own]
    needs += [(operation, name.format(target)) for target in targets for operation, name in tool.each]
    rules = tuple(Rule(operation, Qualifier.ALLOW, name) for operation, name in sorted(set(needs)))
    profiles = (Profile("/", "tool", rules),) if rules else ()
    return EnclavePolicy(enclave, profiles, publishes_discovery=bool(tool.node))
