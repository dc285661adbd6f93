"""Interfaces from source, where no manifest tells them: abstract interpretation of ROS 2 nodes.

Nothing of an analysed program is executed. ``infer_paths`` looks at files and folders, ``infer_executable``
at what launch starts as ``lib/<package>/<executable>``. What could not be found out is returned as gaps.
"""

from __future__ import annotations

from nodl.infer.executable import InferredExecutable, infer_executable
from nodl.infer.system import InferredSystem, infer_paths

__all__ = ["InferredExecutable", "InferredSystem", "infer_executable", "infer_paths"]
