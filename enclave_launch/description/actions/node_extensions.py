"""Extensions of ``Node`` by other packages: entry points ``launch_ros.node_action``."""

from __future__ import annotations

import os
import sys
import warnings
from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from enclave_launch.description.entity import Action
    from enclave_launch.description.launch_context import LaunchContext


class PluginException(Exception):
    """An extension that was written for another version of the extension point."""


def satisfies_version(version: str, caret_range: str) -> None:
    """Raise ``PluginException`` unless ``version`` lies in ``^MAJOR.MINOR``: same major, for 0 same minor."""
    if not caret_range.startswith("^"):
        raise AssertionError("Only supports caret ranges")
    have, wanted = _numbers(version), _numbers(caret_range[1:])
    upper = (wanted[0] + 1, 0) if wanted[0] else (0, wanted[1] + 1)
    if have < wanted:
        raise PluginException(
            f"Extension point is too old ({version}), the extension requires {caret_range[1:]!r}"
        )
    if have >= upper:
        raise PluginException(
            f"Extension point is newer ({version}), than what the extension supports {caret_range[1:]!r}"
        )


def _numbers(version: str) -> tuple[int, int]:
    major, _, rest = version.partition(".")
    return int(major), int(rest.partition(".")[0] or 0)


_GROUP = "launch_ros.node_action"
# Extensions for upstream's engine that have no part in ours: our own, and ros2launch_security, whose enclave per
# node is what --enclave-scope node gives.
_REPLACED = ("enclave_launch.", "ros2launch_security.")


class NodeActionExtension:
    """Base of extensions; exported by ``launch_ros.actions.node``."""

    NAME: str | None = None
    EXTENSION_POINT_VERSION = "0.1"

    def __init__(self) -> None:
        satisfies_version(self.EXTENSION_POINT_VERSION, "^0.1")

    def prepare_for_execute(
        self, context: LaunchContext, ros_specific_arguments: dict[str, Any], node_action: Action
    ) -> tuple[list[Any], dict[str, Any]]:
        """Return words to append to the command line, and the (changed) local ROS arguments."""
        return [], ros_specific_arguments


@lru_cache(maxsize=1)
def installed_extensions() -> tuple[NodeActionExtension, ...]:
    """Return one instance of each extension of an installed launch_ros; warn about one that cannot be loaded."""
    if not any(os.path.isdir(os.path.join(folder, "launch_ros")) for folder in sys.path):
        return ()
    import importlib.metadata  # only where ROS is installed: it takes long to load

    found = importlib.metadata.entry_points(group=_GROUP)
    loaded = [_instantiate(entry) for entry in found if not entry.value.startswith(_REPLACED)]
    return tuple(extension for extension in loaded if extension is not None)


def _instantiate(entry_point: Any) -> NodeActionExtension | None:
    try:
        extension: NodeActionExtension = entry_point.load()()
    except Exception as error:  # foreign code: it may raise anything, and must not stop the launch
        warnings.warn(f"Failed to load the node extension {entry_point.name}: {error}", stacklevel=2)
        return None
    extension.NAME = entry_point.name
    return extension
