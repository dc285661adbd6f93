"""NoDL: what a node talks to, from manifests or from its source.

The functions of the NoDL v1 Python API are here under their old names (``get_node_by_executable``,
``parse``, the modules ``types`` and ``errors``); new code asks ``nodl.lookup``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from nodl import errors, types

if TYPE_CHECKING:
    from nodl.v1_api import get_node_by_executable, parse

__all__ = ["errors", "get_node_by_executable", "parse", "types"]


def __getattr__(name: str) -> Any:
    if name in ("get_node_by_executable", "parse"):
        return getattr(import_module("nodl.v1_api"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
