"""Find what add-ons bring, by the entry points of installed distributions, as ros2cli and colcon find theirs."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from typing import Any

from enclave_common.dependencies import installed


def add_ons(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of ``group`` by name, in the order of their names."""
    return {each.name: each for each in sorted(entry_points(group=group), key=lambda each: each.name)}


def add_on(group: str, name: str) -> Any | None:
    """Import what an add-on brings.

    Args:
        group: The entry points of one place in the flow, such as ``enclave_launch.describer``.
        name: The name of the entry point.

    Returns:
        The object of the entry point, or None if that add-on is not installed.
    """
    entry = add_ons(group).get(name)
    if entry is None or not installed(entry.module):
        return None
    return entry.load()
