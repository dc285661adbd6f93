"""camera_info_manager: one service, whose name differs between distributions.

Source: ros-perception/image_common humble d118138, jazzy d04d2c8, rolling f6e4ab6:
camera_info_manager/src/camera_info_manager.cpp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodl.infer.cpp.libraries import library_class
from nodl.infer.cpp.models.table import SRV, owner_in, texts_in
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import Obj, Text, Value, concatenated, literal

if TYPE_CHECKING:
    from tree_sitter import Node


@library_class("camera_info_manager::CameraInfoManager")
def _manager(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    """(node, camera, url): ``set_camera_info`` in humble, ``~/set_camera_info`` from jazzy on; in rolling a further
    text is the namespace. Which one is installed is not asked: both are listed."""
    owner = owner_in(run, arguments)
    if owner is None or owner.node is None:
        run.gap(node, frame, "the node of this camera_info_manager::CameraInfoManager is not known")
        return None
    texts = [value for value in texts_in(arguments, run) if any(isinstance(atom, Text) for atom in value)]
    spaces = [texts[2]] if len(texts) > 2 else [literal("~")]
    names = [concatenated(space, literal("/set_camera_info")) for space in spaces]
    for name in names if len(texts) > 2 else [*names, literal("set_camera_info")]:
        run.endpoint(owner.node, SRV, name, "sensor_msgs/srv/SetCameraInfo", node, frame)
    return None
