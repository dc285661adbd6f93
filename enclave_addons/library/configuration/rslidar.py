"""The YAML file of ``rslidar_sdk``: what it receives and sends for each lidar, and the nodes that it makes for that.

Source: RoboSense-LiDAR/rslidar_sdk 1.5.19: node_manager.cpp, source_packet_ros.hpp, source_pointcloud_ros.hpp,
yaml_reader.hpp. What is not set, or null, has its default; ``yes`` and ``on`` are true, as yaml-cpp reads them.
"""

from __future__ import annotations

from typing import NamedTuple

from enclave_addons.library.configuration.configured import Configured, collected, endpoint_named
from enclave_common.terminal import quoted
from nodl.node_interface import Endpoint, EndpointKind, Gap
from nodl.yaml_text import YamlList, YamlMap, YamlValue

_PACKET = "rslidar_msg/msg/RslidarPacket"
_TRUE, _FALSE = ("true", "yes", "on", "y"), ("false", "no", "off", "n")
_ONLINE, _OF_ROS, _OF_FILE = "1", "2", "3"


class _Made(NamedTuple):
    """An endpoint that the program makes for each lidar, on a node of its own, under a switch of ``common``."""

    kind: EndpointKind
    key: str
    default: str
    type_name: str
    node: str


_RECEIVED = _Made(
    EndpointKind.SUBSCRIPTION, "ros_recv_packet_topic", "rslidar_packets", _PACKET, "rslidar_packets_source"
)
_SENT = {
    "send_packet_ros": _Made(
        EndpointKind.PUBLISHER,
        "ros_send_packet_topic",
        "rslidar_packets",
        _PACKET,
        "rslidar_packets_destination",
    ),
    "send_point_cloud_ros": _Made(
        EndpointKind.PUBLISHER,
        "ros_send_point_cloud_topic",
        "rslidar_points",
        "sensor_msgs/msg/PointCloud2",
        "rslidar_points_destination",
    ),
}


def of_sensors(root: YamlValue) -> Configured:
    """Return what the file says of all lidars; a gap where the program itself would end."""
    given = root.items if isinstance(root, YamlMap) else {}
    common, lidars = given.get("common"), given.get("lidar")
    if not isinstance(common, YamlMap) or not isinstance(lidars, YamlList):
        why = "a configuration of rslidar_sdk has a mapping 'common' and a list 'lidar'"
        return Configured(gaps=(Gap(root.source, why),))
    source = _text(common, "msg_source", "0")
    if source not in (_ONLINE, _OF_ROS, _OF_FILE):
        return Configured(gaps=(Gap(common.source, f"msg_source {quoted(source)} is none of rslidar_sdk"),))
    made = [_RECEIVED] if source == _OF_ROS else []
    for switch, sent in _SENT.items():
        written = _text(common, switch, "false").lower()
        if written not in (*_TRUE, *_FALSE):
            return Configured(gaps=(Gap(common.source, f"{switch} is neither true nor false"),))
        made += [sent] if written in _TRUE else []
    found = collected(_endpoint(lidar, each) for lidar in lidars.items for each in made)
    return found._replace(
        nodes=tuple(f"{each.node}_{at}" for each in made for at in range(len(lidars.items)))
    )


def _endpoint(lidar: YamlValue, made: _Made) -> Endpoint | Gap:
    name = _text(lidar.mapping("ros"), made.key, made.default) if isinstance(lidar, YamlMap) else made.default
    return endpoint_named(made.kind, name, made.type_name, lidar.source, made.key)


def _text(value: YamlMap, key: str, default: str) -> str:
    given = value.scalar(key)
    return default if given is None else str(given)
