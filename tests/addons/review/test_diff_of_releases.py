"""``secure-plan diff --against``: what another release of ROS changes for one launch file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from enclave_addons.review.verb import main

PREFIX = Path(__file__).parents[3] / "fixtures" / "demo_ws"
TIMER = """
launch:
- group:
  - push_ros_namespace: {namespace: grp}
  - timer: {period: 1.0, children: [{node: {pkg: demo_nodes, exec: talker, name: late}}]}
"""


@pytest.fixture
def launch(tmp_path: Path) -> list[str]:
    (tmp_path / "a.launch.yaml").write_text(TIMER)
    return ["--prefix", str(PREFIX), str(tmp_path / "a.launch.yaml")]


def test_an_upgrade_moves_a_node_to_another_name_and_enclave(
    launch: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["diff", "--distro", "jazzy@2025-03", "--against", "jazzy", *launch]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert {"+ node /grp/late", "- node /late", "+ enclave /grp"} <= set(lines)


def test_a_newer_distribution_brings_services_that_every_node_has(
    launch: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["diff", "--distro", "humble@2025-03", "--against", "jazzy@2025-03", *launch]) == 1
    assert "+   serve services /late/get_type_description" in capsys.readouterr().out


def test_the_same_release_differs_in_nothing(launch: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", "--distro", "jazzy", "--against", "jazzy", "--format", "json", *launch]) == 0
    document = json.loads(capsys.readouterr().out)
    assert not document["nodes_added"] and not document["enclaves"]


def test_the_versions_of_a_robot_are_another_release(
    launch: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "robot.txt").write_text("ii  ros-jazzy-launch  3.4.4-1noble  amd64\n")
    assert main(["diff", "--distro", "jazzy", "--against", str(tmp_path / "robot.txt"), *launch]) == 1
    assert "- node /grp/late" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--against", "jazy", "x.launch.xml"], "did you mean 'jazzy'"),
        (["--against", "jazzy", "plan.json"], "--against compares one launch file"),
        (["--against", "jazzy", "main:x.launch.xml"], "--against compares one launch file"),
        (["x.launch.xml"], "name what it is compared with"),
    ],
)
def test_a_slip_is_answered(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", *words]) == 2
    assert message in capsys.readouterr().err
