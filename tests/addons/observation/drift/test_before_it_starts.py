"""What ``--secure --watch`` decides before it touches the keystore: with what it can observe, and in which enclave."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import keystore
from keystore import ProvisionOptions
from keystore.steps.tool_enclaves import WATCHER, provide_watcher
from tests.addons.observation.drift.planned import DEMO_WS, ROOT

WITHOUT_CYCLONE = "import sys\nsys.modules['cyclonedds'] = None\n"
ISOLATED = {
    "rclpy/__init__.py": "",
    "service_msgs/__init__.py": "",
    "service_msgs/msg.py": "raise ModuleNotFoundError('No module named numpy')\n",
}


def watched(folder: Path, files: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Start a secured launch with ``--watch`` where Python finds ``files``."""
    for name, text in {"sitecustomize.py": WITHOUT_CYCLONE, **files}.items():
        path = folder / "python" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    command = [sys.executable, "-m", "enclave_launch", "--prefix", str(DEMO_WS), "--secure", "--watch"]
    command += ["--keystore", str(folder / "ks"), "demo_nodes", "talker_listener.launch.xml"]
    environment = {**os.environ, "PYTHONPATH": str(folder / "python")}
    return subprocess.run(
        command, env=environment, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )


@pytest.mark.parametrize(
    ("files", "said"),
    [({}, "source a ROS 2 workspace"), (ISOLATED, "pipx install --system-site-packages")],
)
def test_without_an_observer_that_works_no_keystore_is_made(
    files: dict[str, str], said: str, tmp_path: Path
) -> None:
    """rclpy of a sourced workspace in an isolated environment: it is found, and its first node wants numpy."""
    ran = watched(tmp_path, files)
    assert ran.returncode != 0 and said in ran.stderr, ran.stderr
    assert "Traceback" not in ran.stderr
    assert not (tmp_path / "ks").exists()


@pytest.mark.parametrize("as_ros_node", [True, False])
def test_the_enclave_of_the_watch_is_for_the_observer_in_use(as_ros_node: bool, tmp_path: Path) -> None:
    """A node of rclpy publishes /rosout before it sees anything; the other observer may publish nothing."""
    keystore.create_keystore(tmp_path / "ks")
    provide_watcher(tmp_path / "ks", ProvisionOptions(), as_ros_node=as_ros_node)
    signed = (tmp_path / "ks" / "enclaves" / WATCHER.lstrip("/") / "permissions.p7s").read_text()
    assert ("<topic>rt/rosout</topic>" in signed) is as_ros_node
    assert "<topic>ros_discovery_info</topic>" in signed
