"""The launcher's own ROS node on real rclpy: it drives a real lifecycle node and hears its transitions."""

from __future__ import annotations

import subprocess
from pathlib import Path

from tests.addons.recording.conftest import rclpy_python

LAUNCH = """
from launch import LaunchDescription
from launch.actions import EmitEvent, LogInfo, RegisterEventHandler
from launch.events import Shutdown
from launch_ros.actions import LifecycleNode
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from launch_ros.events.matchers import matches_node_name

def generate_launch_description():
    motor = LifecycleNode(package="graph_nodes", executable="motor", name="motor", namespace="/arm")
    def change(transition):
        return EmitEvent(event=ChangeState(
            lifecycle_node_matcher=matches_node_name("/arm/motor"), transition_id=transition))
    def on(state, *entities):
        return RegisterEventHandler(OnStateTransition(
            target_lifecycle_node=motor, goal_state=state, entities=list(entities)))
    return LaunchDescription([
        on("inactive", LogInfo(msg="motor is inactive"), change(3)),
        on("active", LogInfo(msg="motor is active"), EmitEvent(event=Shutdown(reason="done"))),
        motor,
        change({first}),
    ])
"""


def launched(tmp_path: Path, prefix: Path, environment: dict[str, str], text: str) -> str:
    file = tmp_path / "lifecycle.launch.py"
    file.write_text(text)
    command = [rclpy_python("jazzy"), "-m", "enclave_launch", "-n", "--prefix", prefix, file]
    ran = subprocess.run(
        [*map(str, command)], env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    return ran.stdout + ran.stderr


def test_a_lifecycle_node_is_configured_and_activated(
    tmp_path: Path, prefix: Path, environment: dict[str, str]
) -> None:
    shown = launched(tmp_path, prefix, environment, LAUNCH.replace("{first}", "1"))
    assert "motor is inactive" in shown
    assert "motor is active" in shown


def test_a_transition_that_the_node_refuses_is_told_and_nothing_follows(
    tmp_path: Path, prefix: Path, environment: dict[str, str]
) -> None:
    """Activating what was never configured; a timer of the test's own ends the launch."""
    text = LAUNCH.replace("{first}", "3")
    text = text.replace(
        "motor,\n", "motor, TimerAction(period=8.0, actions=[EmitEvent(event=Shutdown())]),\n"
    )
    text = text.replace("RegisterEventHandler\n", "RegisterEventHandler, TimerAction\n", 1)
    shown = launched(tmp_path, prefix, environment, text)
    assert "motor is active" not in shown
    assert "/arm/motor" in shown
