"""What libraries do with a node: rclcpp itself, then the reviewed table of well-known libraries."""

from nodl.infer.cpp.models import actions, images, interfaces, nodes, parameters, plugins, table, tf2

__all__ = ["actions", "images", "interfaces", "nodes", "parameters", "plugins", "table", "tf2"]
