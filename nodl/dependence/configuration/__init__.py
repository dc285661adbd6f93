"""Configuration files of tools that take any topic: what they name is what the tool needs, nothing else.

``read_configuration`` gives endpoints with file and line, and a gap for each thing that cannot be told.
"""

from __future__ import annotations

import os
from collections.abc import Iterable

from enclave_launch.boundary.files import read_bytes
from enclave_launch.boundary.light import NamedTuple
from nodl.dependence import Situation
from nodl.errors import InvalidNoDLError
from nodl.name_template import NameTemplate
from nodl.names import InvalidNameError, validate_written_name
from nodl.node_interface import Endpoint, EndpointKind, Gap
from nodl.source_ref import SourceRef
from nodl.yaml_text import YamlValue, parse_yaml


class Configured(NamedTuple):
    """``nodes``: names of further nodes that the program makes, of which nothing else is known to differ."""

    endpoints: tuple[Endpoint, ...] = ()
    gaps: tuple[Gap, ...] = ()
    nodes: tuple[str, ...] = ()


def collected(parts: Iterable[Endpoint | Gap]) -> Configured:
    """Each once, in their order."""
    found = list(dict.fromkeys(parts))
    endpoints = tuple(part for part in found if isinstance(part, Endpoint))
    return Configured(endpoints, tuple(part for part in found if isinstance(part, Gap)))


def endpoint_named(
    kind: EndpointKind, name: str, type_name: str, place: SourceRef, note: str
) -> Endpoint | InvalidNameError:
    """The endpoint that a tool makes under the ``name`` in its file, or why there can be none of that name."""
    try:
        validate_written_name(name)
    except InvalidNameError as error:
        return error
    return Endpoint(kind, NameTemplate.literal(name), type_name, place, note=note)


def read_configuration(kind: str, file: str, situation: Situation, place: SourceRef) -> Configured:
    """What ``file`` (or the command line in ``situation``) asks for. ``place``: the document that says it is read."""
    if kind == "ros_gz_bridge arguments":
        from nodl.dependence.configuration.ros_gz_bridge import of_arguments

        return of_arguments(situation.words, place)
    if kind == "ros2_control":
        from nodl.dependence.configuration.ros2_control import of_robot_description

        return of_robot_description(situation.launched.robot_description, place)
    if not file:
        return Configured(
            gaps=(Gap(place, f"launch names no {kind} file, from which its topics would follow"),)
        )
    if kind == "behavior_tree":
        from nodl.dependence.configuration.behavior_tree import of_tree

        return of_tree(file)
    try:
        root = _read(file)
    except InvalidNoDLError as error:
        return Configured(gaps=(Gap(SourceRef(file), f"{kind} file cannot be used: {error}"),))
    if kind == "rviz":
        from nodl.dependence.configuration.rviz import of_file

        return of_file(root, situation.distro)
    if kind == "ros_gz_bridge":
        from nodl.dependence.configuration.ros_gz_bridge import of_configuration

        return of_configuration(root)
    return Configured(gaps=(Gap(place, f"nobody here can read a file of kind {kind!r}"),))


def _read(file: str) -> YamlValue:
    """Raises ``InvalidNoDLError``, also for a file that is not there."""
    try:
        if not os.path.isfile(file):
            raise InvalidNoDLError.at(SourceRef(file), "there is no such file")
        return parse_yaml(read_bytes(file), file)
    except OSError as error:
        raise InvalidNoDLError.at(SourceRef(file), f"cannot be read: {error.strerror}") from None
