"""Names in a policy that was written from a running system and that no later start has again. Pure.

``ros2 security generate_policy`` writes down the graph as it is, with the nodes of its own tools and with names that
hold a process id, an address or a random number.
"""

from __future__ import annotations

import re

_HEX = r"(?=[a-f]*[0-9])[0-9a-f]+"
_OF_TOOLS = re.compile(
    rf"_ros2cli(?:_daemon|_requester|_send_goal)?(?:_{_HEX})*_{_HEX}\Z|launch_ros_[0-9]+\Z"
)
"""ros2cli node/direct.py, node/daemon.py, launch_ros ros_adapters.py. The last part is a process id or a hash."""
_MADE_UP = (
    re.compile(r"(transform_listener_impl)_[0-9a-f]{6,}\Z"),  # tf2_ros transform_listener.hpp: an address
    re.compile(r"(rqt_gui_(?:py|cpp)_node)_[0-9]+\Z"),  # rqt_gui ros2_plugin_context.py: a process id
    re.compile(r"(interactive_marker_display)_[0-9]{6,}\Z"),  # rviz_default_plugins: an address
    re.compile(
        r"(\w+?)_[0-9]{2,7}_[0-9]{12,19}\Z"
    ),  # anonymous names: process id, then time or random number
    re.compile(r"(\w+?)_(?=[0-9]*[a-f])(?=[a-f]*[0-9])[0-9a-f]{8,16}\Z"),  # an address or a hash
)
_NUMBERED = re.compile(r"\w+?_[0-9]{4,}\Z")


def is_of_a_tool(node: str) -> bool:
    """Return whether this is a node of ``ros2``, its daemon or launch, as one run of them had it."""
    return _OF_TOOLS.match(node) is not None


def has_number(node: str) -> bool:
    """Return whether a node's name ends in a number that may be a process id, or as well a serial number."""
    return _NUMBERED.match(node) is not None


def as_pattern(node: str) -> str:
    """Return the pattern of what a program calls this node at each start, or the name itself if it is a fixed one.

    ``transform_listener_impl_55d0c8a1b2c0`` becomes ``transform_listener_impl_*``.
    """
    for made_up in _MADE_UP:
        if found := made_up.match(node):
            return f"{found[1]}_*"
    return node


def expression_as_pattern(expression: str) -> str | None:
    """Return a name of a topic or service with each such part as a pattern, or None for one of a tool's node."""
    parts = expression.split("/")
    if any(map(is_of_a_tool, parts)):
        return None
    return "/".join(map(as_pattern, parts))
