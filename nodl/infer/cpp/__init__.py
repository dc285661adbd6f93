"""Interfaces of rclcpp nodes from C++ source, through tree-sitter (extra ``cpp``).

``project`` finds packages and what CMake builds; ``preprocess`` and ``declarations`` read files; ``names`` says what a
name means; ``machine``, ``statements``, ``expressions``, ``calls`` and ``objects`` run a program in the abstract;
``models`` knows rclcpp and well-known libraries; ``ledger`` asks what became of every place that makes interfaces.
"""
