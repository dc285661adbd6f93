"""NoDL: what a node talks to, from manifests or from its source.

The functions of the NoDL v1 Python API are here under their old names (``get_node_by_executable``,
``parse``, the modules ``types`` and ``errors``); new code asks ``nodl.lookup``. Everything is loaded on
first use, so that ``import nodl`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module

from enclave_launch.boundary.light import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nodl import errors, types
    from nodl.v1_api import get_node_by_executable, parse

__all__ = ["errors", "get_node_by_executable", "parse", "types"]

_MODULES = ("errors", "types")
_FUNCTIONS = ("get_node_by_executable", "parse")


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(f"nodl.{name}")
    if name in _FUNCTIONS:
        return getattr(import_module("nodl.v1_api"), name)
    raise AttributeError(f"module 'nodl' has no attribute '{name}'")
