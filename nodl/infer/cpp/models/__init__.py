"""What libraries do with a node: rclcpp itself, then the reviewed table of well-known libraries."""

from nodl.infer.cpp.models import (
    actions,
    camera_info,
    images,
    interfaces,
    nav2,
    nodes,
    parameters,
    plugins,
    point_clouds,
    table,
    tf2,
)

__all__ = [
    "actions",
    "camera_info",
    "images",
    "interfaces",
    "nav2",
    "nodes",
    "parameters",
    "plugins",
    "point_clouds",
    "table",
    "tf2",
]
