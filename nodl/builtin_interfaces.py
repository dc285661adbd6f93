"""The interfaces that every node has, without any manifest naming them: the one table of them.

A missing permission for one of these is fatal inside the node's constructor, a needless one is a gift; so
each row says for which client library and since which distribution it holds, under which condition, and
where that is known from. A node of unknown library gets the rows of both. What is off unless a program
asks for it (topic statistics, service introspection) is not here: a manifest has to name it; logger services are
a row with a condition. A name with ``*`` belongs to a helper node with an unpredictable name.
``ros_discovery_info`` is a matter of DDS permissions, not of ROS names, and has its place there.
Read by policy derivation and by the reports of inference.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from enum import Enum
from typing import NamedTuple

from nodl.node_interface import ClientLibrary, EndpointKind

DISTROS = ("foxy", "galactic", "humble", "iron", "jazzy", "kilted", "lyrical", "rolling")


class BuiltinCondition(Enum):
    """The condition of a row; the value is the text for a reader."""

    ALWAYS = "every node"
    SIM_TIME = "use_sim_time is true"
    PARAMETERS = "unless the program switches its parameter services off"
    TYPE_DESCRIPTION = "unless start_type_description_service is false"
    LIFECYCLE = "lifecycle node"
    CONTAINER = "component container"
    LOGGER_SERVICES = "with logger services"
    TF_LISTENER = "subscribes to /tf, as a TransformListener does"


class BuiltIn(NamedTuple):
    """One interface under the name the client library uses; ``library`` ``None`` means all."""

    kind: EndpointKind
    name: str
    type: str
    source: str
    condition: BuiltinCondition = BuiltinCondition.ALWAYS
    library: ClientLibrary | None = None
    since: str = DISTROS[0]

    def __str__(self) -> str:
        library = f"{self.library.value}, " if self.library else ""
        since = f", since {self.since}" if self.since != DISTROS[0] else ""
        return f"built-in ({library}{self.condition.value}{since}; {self.source})"


_P, _S, _R = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION, EndpointKind.SERVICE_SERVER
_PARAMETERS = "rclcpp parameter_service.cpp, rclpy parameter_service.py"
_LIFECYCLE = "rcl_lifecycle com_interface.c"
_LOGGERS = "rclcpp node_logger_services.cpp, rclpy logging_service.py"
_EVENT = "rcl_interfaces/msg/ParameterEvent"

PARAMETER_SERVICES = {
    "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters": "rcl_interfaces/srv/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
}
"""Below a node's name: what it serves, and what a client of its parameters calls; with their types."""

LOGGER_SERVICES = {
    "get_logger_levels": "rcl_interfaces/srv/GetLoggerLevels",
    "set_logger_levels": "rcl_interfaces/srv/SetLoggerLevels",
}
"""The same for a node with logger services."""


def _services(
    above: str, types: Mapping[str, str], source: str, condition: BuiltinCondition, since: str = DISTROS[0]
) -> Iterator[BuiltIn]:
    for name, type_name in types.items():
        yield BuiltIn(_R, f"{above}{name}", type_name, source, condition, since=since)


TABLE: tuple[BuiltIn, ...] = (
    BuiltIn(_P, "/rosout", "rcl_interfaces/msg/Log", "rcl logging_rosout.c"),
    BuiltIn(
        _P,
        "/parameter_events",
        _EVENT,
        "rclcpp node_parameters.cpp, rclpy node.py",
        BuiltinCondition.PARAMETERS,
    ),
    BuiltIn(_S, "/parameter_events", _EVENT, "rclcpp time_source.cpp", library=ClientLibrary.RCLCPP),
    *_services("~/", PARAMETER_SERVICES, _PARAMETERS, BuiltinCondition.PARAMETERS),
    BuiltIn(
        _R,
        "~/get_type_description",
        "type_description_interfaces/srv/GetTypeDescription",
        "rcl node_type_description_service.c",
        BuiltinCondition.TYPE_DESCRIPTION,
        since="iron",
    ),
    BuiltIn(
        _S,
        "/clock",
        "rosgraph_msgs/msg/Clock",
        "rclcpp time_source.cpp, rclpy time_source.py",
        BuiltinCondition.SIM_TIME,
    ),
    *_services(
        "~/",
        {
            "change_state": "lifecycle_msgs/srv/ChangeState",
            "get_state": "lifecycle_msgs/srv/GetState",
            "get_available_states": "lifecycle_msgs/srv/GetAvailableStates",
            "get_available_transitions": "lifecycle_msgs/srv/GetAvailableTransitions",
            "get_transition_graph": "lifecycle_msgs/srv/GetAvailableTransitions",
        },
        _LIFECYCLE,
        BuiltinCondition.LIFECYCLE,
    ),
    BuiltIn(
        _P, "~/transition_event", "lifecycle_msgs/msg/TransitionEvent", _LIFECYCLE, BuiltinCondition.LIFECYCLE
    ),
    *_services(
        "~/_container/",
        {
            "load_node": "composition_interfaces/srv/LoadNode",
            "unload_node": "composition_interfaces/srv/UnloadNode",
            "list_nodes": "composition_interfaces/srv/ListNodes",
        },
        "rclcpp_components component_manager.cpp",
        BuiltinCondition.CONTAINER,
    ),
    *_services("~/", LOGGER_SERVICES, _LOGGERS, BuiltinCondition.LOGGER_SERVICES, since="iron"),
    BuiltIn(
        _S, "/tf_static", "tf2_msgs/msg/TFMessage", "tf2_ros transform_listener", BuiltinCondition.TF_LISTENER
    ),
    BuiltIn(
        _R,
        "transform_listener_impl_*/get_type_description",
        "type_description_interfaces/srv/GetTypeDescription",
        "tf2_ros transform_listener.cpp: its helper node is named after an address, in the namespace of the process",
        BuiltinCondition.TF_LISTENER,
        ClientLibrary.RCLCPP,
        since="iron",
    ),
)


def built_in_interfaces(
    distro: str,
    library: ClientLibrary,
    conditions: Collection[BuiltinCondition] = (BuiltinCondition.ALWAYS, BuiltinCondition.PARAMETERS),
) -> tuple[BuiltIn, ...]:
    """Return the rows that hold under ``conditions``; raises ``ValueError`` for a distribution we do not know."""
    if distro not in DISTROS:
        raise ValueError(f"unknown ROS distribution '{distro}'; known: {', '.join(DISTROS)}")
    age = DISTROS.index(distro)
    libraries: Iterable[ClientLibrary | None] = (None, library)
    if library is ClientLibrary.UNKNOWN:
        libraries = (None, *ClientLibrary)
    return tuple(
        row
        for row in TABLE
        if row.condition in conditions and row.library in libraries and DISTROS.index(row.since) <= age
    )
