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
