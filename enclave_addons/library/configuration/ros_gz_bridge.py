"""The bridges of ``ros_gz_bridge``: the entries of its YAML file, or the words of ``parameter_bridge``'s command line.

Source: gazebosim/ros_gz jazzy, ``bridge_config.cpp``, ``ros_gz_bridge.cpp``, ``parameter_bridge.cpp``: of two
directions each is one endpoint, an entry that the bridge itself would refuse is a gap.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from enclave_addons.library.configuration.configured import Configured, collected, endpoint_named
from enclave_common.source_location import SourceLocation
from enclave_common.terminal import quoted
from nodl.node_interface import Endpoint, EndpointKind, Gap
from nodl.yaml_text import YamlList, YamlMap, YamlScalar, YamlValue

_DIRECTIONS = {
    "BIDIRECTIONAL": (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION),
    "GZ_TO_ROS": (EndpointKind.PUBLISHER,),
    "ROS_TO_GZ": (EndpointKind.SUBSCRIPTION,),
}
_SEPARATORS = {"@": "BIDIRECTIONAL", "[": "GZ_TO_ROS", "]": "ROS_TO_GZ"}


def of_configuration(root: YamlValue) -> Configured:
    """Return the entries of a ``config_file``."""
    if not isinstance(root, YamlList):
        return Configured(gaps=(Gap(root.source, "a bridge configuration must be a list of entries"),))
    return collected(part for entry in root.items for part in _entry(entry))


def of_arguments(words: Sequence[str], place: SourceLocation) -> Configured:
    """Read ``TOPIC@ROS_TYPE{@,[,]}GZ_TYPE`` and ``SERVICE@ROS_SRV_TYPE[@...]``, one a word."""
    return collected(part for word in words for part in _word(word, place))


def _entry(entry: YamlValue) -> Iterator[Endpoint | Gap]:
    if not isinstance(entry, YamlMap):
        yield Gap(entry.source, "an entry of a bridge configuration must be a mapping")
        return
    fields = {
        key: str(value.value)
        for key, value in entry.items.items()
        if isinstance(value, YamlScalar) and value.value is not None
    }
    name = fields.get("topic_name") or fields.get("ros_topic_name") or fields.get("gz_topic_name") or ""
    direction = fields.get("direction", "BIDIRECTIONAL")
    if direction not in _DIRECTIONS:
        yield Gap(entry.source, f"{quoted(direction)} is not a direction of a bridge")
        return
    type_name = fields.get("ros_type_name", "")
    yield from _endpoints(_DIRECTIONS[direction], name, type_name, entry.source, "bridge configuration")


def _word(word: str, place: SourceLocation) -> Iterator[Endpoint | Gap]:
    name, at, rest = word.partition("@")
    note = f"argument {word}"
    position = next((index for index, letter in enumerate(rest) if letter in _SEPARATORS), len(rest))
    type_name = rest[:position]
    if at and "/srv/" in type_name:
        yield from _endpoints((EndpointKind.SERVICE_SERVER,), name, type_name, place, note)
    elif not at or position == len(rest):
        yield Gap(
            place, f"{quoted(word)} does not describe a bridge: it is not TOPIC@ROS_TYPE{{@,[,]}}GZ_TYPE"
        )
    else:
        yield from _endpoints(_DIRECTIONS[_SEPARATORS[rest[position]]], name, type_name, place, note)


def _endpoints(
    kinds: Iterable[EndpointKind], name: str, type_name: str, place: SourceLocation, note: str
) -> Iterator[Endpoint | Gap]:
    return (endpoint_named(kind, name, type_name, place, note) for kind in kinds)
