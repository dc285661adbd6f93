"""Interfaces from source, where no manifest has them: abstract interpretation of ROS 2 nodes.

Nothing of an analysed program is executed. ``infer_paths`` looks at files and folders, ``infer_executable``
at what launch starts as ``lib/<package>/<executable>``. What could not be found out is returned as gaps.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from enclave_addons.inference.executable import InferredExecutable, infer_executable
    from enclave_addons.inference.system import InferredSystem, infer_paths

__all__ = ["InferredExecutable", "InferredSystem", "infer_executable", "infer_paths"]
_HOMES = {
    "InferredExecutable": "enclave_addons.inference.executable",
    "InferredSystem": "enclave_addons.inference.system",
    "infer_executable": "enclave_addons.inference.executable",
    "infer_paths": "enclave_addons.inference.system",
}


def __getattr__(name: str) -> object:
    """Import a name when it is first used: who evaluates a launch often needs no analysis at all."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
