"""Commands of ``ros2`` that a launch file runs as processes."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch import ResolveOptions, resolve
from enclave_launch.diagnostics import Code
from enclave_launch.ros_rules.ros2_command import instead_of, participant_command


@pytest.mark.parametrize(
    ("words", "shell", "found"),
    [
        (["ros2", "topic", "pub", "/go", "std_msgs/msg/Empty"], False, "topic"),
        (["/opt/ros/jazzy/bin/ros2", "run", "bot", "talker"], False, "run"),
        (["ros2 service call /reset std_srvs/srv/Empty"], True, "service"),
        (["sleep 5; ros2 lifecycle set /n configure"], True, "lifecycle"),
        (["bash", "-c", "sleep 1 && exec ros2 param set /n p 1"], False, "param"),
        (["ros2", "bag", "record", "-a"], False, "bag"),
        (["ros2", "bag", "info", "x"], False, None),
        (["ros2", "pkg", "prefix", "bot"], False, None),
        (["ros2"], False, None),
        (["ros2", "--help"], False, None),
        (["echo", "ros2", "topic", "list"], False, None),
        (["echo ros2 topic list"], True, None),
        (["echo 'unclosed"], True, None),
    ],
)
def test_which_commands_make_a_participant(words: list[str], shell: bool, found: str | None) -> None:
    command = participant_command(words, shell=shell)
    assert (command[1] if command else None) == found


def test_each_gets_its_remedy() -> None:
    assert '<node pkg="bot" exec="talker"/>' in instead_of(("ros2", "run", "bot", "talker"))
    assert "<include" in instead_of(("ros2", "launch", "bot", "x.launch.py"))
    assert "policy file" in instead_of(("ros2", "topic", "pub", "/go"))
    assert "instead of -a" in instead_of(("ros2", "bag", "record", "-a"))


@pytest.mark.parametrize(
    ("element", "is_refused"),
    [
        ('<executable cmd="ros2 topic pub /go std_msgs/msg/Empty"/>', True),
        ('<executable cmd="ros2 topic pub /go std_msgs/msg/Empty" enclave="/tool"/>', False),
        ('<executable cmd="echo ros2 topic pub"/>', False),
    ],
)
def test_without_an_enclave_it_stops_a_secured_start(element: str, is_refused: bool, tmp_path: Path) -> None:
    file = tmp_path / "x.launch.xml"
    file.write_text(f"<launch>{element}</launch>")
    problems = resolve(file, options=ResolveOptions(distro="jazzy")).problems
    assert [each.code for each in problems] == ([Code.COMMAND_NEEDS_ENCLAVE] if is_refused else [])
