"""The extension point ``launch_ros.node_action``: each node of upstream's engine gets its enclave before
it starts.
"""

from __future__ import annotations

from typing import Any

from launch_ros.actions.node import NodeActionExtension

from enclave_addons.ros2 import attributes  # accepted by the time a node is executed, too
from enclave_addons.ros2.observation import loads_components, observe_node
from enclave_addons.ros2.session import session_of


class EnclaveNodeActionExtension(NodeActionExtension):  # type: ignore[misc]  # untyped without ROS
    """Does nothing in a launch that is not secured by us, so that others (``ros2launch_security``) may."""

    def prepare_for_execute(
        self, context: Any, ros_specific_arguments: dict[str, Any], node_action: Any
    ) -> tuple[list[Any], dict[str, Any]]:
        """Secure a node about to start; raises EnclaveLaunchError, which launch reports before it shuts down."""
        session = session_of(context)
        if session is None:
            return [], ros_specific_arguments
        from launch.substitutions import TextSubstitution

        process = observe_node(node_action, context, ros_specific_arguments)
        grant = session.enter(process, loads_components=loads_components(node_action))
        setattr(node_action, attributes.GRANT, grant)
        return [[TextSubstitution(text=word)] for word in grant.arguments], ros_specific_arguments
