"""The place where ``matches_node_name`` was before it moved to ``launch_ros.events``."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

from enclave_launch.description.launch_ros.events.matchers import matches_node_name as _matches_node_name


def matches_node_name(node_name: str) -> Callable[[Any], bool]:
    warnings.warn("'matches_node_name' is in 'launch_ros.events' now, not in 'lifecycle'", stacklevel=2)
    return _matches_node_name(node_name)
