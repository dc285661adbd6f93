"""The hardware components in a robot description: since jazzy each runs a node named after it, and each is a plugin.

Source: ros-controls/ros2_control jazzy, hardware_component_interface.cpp: the name of the ``ros2_control`` element in
small letters, ``/`` as ``_``. What the plugin makes beside that node, a document with its class says.
"""

from __future__ import annotations

from collections.abc import Iterator

from enclave_addons.library.configuration.configured import Configured, ConfiguredPlugin
from enclave_common.source_location import SourceLocation
from enclave_common.terminal import quoted
from enclave_common.xml_tree import XmlElement
from nodl.builtin_interfaces import DISTROS
from nodl.errors import InvalidXMLError
from nodl.node_interface import Gap
from nodl.xml_text import parse_xml

_QUOTED = 80  # characters of a text that is no URDF: it may be a placeholder for the output of a program
_WITHOUT_NODES = DISTROS[: DISTROS.index("jazzy")]


def of_robot_description(text: str, place: SourceLocation, distro: str) -> Configured:
    """Return what the hardware in ``text`` needs: URDF, as a node of the launch publishes it; empty if none has one."""
    if not text:
        why = "no node of this launch has a robot_description, which names the hardware components"
        return Configured(gaps=(Gap(place, why),))
    try:
        root = parse_xml(text, "robot_description")
    except InvalidXMLError as error:
        begins = quoted(text if len(text) <= _QUOTED else f"{text[:_QUOTED]}...")
        why = f"the robot_description, which names the hardware components, cannot be read: {error}: {begins}"
        return Configured(gaps=(Gap(place, why),))
    names = map(_node_of, root.iter("ros2_control"))
    return Configured(
        nodes=() if distro in _WITHOUT_NODES else tuple(dict.fromkeys(name for name in names if name)),
        plugins=tuple(_plugins(root, place)),
    )


def _plugins(root: XmlElement, place: SourceLocation) -> Iterator[ConfiguredPlugin]:
    for component in root.iter("ros2_control"):
        plugins = (child for hardware in component.iter("hardware") for child in hardware)
        for plugin in plugins:
            if plugin.tag == "plugin":
                plugin_class = plugin.text.strip()
                what = f"hardware component {quoted(component.get('name'))} of class {quoted(plugin_class)}"
                yield ConfiguredPlugin(what, plugin_class, place, {}, _node_of(component))


def _node_of(component: XmlElement) -> str:
    return component.get("name").lower().replace("/", "_")
