"""The versions of a robot, and what in a launch file hangs on versions that are assumed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from enclave_launch.evaluation.evaluate import evaluate
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.ros_rules.distro import Distro, choose_release, list_versions, read_versions, release_of
from enclave_launch.verb.secure_launch import main

DPKG = """Desired=Unknown/Install/Remove/Purge/Hold
||/ Name                         Version                          Architecture Description
ii  ros-jazzy-launch             3.4.4-1noble.20250402.120000     amd64        The ROS launch tool.
ii  ros-jazzy-launch-ros         0.26.6-1noble.20250402.130000    amd64        ROS specific.
ii  ros-jazzy-launch-testing     3.4.9-1noble.20250402.130000     amd64        Tests.
ii  ros-jazzy-rcl:amd64          9.2.7-1noble.20250623.140000     amd64        The ROS client library.
"""
TIMER = """
launch:
- group:
  - push_ros_namespace: {namespace: grp}
  - timer: {period: 1.0, children: [{node: {pkg: pk, exec: e, name: late}}]}
"""


def test_the_list_of_a_robot_is_read() -> None:
    assert read_versions(DPKG) == (
        Distro.JAZZY, (("launch", "3.4.4"), ("launch_ros", "0.26.6"), ("rcl", "9.2.7"))
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no package such as ros-jazzy-launch"),
        ("ii  ros-jazzy-nav2-core  1.2.3-1", "no package such as ros-jazzy-launch"),
        ("ii  ros-jazzyish-launch  1.2.3-1", "no package such as ros-jazzy-launch"),
        (DPKG + "ii  ros-humble-rcl  5.3.9-1", "packages of jazzy and humble"),
    ],
)
def test_a_list_that_does_not_say_it_is_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_versions(text)


def test_what_is_listed_as_installed_is_read_back() -> None:
    release = release_of(Distro.KILTED, (3, 8, 2), rcl=(10, 1, 5))
    assert read_versions(list_versions(release)) == (Distro.KILTED, (("launch", "3.8.2"), ("rcl", "10.1.5")))
    assert not list_versions(release_of(Distro.KILTED))


def test_given_versions_decide_and_the_others_are_assumed() -> None:
    release = choose_release("jazzy", None, (), (("launch", "3.4.4"),))
    assert str(release).startswith("jazzy; given: launch 3.4.4; assumed: launch_ros")


@pytest.mark.parametrize(
    ("distro", "versions", "hanging"),
    [
        ("jazzy", (), ["timers keep the namespace and configurations of their position"]),
        ("jazzy", (("launch", "3.4.12"),), []),
        ("jazzy", (("rcl", "9.2.7"),), ["timers keep the namespace and configurations of their position"]),
        ("lyrical", (), []),
    ],
)
def test_a_difference_hangs_on_a_version_that_is_assumed(
    tmp_path: Path, distro: str, versions: tuple[tuple[str, str], ...], hanging: list[str]
) -> None:
    file = tmp_path / "a.launch.yaml"
    file.write_text(TIMER)
    found = evaluate(file, host=PlanHost(distro=distro, versions=versions, allow_missing_packages=True))
    assert [each.what for each in found.uncertain] == hanging


def test_a_launch_file_without_the_difference_does_not_hang_on_it(tmp_path: Path) -> None:
    file = tmp_path / "a.launch.xml"
    file.write_text('<launch><arg name="a" default="1"/><node pkg="pk" exec="e" respawn="true"/></launch>')
    for distro in ("humble", "jazzy", "kilted"):
        assert not evaluate(file, host=PlanHost(distro=distro, allow_missing_packages=True)).uncertain


def test_tree_and_json_say_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.launch.yaml").write_text(TIMER)
    words = ["--dry-run", "--allow-missing-packages", "--distro", "jazzy", str(tmp_path / "a.launch.yaml")]
    assert main(words) == 0
    assert "hanging on them: timers keep the namespace" in " ".join(capsys.readouterr().out.split())
    assert main([*words, "--format", "json"]) == 0
    release = json.loads(capsys.readouterr().out)["release"]
    assert release["assumed"] == ["launch", "launch_ros", "rcl"]
    assert [(each["package"], each["since"]) for each in release["hanging"]] == [("launch", "3.4.5")]


def test_a_file_of_versions_stands_for_a_distribution(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.launch.yaml").write_text(TIMER)
    (tmp_path / "robot.txt").write_text(DPKG)
    words = ["--dry-run", "--allow-missing-packages", "--versions", str(tmp_path / "robot.txt")]
    assert main([*words, str(tmp_path / "a.launch.yaml")]) == 0
    out = capsys.readouterr().out
    assert "as jazzy; given: launch 3.4.4, launch_ros 0.26.6, rcl 9.2.7" in " ".join(out.split())
    assert "as /late" in out
    assert main([*words, "--distro", "humble", str(tmp_path / "a.launch.yaml")]) == 2
    assert "is of jazzy: it is given in place of --distro humble" in capsys.readouterr().err
