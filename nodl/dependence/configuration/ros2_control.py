"""The hardware components in a robot description: each runs a node named after it.

Source: ros-controls/ros2_control jazzy, hardware_component_interface.cpp: the name of the ``ros2_control`` element in
small letters, ``/`` as ``_``.
"""

from __future__ import annotations

from nodl.dependence.configuration.configured import Configured
from nodl.errors import InvalidXMLError
from nodl.node_interface import Gap
from nodl.source_ref import SourceRef
from nodl.xml_text import parse_xml


def of_robot_description(text: str, place: SourceRef) -> Configured:
    """Return what the hardware in ``text`` needs: URDF, as a node of the launch publishes it; empty if none has one."""
    if not text:
        why = (
            "no node of this launch has a robot_description, which names the nodes of the hardware components"
        )
        return Configured(gaps=(Gap(place, why),))
    try:
        root = parse_xml(text, "robot_description")
    except InvalidXMLError as error:
        why = f"the robot_description, which names the nodes of the hardware components, cannot be read: {error}"
        return Configured(gaps=(Gap(place, why),))
    names = (element.get("name").lower().replace("/", "_") for element in root.iter("ros2_control"))
    return Configured(nodes=tuple(dict.fromkeys(name for name in names if name)))
