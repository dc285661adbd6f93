"""The sensors that Cartographer subscribes: numbers and switches of its configuration in Lua.

Source: ros2-gbp/cartographer_ros-release 2.0.9003, node.cpp (``ComputeExpectedSensorIds``), node_options.cpp,
trajectory_options.cpp, node_constants.cpp. The Lua is not run: values that are written out are read, the last one
counts as it does there, and a file that computes (a function, a condition, a loop) is a gap.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from enclave_addons.library.configuration.configured import Configured, collected, endpoint_named
from enclave_common.files import read_bytes
from enclave_common.source_location import SourceLocation
from enclave_common.terminal import quoted
from nodl.node_interface import Endpoint, EndpointKind, Gap

_MAX_BYTES = 1_000_000
_MAX_INCLUDES = 20
_SPACE = re.compile(r"--\[\[.*?\]\]|--[^\n]*", re.S)
_INCLUDE = re.compile(r"""\binclude\s*\(?\s*["']([^"'\n]+)["']\s*\)?""")
_COMPUTES = re.compile(r"\b(?:if|for|while|repeat|function|local|goto|loadstring|dofile|require)\b")
# Of Cartographer itself; what they say is in ``_DEFAULTS``.
_OF_CARTOGRAPHER = frozenset({
    "map_builder.lua", "map_builder_server.lua", "pose_graph.lua", "trajectory_builder.lua",
    "trajectory_builder_2d.lua", "trajectory_builder_3d.lua",
})  # fmt: skip
_DEFAULTS = {
    "use_trajectory_builder_2d": "false",
    "use_trajectory_builder_3d": "false",
    "use_imu_data": "true",
    "publish_tracked_pose": "false",
}
_REPEATED = {
    "num_laser_scans": ("scan", "sensor_msgs/msg/LaserScan"),
    "num_multi_echo_laser_scans": ("echoes", "sensor_msgs/msg/MultiEchoLaserScan"),
    "num_point_clouds": ("points2", "sensor_msgs/msg/PointCloud2"),
}
_SWITCHED = {
    "use_odometry": ("odom", "nav_msgs/msg/Odometry"),
    "use_nav_sat": ("fix", "sensor_msgs/msg/NavSatFix"),
    "use_landmarks": ("landmark", "cartographer_ros_msgs/msg/LandmarkList"),
}


class _Unreadable(Exception):
    """Says why the configuration cannot be used."""


class _Written(NamedTuple):
    """The configuration with its includes in their places, without comments."""

    code: str
    place: SourceLocation

    def text(self, key: str) -> str | None:
        found = re.findall(rf"\b{key}\s*=\s*([^,;}}\n]*)", self.code)
        return found[-1].strip() if found else _DEFAULTS.get(key)

    def switch(self, key: str) -> bool:
        value = self.text(key)
        if value not in ("true", "false"):
            raise _Unreadable(_not_said(key, value))
        return value == "true"

    def number(self, key: str) -> int:
        value = self.text(key)
        if value is None or not re.fullmatch(r"\d{1,3}", value):
            raise _Unreadable(_not_said(key, value))
        return int(value)


def of_lua(file: str) -> Configured:
    """Return what a ``cartographer_node`` with the configuration ``file`` subscribes, and its ``tracked_pose``."""
    place = SourceLocation(file)
    try:
        code = _with_includes(Path(file), _MAX_INCLUDES)
        if _COMPUTES.search(code):
            raise _Unreadable("it computes its values")
        return collected(_used(_Written(code, place)))
    except _Unreadable as error:
        return Configured(gaps=(Gap(place, f"which sensors Cartographer subscribes is not known: {error}"),))


def _with_includes(file: Path, depth: int) -> str:
    """Return the code of ``file``, with that of each file that it includes from its folder in place of the word."""
    try:
        code = _SPACE.sub(" ", read_bytes(file, _MAX_BYTES).decode(errors="replace"))
    except OSError as error:
        raise _Unreadable(f"{file} cannot be read: {error.strerror or error}") from None

    def included(match: re.Match[str]) -> str:
        name = match[1]
        if name in _OF_CARTOGRAPHER and not (file.parent / name).is_file():
            return ""
        if not depth:
            raise _Unreadable("its files include each other without end")
        return _with_includes(file.parent / name, depth - 1)

    return _INCLUDE.sub(included, code)


def _used(written: _Written) -> Iterator[Endpoint | Gap]:
    for key, (topic, type_name) in _REPEATED.items():
        count = written.number(key)
        for name in [topic] if count == 1 else [f"{topic}_{index + 1}" for index in range(count)]:
            yield _endpoint(EndpointKind.SUBSCRIPTION, name, type_name, key, written)
    if _needs_imu(written):
        yield _endpoint(EndpointKind.SUBSCRIPTION, "imu", "sensor_msgs/msg/Imu", "use_imu_data", written)
    for key, (topic, type_name) in _SWITCHED.items():
        if written.switch(key):
            yield _endpoint(EndpointKind.SUBSCRIPTION, topic, type_name, key, written)
    if written.switch("publish_tracked_pose"):
        pose = "geometry_msgs/msg/PoseStamped"
        yield _endpoint(EndpointKind.PUBLISHER, "tracked_pose", pose, "publish_tracked_pose", written)


def _needs_imu(written: _Written) -> bool:
    if written.switch("use_trajectory_builder_3d"):
        return True
    return written.switch("use_trajectory_builder_2d") and written.switch("use_imu_data")


def _endpoint(kind: EndpointKind, name: str, type_name: str, key: str, written: _Written) -> Endpoint | Gap:
    return endpoint_named(kind, name, type_name, written.place, f"{key} of the configuration in Lua")


def _not_said(key: str, value: str | None) -> str:
    return f"it does not say {key}" if value is None else f"{key} is {quoted(value)}, which is computed"
