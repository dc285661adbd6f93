"""The values that a ROS 2 parameter can have (``rcl_interfaces/msg/ParameterValue``)."""

from __future__ import annotations

ParameterValue = bool | int | float | str | bytes | tuple[bool | int | float | str | bytes, ...]
