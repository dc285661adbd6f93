"""A slip in a launch file or on the command line is answered with what was probably meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch.verb.secure_launch import main

DEMO = Path(__file__).parents[2] / "fixtures" / "demo_ws"


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(["--dry-run", "--prefix", str(DEMO), *words]) != 0
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("element", "meant"),
    [
        ('<node pkg="demo_nodes" exec="takler"/>', "talker"),
        ('<node pkg="demo_node" exec="talker"/>', "demo_nodes"),
        ('<ndoe pkg="demo_nodes" exec="talker"/>', "node"),
        ('<node pkg="demo_nodes" exec="$(evn X)"/>', "env"),
        ('<include file="$(find-pkg-share demo_node)/launch/x.launch.xml"/>', "demo_nodes"),
        ('<executable cmd="$(exec-in-pkg lisener demo_nodes)"/>', "listener"),
    ],
)
def test_in_a_launch_file(
    element: str, meant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "slip.launch.xml"
    file.write_text(f"<launch>\n  {element}\n</launch>")
    told = refused(capsys, str(file))
    assert f"did you mean '{meant}'?" in told and f"{file}:2:" in told


@pytest.mark.parametrize(
    ("element", "told"),
    [
        ('<node pkg="demo_nodes" type="talker"/>', 'ROS 2 writes exec="PROGRAM"'),
        ('<node pkg="demo_nodes" exec="talker" ns="left"/>', 'ROS 2 writes namespace="NAMESPACE"'),
        ('<group ns="left"><arg name="a"/></group>', "ROS 2 writes <push_ros_namespace"),
        (
            '<node pkg="demo_nodes" exec="talker"><rosparam file="p.yaml"/></node>',
            'ROS 2 writes <param from="FILE"/>',
        ),
        ('<rosparam file="p.yaml"/>', "<set_parameters_from_file"),
        ('<executable cmd="$(arg a)"/>', "ROS 2 writes $(var NAME)"),
        ('<executable cmd="$(find demo_nodes)/x"/>', "ROS 2 writes $(find-pkg-share PACKAGE)"),
    ],
)
def test_words_of_ros_1_get_those_of_ros_2(
    element: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "old.launch.xml"
    file.write_text(f"<launch>\n  {element}\n</launch>")
    message = refused(capsys, str(file))
    assert "is of ROS 1; ROS 2 writes" in message and told in message
    assert f"{file}:2:" in message and "did you mean" not in message


@pytest.mark.parametrize(
    ("element", "since"),
    [
        (
            '<executable cmd="$(path-join a b)"/>',
            "path-join is there since all of lyrical, launch 3.9.7 in rolling",
        ),
        ('<for len="2" name="i"/>', "for is there since launch 3.8.0 in kilted"),
    ],
)
def test_words_of_a_newer_release_say_since_when(
    element: str, since: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "new.launch.xml"
    file.write_text(f"<launch>\n  {element}\n</launch>")
    message = refused(capsys, "--distro", "jazzy@2024-12", str(file))
    assert since in message and "this file is read as jazzy; assumed: launch 3.4.3" in message
    assert "did you mean" not in message


def test_what_is_like_nothing_gets_no_suggestion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "slip.launch.xml"
    file.write_text('<launch><node pkg="zzz" exec="talker"/></launch>')
    assert "did you mean" not in refused(capsys, str(file))


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["demo_node", "talker_listener.launch.xml"], "demo_nodes"),
        (["demo_nodes", "talker_listner.launch.xml"], "talker_listener.launch.xml"),
        (["--explain", "/talekr", "demo_nodes", "talker_listener.launch.xml"], "/talker"),
        (["--explain", "/chater", "demo_nodes", "talker_listener.launch.xml"], "/chatter"),
    ],
)
def test_on_the_command_line(words: list[str], meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert f"did you mean '{meant}'?" in refused(capsys, *words)


def test_a_launch_file_beside_the_one_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "robot.launch.xml").write_text("<launch/>")
    assert "did you mean 'robot.launch.xml'?" in refused(capsys, str(tmp_path / "robto.launch.xml"))


def test_an_unknown_distribution_in_the_environment_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = ["--dry-run", "--prefix", str(DEMO), "demo_nodes", "talker_listener.launch.xml"]
    monkeypatch.setenv("ROS_DISTRO", "jazy")
    assert main(launch) == 0
    assert "the rules of lyrical are followed" in (told := capsys.readouterr().out)
    assert "did you mean 'jazzy'?" in told
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    assert main(launch) == 0
    assert "warning" not in capsys.readouterr().out
