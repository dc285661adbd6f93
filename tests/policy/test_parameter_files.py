"""Names made from parameters follow what the node will read, whichever way the launch file gives it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch import LaunchPlan, ManifestError, ResolveOptions, provision, resolve
from enclave_launch.diagnostics import Code
from enclave_launch.verb.secure_launch import params_yaml
from tests.programs import install_package

NODE = """#!/usr/bin/env python3
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("speaker")
node.declare_parameter("topic", "default_topic")
node.create_publisher(String, node.get_parameter("topic").value, 1)
rclpy.spin(node)
"""

Launch = Callable[..., LaunchPlan]


@pytest.fixture
def launch(tmp_path: Path) -> Launch:
    """``launch(text, name=content)``: files beside a launch file that uses package ``pk`` with node ``speaker``."""
    install_package(tmp_path, "pk", {"speaker": NODE})

    def run(text: str, suffix: str = "xml", **files: str) -> LaunchPlan:
        for name, content in files.items():
            (tmp_path / f"{name}.yaml").write_text(content)
        file = tmp_path / f"test.launch.{suffix}"
        file.write_text(text.replace("DIR", str(tmp_path)))
        return resolve(file, options=ResolveOptions(prefixes=(tmp_path,)))

    return run


def published(plan: LaunchPlan) -> set[str]:
    (reasons,) = plan.derived.reasons.values()
    return {rule.expression for rule in reasons if rule.operation.value == "publish"} - {
        "/rosout",
        "/parameter_events",
    }


FILE = "/**: {ros__parameters: {topic: $(var robot)_news}}"
XML = '<launch><let name="robot" value="r1"/><node pkg="pk" exec="speaker">{}</node></launch>'
PYTHON = """
from launch import LaunchDescription
from launch.actions import *
from launch_ros.actions import Node
from launch_ros.descriptions import ParameterFile
def generate_launch_description():
    q = ParameterFile("DIR/q.yaml", allow_substs=True)
    return LaunchDescription([SetLaunchConfiguration("robot", "r1"),
        {}])
"""
WAYS = {
    "from": (XML.format('<param from="DIR/q.yaml" allow_substs="true"/>'), "xml"),
    "ParameterFile": (PYTHON.format('Node(package="pk", executable="speaker", parameters=[q])'), "py"),
    "used by two nodes": (
        PYTHON.format('*(Node(package="pk", executable="speaker", parameters=[q]) for _ in "ab")'),
        "py",
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_file_with_substitutions_reaches_permissions_and_parameters(way: str, launch: Launch) -> None:
    plan = launch(*WAYS[way], q=FILE)
    assert published(plan) == {"/r1_news"}
    assert "topic: r1_news" in params_yaml(plan)


def test_a_file_without_permission_to_substitute_stays_as_it_is(launch: Launch) -> None:
    plan = launch(XML.format('<param from="DIR/q.yaml"/>'), q="/**: {ros__parameters: {topic: plain}}")
    assert published(plan) == {"/plain"}


@pytest.mark.parametrize("way", ["from", "substituted"])
@pytest.mark.parametrize(
    ("content", "refused"),
    [
        ("/**: {ros__parameters: {topic: t, l: [t, 1]}}", True),
        ("/**: {ros__parameters: {topic: t, l: [t, u]}}", False),
        ("topic: t", True),
        ("{}", False),
        ("/**: {ros__parameters: {topic: }}", True),
    ],
)
def test_a_file_with_which_no_node_would_start_stops_a_secured_start(
    content: str, refused: bool, way: str, launch: Launch
) -> None:
    substituted = ' allow_substs="true"' if way == "substituted" else ""
    plan = launch(XML.format(f'<param from="DIR/q.yaml"{substituted}/>'), q=content)
    assert [problem.code for problem in plan.problems] == [Code.PARAMETERS_UNKNOWN] * refused


@pytest.mark.parametrize("content", ["topic: [", None])
def test_a_file_that_cannot_be_read_stops_a_secured_start(
    content: str | None, launch: Launch, tmp_path: Path
) -> None:
    files = {} if content is None else {"q": content}
    text = XML.replace("<node ", '<node ros_args="--params-file DIR/q.yaml" ').format("")
    plan = launch(text, **files)
    (problem,) = plan.problems
    assert problem.code is Code.PARAMETERS_UNKNOWN and f"{tmp_path}/q.yaml" in problem.text
    with pytest.raises(ManifestError):
        provision(plan, tmp_path / "ks")
    assert not launch(text, q="/**: {ros__parameters: {topic: t}}").problems
