"""API of ``launch_ros.utilities.namespace_utils``."""

from __future__ import annotations

from enclave_launch.ros_rules.namespaces import make_namespace_absolute as make_namespace_absolute
from enclave_launch.ros_rules.namespaces import prefix_namespace as prefix_namespace


def is_root_namespace(ns: str) -> bool:
    return ns == "/"


def is_namespace_absolute(ns: str) -> bool:
    return ns.startswith("/")
