"""Controllers of ros2_control: plugins that are lifecycle nodes of their own, named by who loads them.

Source: ros-controls/ros2_control humble, jazzy, master: controller_interface_base.hpp, controller_interface_base.cpp.
"""

from __future__ import annotations

from dataclasses import replace

from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.values import Value, literal, unknown
from enclave_addons.inference.cpp.libraries import Call, library_function, node_class, node_method
from enclave_addons.inference.cpp.models.nodes import become_node
from nodl.dependence import CONTROLLER

CONTROLLERS = tuple(
    f"controller_interface::{name}"
    for name in ("ControllerInterface", "ChainableControllerInterface", "ControllerInterfaceBase")
)


@node_class(*CONTROLLERS)
def _controller(run: Machine, call: Call) -> None:
    become_node(run, replace(call, values=[literal(CONTROLLER)]), lifecycle=True)


@library_function("controller_interface::get_ordered_interfaces")
def _ordered(run: Machine, call: Call) -> Value:
    """Model controller_interface/helpers.hpp: it sorts references to the hardware."""
    return unknown("whether the hardware has all interfaces")


@node_method("get_node")
def _self(run: Machine, call: Call) -> Value:
    return (call.this,)


@node_method(
    "get_update_rate", "get_robot_description", "get_lifecycle_state", "get_lifecycle_id", "is_async", "is_chainable",
    "is_in_chained_mode", "assign_interfaces", "release_interfaces", "get_hard_joint_limits",
)  # fmt: skip
def _says(run: Machine, call: Call) -> Value:
    return unknown("what a controller says of itself")
