"""Actions of rclcpp_action. Source: rclcpp_action/create_server.hpp, create_client.hpp (humble to rolling)."""

from __future__ import annotations

from nodl.infer.cpp.libraries import Call, library_function
from nodl.infer.cpp.models.interfaces import add, owner_and_name
from nodl.infer.cpp.reading.type_names import ros_type
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import Value, unknown
from nodl.node_interface import EndpointKind


def _action(name: str, kind: EndpointKind) -> None:
    def function(run: Machine, call: Call) -> Value:
        owner, position = owner_and_name(run, call)
        if owner is None:
            run.gap(
                call.node,
                call.frame,
                f"the node that rclcpp_action::{name}() makes an action on is not known",
            )
            return unknown("an action")
        return add(
            run, owner, kind, call.value(position), ros_type(call.types[0]) if call.types else "", call
        )

    library_function(f"rclcpp_action::{name}")(function)


_action("create_server", EndpointKind.ACTION_SERVER)
_action("create_client", EndpointKind.ACTION_CLIENT)
_action("create_generic_client", EndpointKind.ACTION_CLIENT)
