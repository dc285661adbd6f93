"""Properties of upstream's classes: a launch file cannot set them, and a subclass of its own may have others."""

from __future__ import annotations

from typing import Any

import pytest

from enclave_launch.description.install import installed

with installed():
    from launch.actions import DeclareLaunchArgument, ExecuteProcess, SetEnvironmentVariable, TimerAction
    from launch.events import Shutdown
    from launch.substitutions import LaunchConfiguration
    from launch_ros.actions import LifecycleNode, Node
    from launch_ros.descriptions import ComposableNode

SHOWN: list[tuple[type, dict[str, Any], str]] = [
    (ExecuteProcess, {"cmd": ["true"]}, "shell"),
    (Node, {"package": "p", "executable": "e"}, "node_package"),
    (LifecycleNode, {"name": "n", "namespace": "", "package": "p", "executable": "e"}, "node_autostart"),
    (ComposableNode, {"package": "p", "plugin": "P"}, "node_name"),
    (DeclareLaunchArgument, {"name": "rate"}, "default_value"),
    (TimerAction, {"period": 1.0, "actions": []}, "period"),
    (SetEnvironmentVariable, {"name": "A", "value": "b"}, "value"),
    (LaunchConfiguration, {"variable_name": "rate"}, "variable_name"),
    (Shutdown, {"reason": "over"}, "reason"),
]


@pytest.mark.parametrize(("kind", "given", "name"), SHOWN)
def test_it_cannot_be_set(kind: type, given: dict[str, Any], name: str) -> None:
    made = kind(**given)
    before = getattr(made, name)
    with pytest.raises(AttributeError):
        setattr(made, name, "mine")
    assert getattr(made, name) is before


@pytest.mark.parametrize(("kind", "given", "name"), SHOWN)
def test_a_subclass_may_have_its_own(kind: type, given: dict[str, Any], name: str) -> None:
    mine = type("Mine", (kind,), {name: property(lambda self: "mine")})
    assert getattr(mine(**given), name) == "mine"
