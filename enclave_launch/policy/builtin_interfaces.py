"""The interfaces that every node has, without any manifest naming them: the one table of them.

A missing permission for one of these is fatal inside the node's constructor, a needless one is a gift; so
each row says for which client library and since which distribution it holds, under which condition, and
where that is known from. A node of unknown library gets the rows of both. What is off unless a program
asks for it (logger services, topic statistics, service introspection) is not here: a manifest has to name it.
``ros_discovery_info`` is a matter of DDS permissions, not of ROS names: see ``keystore.permissions``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

from enclave_launch.policy.running_node import RunningNode
from keystore.policy import Operation
from nodl.node_interface import ClientLibrary, EndpointKind, NodeInterface

DISTROS = ("foxy", "galactic", "humble", "iron", "jazzy", "kilted", "lyrical", "rolling")


class Condition(Enum):
    """What must hold for a row; the value is the text for a reader."""

    ALWAYS = "every node"
    SIM_TIME = "use_sim_time is true"
    TYPE_DESCRIPTION = "unless start_type_description_service is false"
    LIFECYCLE = "lifecycle node"
    CONTAINER = "component container"
    TF_LISTENER = "subscribes to /tf, as a TransformListener does"


@dataclass(frozen=True, slots=True)
class BuiltIn:
    """One interface under the name the client library uses; ``library`` ``None`` means all."""

    operation: Operation
    name: str
    source: str
    condition: Condition = Condition.ALWAYS
    library: ClientLibrary | None = None
    since: str = DISTROS[0]

    def __str__(self) -> str:
        library = f"{self.library.value}, " if self.library else ""
        since = f", since {self.since}" if self.since != DISTROS[0] else ""
        return f"built-in ({library}{self.condition.value}{since}; {self.source})"


_PARAMETER_SERVICES = "rclcpp parameter_service.cpp, rclpy parameter_service.py"
_LIFECYCLE = "rcl_lifecycle com_interface.c"
_CONTAINER = "rclcpp_components component_manager.cpp"
_P, _S, _R = Operation.PUBLISH, Operation.SUBSCRIBE, Operation.REPLY
_CPP = ClientLibrary.RCLCPP

TABLE: tuple[BuiltIn, ...] = (
    BuiltIn(_P, "/rosout", "rcl logging_rosout.c"),
    BuiltIn(_P, "/parameter_events", "rclcpp node_parameters.cpp, rclpy node.py"),
    BuiltIn(_S, "/parameter_events", "rclcpp time_source.cpp", library=_CPP),
    BuiltIn(_R, "~/describe_parameters", _PARAMETER_SERVICES),
    BuiltIn(_R, "~/get_parameter_types", _PARAMETER_SERVICES),
    BuiltIn(_R, "~/get_parameters", _PARAMETER_SERVICES),
    BuiltIn(_R, "~/list_parameters", _PARAMETER_SERVICES),
    BuiltIn(_R, "~/set_parameters", _PARAMETER_SERVICES),
    BuiltIn(_R, "~/set_parameters_atomically", _PARAMETER_SERVICES),
    BuiltIn(
        _R,
        "~/get_type_description",
        "rcl node_type_description_service.c",
        Condition.TYPE_DESCRIPTION,
        since="iron",
    ),
    BuiltIn(_S, "/clock", "rclcpp time_source.cpp, rclpy time_source.py", Condition.SIM_TIME),
    BuiltIn(_R, "~/change_state", _LIFECYCLE, Condition.LIFECYCLE),
    BuiltIn(_R, "~/get_state", _LIFECYCLE, Condition.LIFECYCLE),
    BuiltIn(_R, "~/get_available_states", _LIFECYCLE, Condition.LIFECYCLE),
    BuiltIn(_R, "~/get_available_transitions", _LIFECYCLE, Condition.LIFECYCLE),
    BuiltIn(_R, "~/get_transition_graph", _LIFECYCLE, Condition.LIFECYCLE),
    BuiltIn(_P, "~/transition_event", _LIFECYCLE, Condition.LIFECYCLE),
    BuiltIn(_R, "~/_container/load_node", _CONTAINER, Condition.CONTAINER),
    BuiltIn(_R, "~/_container/unload_node", _CONTAINER, Condition.CONTAINER),
    BuiltIn(_R, "~/_container/list_nodes", _CONTAINER, Condition.CONTAINER),
    BuiltIn(_S, "/tf_static", "tf2_ros transform_listener", Condition.TF_LISTENER),
)


def built_in_interfaces(node: RunningNode, distro: str) -> tuple[BuiltIn, ...]:
    """The rows that hold for ``node``. Raises ``ValueError`` for a distribution we do not know."""
    conditions = {Condition.ALWAYS}
    if node.parameters.get("use_sim_time") is True:
        conditions.add(Condition.SIM_TIME)
    if node.parameters.get("start_type_description_service") is not False:
        conditions.add(Condition.TYPE_DESCRIPTION)
    if node.role == "lifecycle_node" or node.interface.lifecycle:
        conditions.add(Condition.LIFECYCLE)
    if node.role == "container":
        conditions.add(Condition.CONTAINER)
    if _listens_to_tf(node.interface):
        conditions.add(Condition.TF_LISTENER)
    return _rows(distro, node.interface.library, frozenset(conditions))


@lru_cache(maxsize=256)
def _rows(distro: str, library: ClientLibrary, conditions: frozenset[Condition]) -> tuple[BuiltIn, ...]:
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


def _listens_to_tf(interface: NodeInterface) -> bool:
    return any(
        endpoint.kind is EndpointKind.SUBSCRIPTION and endpoint.name.text == "/tf"
        for endpoint in interface.endpoints
    )
