"""Interfaces of rclcpp nodes from C++ source, through tree-sitter (extra ``cpp``).

``reading/`` finds packages and what CMake builds, preprocesses files and says what their names mean; ``running/`` runs
a program in the abstract; ``models/`` knows rclcpp and well-known libraries; ``ledger`` asks what became of every place
that makes interfaces; ``system`` and ``reach`` answer for files and for what a launch starts.
"""
