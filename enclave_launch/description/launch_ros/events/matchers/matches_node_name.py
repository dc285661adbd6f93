"""Match node actions by their fully qualified name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def matches_node_name(node_name: str) -> Callable[[Any], bool]:
    """``node_name`` without a leading slash means the root namespace."""
    full_name = node_name if node_name.startswith("/") else f"/{node_name}"
    return lambda action: bool(action.node_name == full_name)
