"""Configuration files of tools that take any topic: what they name is what the tool needs, nothing else.

``read_configuration`` gives endpoints with file and line, and a gap for each thing that cannot be decided.
"""

from __future__ import annotations

import os

from enclave_addons.library.configuration import rviz
from enclave_addons.library.configuration.behavior_tree import of_tree
from enclave_addons.library.configuration.cartographer import of_lua
from enclave_addons.library.configuration.configured import Configured
from enclave_addons.library.configuration.costmap_filter import of_filter_info
from enclave_addons.library.configuration.ros2_control import of_robot_description
from enclave_addons.library.configuration.ros_gz_bridge import of_arguments, of_configuration
from enclave_addons.library.configuration.rslidar import of_sensors
from enclave_common.files import read_bytes
from enclave_common.source_location import SourceLocation
from nodl.ament_index import MISSING_PREFIX
from nodl.dependence import Situation
from nodl.errors import InvalidNoDLError
from nodl.name_template import NameTemplate as NameTemplate
from nodl.names import InvalidNameError as InvalidNameError
from nodl.names import validate_written_name as validate_written_name
from nodl.node_interface import Endpoint as Endpoint
from nodl.node_interface import EndpointKind as EndpointKind
from nodl.node_interface import Gap
from nodl.yaml_text import YamlValue, parse_yaml


def read_configuration(kind: str, file: str, situation: Situation, place: SourceLocation) -> Configured:
    """Read what ``file`` (or the command line in ``situation``) asks for.

    ``place``: the document that says it is read.
    """
    if kind == "ros_gz_bridge arguments":
        return of_arguments(situation.words, place)
    if kind == "ros2_control":
        return of_robot_description(situation.launched.robot_description, place, situation.distro)
    requested = bool(file)
    if kind == "rviz" and not file:
        file = os.path.expanduser("~/.rviz2/default.rviz")  # rviz_common: visualization_frame.cpp
    if not file:
        return Configured(
            gaps=(Gap(place, f"launch names no {kind} file, from which its topics would follow"),)
        )
    if kind == "costmap_filter":
        return of_filter_info(file, situation, place)
    if kind == "behavior_tree":
        return of_tree(file, situation)
    if kind == "cartographer":
        return of_lua(file)
    text = situation.files.get(file)
    is_there = text is not None or os.path.isfile(file)
    if kind == "rviz" and not is_there and not file.startswith(f"{MISSING_PREFIX}/"):
        return rviz.default(SourceLocation(file), requested=requested)
    try:
        root = _read(file, text, last_counts=kind == "rviz")  # as rviz_common's YamlConfigReader does
    except InvalidNoDLError as error:
        return Configured(gaps=(Gap(SourceLocation(file), f"{kind} file cannot be used: {error}"),))
    if kind == "rviz":
        return rviz.of_file(root, situation.distro)
    if kind == "ros_gz_bridge":
        return of_configuration(root)
    if kind == "rslidar":
        return of_sensors(root)
    return Configured(gaps=(Gap(place, f"files of kind {kind!r} have no reader"),))


def _read(file: str, text: str | None, *, last_counts: bool) -> YamlValue:
    """Read the file, or ``text`` in its place. Raises ``InvalidNoDLError``, also for a file that is not there."""
    try:
        if text is None and not os.path.isfile(file):
            raise InvalidNoDLError.at(SourceLocation(file), "there is no such file")
        content = read_bytes(file) if text is None else text.encode()
        return parse_yaml(content, file, last_counts=last_counts)
    except OSError as error:
        raise InvalidNoDLError.at(SourceLocation(file), f"cannot be read: {error.strerror}") from None
