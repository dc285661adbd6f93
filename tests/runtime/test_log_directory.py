"""The log directory, laid out as launch does it."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

import pytest

from enclave_launch import RuntimeFailure
from enclave_launch.description.logging import log_base_directory
from enclave_launch.runtime.launch_log import make_log_directory

NOW = datetime(2024, 2, 3, 4, 5, 6, 78)


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({}, "~/.ros/log"),
        ({"ROS_HOME": "/home/ros"}, "/home/ros/log"),
        ({"ROS_HOME": "", "ROS_LOG_DIR": ""}, "~/.ros/log"),
        ({"ROS_HOME": "/home/ros", "ROS_LOG_DIR": "/var/log/ros/"}, "/var/log/ros"),
        ({"ROS_LOG_DIR": "~/logs/../mine"}, "~/mine"),
    ],
)
def test_base(environment: dict[str, str], expected: str) -> None:
    assert log_base_directory(environment) == os.path.expanduser(expected)


def test_name_and_latest_link(tmp_path: Path) -> None:
    first = make_log_directory(tmp_path / "log", NOW, "robot", 42)
    assert first == tmp_path / "log" / "2024-02-03-04-05-06-000078-robot-42"
    second = make_log_directory(tmp_path / "log", NOW, "robot", 43)
    assert Path(os.readlink(tmp_path / "log" / "latest")) == second
    assert sorted(path.name for path in (tmp_path / "log").iterdir()) == [first.name, second.name, "latest"]


def test_something_else_called_latest_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "latest").mkdir()
    make_log_directory(tmp_path, NOW, "robot", 42)
    assert not (tmp_path / "latest").is_symlink()


def test_a_place_that_cannot_be_written_says_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(RuntimeFailure, match=r"cannot create the log directory .*; set ROS_LOG_DIR"):
        make_log_directory(tmp_path / "file" / "log", NOW, "robot", 42)
