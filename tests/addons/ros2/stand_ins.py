"""What real launch_ros imports of a ROS installation, where there is only its Python source.

``install()`` puts modules in place of rclpy, of the message packages and of ros2cli, as far as launching
needs them. All of launch's and launch_ros's own code stays real; nothing of it is patched. Names are
checked by our own rules, which the tests of ``nodl`` hold against rcl's. Where the real module is
importable it is used.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import sys
import tempfile
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import Any

from enclave_launch.description.install import public_module
from nodl.names import validate_namespace, validate_node_name


class Anything:
    """Takes every call and attribute; what a client, publisher or subscription is to launch."""

    srv_name = "stand-in"

    def __init__(self, *_: object, **__: object) -> None:
        pass

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *_, **__: Anything()

    def __bool__(self) -> bool:
        return False


class LoadNodeRequest:
    def __init__(self) -> None:
        self.package_name = self.plugin_name = self.node_name = self.node_namespace = ""
        self.remap_rules: list[str] = []
        self.parameters: list[object] = []
        self.extra_arguments: list[object] = []


class LoadNode:
    Request = LoadNodeRequest


class Parameter:
    class Type(Enum):
        ANY = 0

        def check(self, _: object) -> bool:
            return True

    def __init__(self, name: str, type_: object = None, value: object = None) -> None:
        self.name, self.value = name, value

    def to_parameter_msg(self) -> tuple[str, object]:
        return self.name, self.value


class PluginException(Exception):
    pass


def instantiate_extensions(group: str, *, exclude_names: object = None) -> dict[str, Any]:
    """ros2cli's: one instance of each entry point of the group, by name."""
    return {entry.name: entry.load()() for entry in importlib.metadata.entry_points(group=group)}


_PLACED: set[str] = set()  # top-level names that are ours


def module(name: str, **members: object) -> None:
    top, _, _ = name.partition(".")
    if top not in _PLACED and importlib.util.find_spec(top) is not None:
        return
    _PLACED.add(top)
    made = ModuleType(name)
    made.__path__ = []
    made.__dict__.update(members)
    sys.modules[name] = made
    parent, _, leaf = name.rpartition(".")
    if parent:
        setattr(sys.modules[parent], leaf, made)


def install() -> None:
    _rclpy()
    _messages()
    _command_line()


def _rclpy() -> None:
    logs = Path(tempfile.gettempdir())
    module("rclpy", Context=Anything, init=lambda **_: None, create_node=Anything, shutdown=lambda **_: None)
    module("rclpy.executors", SingleThreadedExecutor=Anything)
    module("rclpy.logging", get_logging_directory=lambda: logs)
    module("rclpy.parameter", Parameter=Parameter)
    module("rclpy.validate_namespace", validate_namespace=validate_namespace)
    module("rclpy.validate_node_name", validate_node_name=validate_node_name)


def _messages() -> None:
    module("composition_interfaces")
    module("composition_interfaces.srv", LoadNode=LoadNode)
    if importlib.util.find_spec("lifecycle_msgs") is None:
        sys.modules["lifecycle_msgs"] = public_module("lifecycle_msgs")
        sys.modules["lifecycle_msgs.msg"] = public_module("lifecycle_msgs.msg")
        _PLACED.add("lifecycle_msgs")
    module("lifecycle_msgs.srv", ChangeState=Anything)


def _command_line() -> None:
    module("ros2cli")
    module("ros2cli.command", CommandExtension=type("CommandExtension", (), {}))
    module(
        "ros2cli.plugin_system",
        PluginException=PluginException,
        instantiate_extensions=instantiate_extensions,
        satisfies_version=lambda version, constraint: True,
    )
    module("ros2pkg")
    module("ros2pkg.api", package_name_completer=lambda **_: ())
