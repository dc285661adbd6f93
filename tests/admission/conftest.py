"""Launch files in a few words, planned as ``--secure`` would plan them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_launch import LaunchPlan, ResolveOptions, resolve

DEMO = Path(__file__).parents[2] / "fixtures" / "demo_ws"

Plan = Callable[..., LaunchPlan]
VARIABLES = (
    "RMW_IMPLEMENTATION",
    "ROS_DOMAIN_ID",
    "CYCLONEDDS_URI",
    "ROS_SECURITY_ENCLAVE_OVERRIDE",
    "ROS_DISTRO",
)


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Plan:
    """``plan(text)``: of the content of ``<launch>``, or of a Python file that defines ``entities``."""
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)

    def make(text: str, **options: Any) -> LaunchPlan:
        if text.lstrip().startswith("<"):
            file = tmp_path / "test.launch.xml"
            file.write_text(f"<launch>\n{text}\n</launch>")
        else:
            file = tmp_path / "test.launch.py"
            file.write_text(
                "from launch import LaunchDescription\nfrom launch.actions import *\nfrom launch_ros.actions import *\n"
                f"{text}\ndef generate_launch_description():\n    return LaunchDescription(entities)\n"
            )
        return resolve(file, options=ResolveOptions(prefixes=(DEMO,), **options))

    return make
