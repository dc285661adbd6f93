"""A manifest that inference wrote, under a launch whose source went on: what it hides is said."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from enclave_launch.diagnostics import Code
from nodl.verb import main as secure_nodl

from .conftest import SecureLaunch

NODE = """#!/usr/bin/env python3
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

rclpy.init()
node = Node("camera")
node.create_publisher(String, "image", 10)
# more
"""
STOP = 'node.create_publisher(String, "stop", 10)'
LAUNCH = '<launch><node pkg="robot" exec="camera" name="camera"/></launch>'


class Robot:
    """A prefix with one node, and a manifest written from its source."""

    def __init__(self, folder: Path, *, text: str = NODE) -> None:
        self.folder = folder
        self.prefix = folder / "robot_ws"
        self.script = self.prefix / "lib" / "robot" / "camera"
        self.manifest = folder / "nodl" / "camera.nodl.yaml"
        self.script.parent.mkdir(parents=True)
        index = self.prefix / "share" / "ament_index" / "resource_index" / "packages" / "robot"
        index.parent.mkdir(parents=True)
        index.touch()
        (folder / "robot.launch.xml").write_text(LAUNCH)
        self.write(text)
        words = ["infer", "robot", "--prefix", str(self.prefix), "-o", str(folder / "nodl")]
        assert secure_nodl([*words, "--all"]) == 0

    def write(self, text: str) -> None:
        self.script.write_text(text)
        self.script.chmod(0o755)

    @property
    def words(self) -> tuple[str, ...]:
        nodl = str(self.folder / "nodl")
        return ("--nodl", nodl, "--prefix", str(self.prefix), str(self.folder / "robot.launch.xml"))

    def ask(self, *command: str) -> str:
        module = "enclave_launch" if command[0] == "--dry-run" else "enclave_addons.review.verb"
        words = [sys.executable, "-m", module, *command, *self.words]
        done = subprocess.run(words, capture_output=True, text=True, cwd=self.folder, timeout=60, check=False)
        return done.stdout + done.stderr


@pytest.fixture
def robot(tmp_path: Path, secure_launch: SecureLaunch) -> Iterator[Robot]:
    yield Robot(tmp_path)


def test_a_publisher_added_to_the_source_is_named_by_plan_check_and_diff(robot: Robot) -> None:
    (robot.folder / "before.json").write_text(robot.ask("--dry-run", "--format", "json"))
    assert "changed since" not in robot.ask("--dry-run")
    assert Code.MANIFEST_OUTDATED not in robot.ask("check")
    robot.write(NODE.replace("# more", STOP))
    without = ("--dry-run", "--missing-nodl", "error")
    for command in (("--dry-run",), without, ("check",), ("diff", "before.json")):
        said = robot.ask(*command)
        assert "the source of robot/camera has changed since its manifest" in said
        assert "the manifest lacks, so it is not permitted: publish /stop" in said
    assert "publish: /image\n" in robot.ask("--dry-run"), "what the manifest says is what is permitted"


def test_a_change_that_needs_no_other_right_is_not_reported(robot: Robot) -> None:
    robot.write(NODE.replace("# more", "print('hello')"))
    assert "changed since" not in robot.ask("--dry-run")


def test_a_right_that_the_source_no_longer_needs_is_named(robot: Robot) -> None:
    robot.write(NODE.replace('"image"', '"picture"'))
    said = robot.ask("--dry-run")
    assert "not permitted: publish /picture" in said and "only the manifest has: publish /image" in said


def test_a_change_that_leaves_something_open_is_reported(robot: Robot) -> None:
    robot.write(NODE.replace("# more", "node.create_publisher(String, open('name').read(), 10)"))
    assert "the source leaves open: " in robot.ask("--dry-run")


def test_gaps_that_a_person_closed_are_not_opened_again_until_the_source_changes(
    tmp_path: Path, secure_launch: SecureLaunch
) -> None:
    robot = Robot(
        tmp_path, text=NODE.replace("# more", "node.create_publisher(String, open('name').read(), 10)")
    )
    text = robot.manifest.read_text()
    assert "gaps:" in text
    lines = [line for line in text.splitlines(keepends=True) if "gaps:" not in line and "{why:" not in line]
    robot.manifest.write_text("".join(lines))
    said = robot.ask("--dry-run")
    assert "changed since" not in said and "error" not in said
    robot.write(robot.script.read_text() + "# a change\n")
    assert "changed since" in robot.ask("--dry-run")


def test_inference_writes_what_a_launch_would_refuse_and_the_rest_on_request(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    out = robot.folder / "out"
    words = ["infer", "robot", "--prefix", str(robot.prefix), "-o", str(out)]
    assert secure_nodl(words) == 0
    assert not list(out.iterdir())
    told = "not written: robot/camera: a plan reads this from the source by itself (--all)"
    assert told in capsys.readouterr().err
    assert secure_nodl([*words, "--all"]) == 0
    assert [file.name for file in out.iterdir()] == ["camera.nodl.yaml"]
    robot.write(NODE.replace("# more", "node.create_publisher(String, open('name').read(), 10)"))
    for file in out.iterdir():
        file.unlink()
    assert secure_nodl(words) == 0
    assert "note: robot/camera has 1 open question, under gaps in its manifest" in capsys.readouterr().err
    assert "gaps:" in (out / "camera.nodl.yaml").read_text()
