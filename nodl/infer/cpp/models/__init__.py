"""What libraries do with a node: rclcpp itself, then the reviewed table of well-known libraries."""

from nodl.infer.cpp.models import images, interfaces, nodes, parameters, plugins, point_clouds, table

__all__ = ["images", "interfaces", "nodes", "parameters", "plugins", "point_clouds", "table"]
