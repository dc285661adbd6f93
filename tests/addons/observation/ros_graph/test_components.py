"""Components loaded by the launcher's own node on real rclpy, in a container of Python nodes."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.addons.observation.ros_graph.composition import composition_interfaces
from tests.addons.observation.ros_graph.conftest import ROOT
from tests.addons.recording.conftest import rclpy_python

MANIFEST = """<interface version="1">
  <node name="talker" executable="graph_nodes::Talker">
    <topic name="chatter" type="std_msgs/msg/String" role="publisher"/>
    <topic name="orders" type="std_msgs/msg/String" role="subscription"/>
  </node>
</interface>
"""

LAUNCH = """<launch>
  <node_container pkg="graph_nodes" exec="container" name="box" namespace="/arm" output="screen" args="3">
    <composable_node pkg="graph_nodes" plugin="graph_nodes::Talker" name="one" namespace="left">
      <remap from="chatter" to="news"/>
      <remap from="orders" to="/orders"/>
    </composable_node>
    <composable_node pkg="graph_nodes" plugin="graph_nodes::Broken" name="two"/>
  </node_container>
  <group>
    <set_remap from="orders" to="commands"/>
    <load_composable_node target="/arm/box">
      <composable_node pkg="graph_nodes" plugin="graph_nodes::Talker" name="three"/>
    </load_composable_node>
  </group>
</launch>
"""


@pytest.fixture(scope="module")
def types(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return composition_interfaces(rclpy_python("jazzy"), tmp_path_factory.mktemp("types"))


@pytest.fixture
def command(
    prefix: Path, environment: dict[str, str], types: dict[str, str]
) -> tuple[list[str], dict[str, str]]:
    (prefix / "share" / "graph_nodes").mkdir(parents=True)
    (prefix / "share" / "graph_nodes" / "graph_nodes.nodl.xml").write_text(MANIFEST)
    environment |= {**types, "PYTHONPATH": f"{ROOT}:{types['PYTHONPATH']}"}
    return [str(rclpy_python("jazzy")), "-m", "enclave_launch", "-n", "--prefix", str(prefix)], environment


def run(command: tuple[Sequence[str], dict[str, str]], *words: str | Path) -> str:
    asked, environment = command
    ran = subprocess.run(
        [*asked, *map(str, words)], env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    return ran.stdout + ran.stderr


def test_components_are_loaded_in_order_and_have_what_was_planned(
    tmp_path: Path, command: tuple[list[str], dict[str, str]]
) -> None:
    file = tmp_path / "components.launch.xml"
    file.write_text(LAUNCH)
    shown = run(command, file)
    told = re.findall(r"(Loaded node '\S+'|Failed to load node '\S+') .*in container '/arm/box'", shown)
    beside = "Loaded node '/three'"  # asked for by an action of its own
    assert [each for each in told if each != beside] == [
        "Loaded node '/left/one'",
        "Failed to load node 'two'",
    ], shown
    assert beside in told
    assert "of type 'graph_nodes::Broken' in container '/arm/box': no such class" in shown
    asked, environment = command
    dry = [*asked, "--dry-run", "--format", "json", str(file)]
    plan = json.loads(subprocess.run(dry, env=environment, capture_output=True, text=True, check=True).stdout)
    planned = {
        (node["fqn"], each["operation"], each["name"]): each["type"]
        for node in plan["nodes"]
        for each in node["interfaces"]
    }
    seen = endpoints(shown)
    assert ("/left/one", "publish", "/left/news", "std_msgs/msg/String") in seen
    assert ("/left/one", "subscribe", "/orders", "std_msgs/msg/String") in seen
    assert ("/three", "subscribe", "/commands", "std_msgs/msg/String") in seen
    assert {each[:3] for each in seen} - planned.keys() == set()
    assert [each for each in seen if planned[each[:3]] not in ("", each[3])] == []


def endpoints(shown: str) -> set[tuple[str, str, str, str]]:
    """What the container told of its nodes."""
    told = [json.loads(found) for found in re.findall(r"HAS (\{.*\})", shown)]
    return {
        (node, operation, name, types[0])
        for node, lists in ((each.pop("node"), each) for each in told)
        for operation, found in lists.items()
        for name, types in found
    }


def test_a_shutdown_does_not_wait_for_a_container_that_never_comes(
    tmp_path: Path, command: tuple[list[str], dict[str, str]]
) -> None:
    file = tmp_path / "nowhere.launch.xml"
    file.write_text(
        '<launch><load_composable_node target="/nowhere"><composable_node pkg="graph_nodes" '
        'plugin="graph_nodes::Talker" name="one"/></load_composable_node>'
        '<timer period="0.5"><shutdown/></timer></launch>'
    )
    assert "Abandoning wait for the '/nowhere/_container/load_node' service" in run(command, file)
