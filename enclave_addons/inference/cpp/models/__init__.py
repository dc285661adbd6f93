"""What libraries do with a node: rclcpp itself, then the reviewed table of well-known libraries."""

from enclave_addons.inference.cpp.models import (
    controllers,
    images,
    interfaces,
    moveit,
    nodes,
    parameters,
    plugins,
    table,
)

__all__ = ["controllers", "images", "interfaces", "moveit", "nodes", "parameters", "plugins", "table"]
