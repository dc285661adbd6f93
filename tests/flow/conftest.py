"""What the tests of the whole flow share: the demo workspace and ``secure-launch`` as a user calls it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_launch import LaunchPlan, ResolveOptions, resolve
from enclave_launch.policy.derivation import allowed_names

DEMO = Path(__file__).parents[2] / "fixtures" / "demo_ws"

SecureLaunch = Callable[..., "subprocess.CompletedProcess[str]"]
Launch = Callable[..., LaunchPlan]


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """``write(text)`` keeps the content of a ``<launch>`` element as a launch file; other names as they are."""

    def write_file(text: str, name: str = "test.launch.xml") -> Path:
        path = tmp_path / name
        path.write_text(f"<launch>\n{text}\n</launch>\n" if name.endswith(".launch.xml") else text)
        return path

    return write_file


@pytest.fixture
def secure_launch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SecureLaunch:
    """Run the command in a directory and home of its own, with the demo workspace as the only prefix."""
    for name in (
        "ROS_SECURITY_KEYSTORE",
        "ROS_SECURITY_ENABLE",
        "AMENT_PREFIX_PATH",
        "ROS_DISTRO",
        "ROS_DOMAIN_ID",
    ):
        monkeypatch.delenv(name, raising=False)
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))

    def run(*words: object, **options: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "enclave_launch", "--prefix", str(DEMO), *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, cwd=home, timeout=60, check=False)

    return run


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    return tmp_path / "install"


@pytest.fixture
def launch(tmp_path: Path, prefix: Path, monkeypatch: pytest.MonkeyPatch) -> Launch:
    """Plan a launch of ``<node .../>`` elements with the packages installed in ``prefix``; keywords are options."""
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)

    def plan(text: str, **options: Any) -> LaunchPlan:
        file = tmp_path / "t.launch.xml"
        file.write_text(f"<launch>{text}</launch>")
        given = {"distro": "jazzy", "allow_missing_packages": True, **options}
        prefixes = (prefix,) if prefix.exists() else ()
        return resolve(file, options=ResolveOptions(prefixes=prefixes, **given))

    return plan


def allowed(plan: LaunchPlan, kind: str) -> list[str]:
    """The names of one list in all enclaves, without what every node has."""
    return sorted(
        name
        for enclave in plan.derived.policy.enclaves
        for name in allowed_names(enclave)[kind]
        if (kind, name) not in plan.derived.built_in_names(enclave.path)
    )
