"""MoveIt's interfaces to ``move_group`` and to the robot's description.

Source: moveit/moveit2 humble 2b2030dd, jazzy 4d841063, main 8fcb5d23: move_group_interface.cpp,
current_state_monitor.cpp, synchronized_string_parameter.cpp.
"""

from __future__ import annotations

from dataclasses import replace

from enclave_addons.inference.cpp.engine.launch_values import text_of
from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.values import Value, concatenated, literal, unknown
from enclave_addons.inference.cpp.findings import AllocatedNode
from enclave_addons.inference.cpp.libraries import Call, library_class, library_method
from enclave_addons.inference.cpp.models.interfaces import CALL, CLI, PUB, SUB, named_in, owner_in
from enclave_addons.inference.cpp.models.nodes import become_node
from enclave_addons.inference.cpp.models.parameters import read
from enclave_addons.inference.cpp.models.table import listener
from enclave_addons.inference.cpp.reading.type_names import Type

_MOVE_GROUP = "moveit::planning_interface::MoveGroupInterface"
_DESCRIPTION = "robot_description"
_OF_MOVE_GROUP = (
    (PUB, "trajectory_execution_event", "std_msgs/msg/String"),
    (PUB, "attached_collision_object", "moveit_msgs/msg/AttachedCollisionObject"),
    (CALL, "move_action", "moveit_msgs/action/MoveGroup"),
    (CALL, "execute_trajectory", "moveit_msgs/action/ExecuteTrajectory"),
    (CLI, "query_planner_interface", "moveit_msgs/srv/QueryPlannerInterfaces"),
    (CLI, "get_planner_params", "moveit_msgs/srv/GetPlannerParams"),
    (CLI, "set_planner_params", "moveit_msgs/srv/SetPlannerParams"),
    (CLI, "compute_cartesian_path", "moveit_msgs/srv/GetCartesianPath"),
)


@library_class(_MOVE_GROUP)
def _move_group(run: Machine, call: Call) -> None:
    """Model (node, group or options, tf buffer, ...)."""
    record = _described(run, call)
    if record is None:
        return
    if not named_in(call.values[1:2]):
        run.gap(call.node, call.frame, "the namespace of this MoveGroupInterface is not known", record)
    for kind, name, type_name in _OF_MOVE_GROUP:
        run.endpoint(record, kind, literal(name), type_name, call)
    listener(run, replace(call, values=[]))


def _joint_states(run: Machine, call: Call) -> Value:
    record = call.this.data.get("node")
    if isinstance(record, AllocatedNode):
        run.endpoint(record, SUB, literal("joint_states"), "sensor_msgs/msg/JointState", call)
    return unknown("the state of a robot")


library_method(
    _MOVE_GROUP, "getCurrentState", "startStateMonitor", "getCurrentJointValues", "getRandomPose", "getCurrentPose",
    "getCurrentRPY",
)(_joint_states)  # fmt: skip


def _described(run: Machine, call: Call) -> AllocatedNode | None:
    """Return the node among the arguments, which takes its robot from its parameters, else from topics."""
    owner = owner_in(call.values)
    if owner is None or owner.node is None:
        run.gap(call.node, call.frame, f"the node of this {call.this.type.name} is not known")
        return None
    record = owner.node
    call.this.data["node"] = record
    for parameter in (_DESCRIPTION, f"{_DESCRIPTION}_semantic"):
        if any(text_of(run, atom) for atom in read(run, record, literal(parameter))):
            continue
        waiting = run.object((parameter, record), Type("rclcpp::Node"), heap=True)
        given = [concatenated(record.names, literal(f"_ssp_{parameter}")), record.namespaces or literal("")]
        made = become_node(run, replace(call, values=given, receiver=waiting))
        run.endpoint(made, SUB, literal(parameter), "std_msgs/msg/String", call)
    return record
