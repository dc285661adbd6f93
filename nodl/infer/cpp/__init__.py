"""Interfaces of rclcpp nodes from C++ source, through tree-sitter (extra ``cpp``).

A front half of lower certainty than the Python one: every method of a node class is taken as reachable,
variables hold any value assigned to them anywhere in their function or class. What that cannot tell is
unknown and said so.
"""
