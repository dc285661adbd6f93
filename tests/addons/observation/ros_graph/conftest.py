"""Real rclpy nodes in an ament prefix, started by ``secure-launch`` on loopback, and the graph as rclpy shows it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from tests.addons.recording.conftest import prefix_of_rclpy, rclpy_python
from tests.dds.conftest import domain_id as domain_id

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
LISTS = ("publish", "subscribe", "serve_services", "call_services", "serve_actions", "call_actions")

Names = dict[str, dict[str, dict[str, str]]]  # node -> list -> name -> type


class Compared(NamedTuple):
    planned: Names
    seen: Names
    shown: str


Compare = Callable[..., Compared]


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    folder = tmp_path / "prefix"
    shutil.copytree(HERE / "nodes", folder / "lib" / "graph_nodes")
    marker = folder / "share" / "ament_index" / "resource_index" / "packages" / "graph_nodes"
    marker.parent.mkdir(parents=True)
    marker.touch()
    return folder


@pytest.fixture
def environment(tmp_path: Path, domain_id: int) -> dict[str, str]:
    """Real rclpy first on the path; nothing leaves this machine, and no other test's nodes are met."""
    python = rclpy_python("jazzy")
    return {
        **os.environ,
        "PATH": f"{python.parent}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "ROS_DISTRO": "jazzy",
        "AMENT_PREFIX_PATH": str(prefix_of_rclpy("jazzy", tmp_path / "rcl")),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(domain_id),
        "ROS_LOG_DIR": str(tmp_path / "log"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }


@pytest.fixture
def compare(tmp_path: Path, prefix: Path, environment: dict[str, str]) -> Compare:
    """``compare(elements)`` plans a launch file, runs it without enclaves and looks at the graph meanwhile."""

    def run(elements: str) -> Compared:
        file = tmp_path / "graph.launch.xml"
        file.write_text(f"<launch>\n{elements}\n</launch>\n")
        command = [sys.executable, "-m", "enclave_launch", "--prefix", str(prefix)]
        dry = [*command, "--dry-run", "--format", "json", str(file)]
        plan = json.loads(
            subprocess.run(dry, env=environment, capture_output=True, text=True, check=True).stdout
        )
        planned = _planned(plan)
        with subprocess.Popen(
            [*command, "-n", str(file)],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as launch:
            try:
                python = str(rclpy_python("jazzy"))
                looked = [python, str(HERE / "observer.py"), *planned]
                graph = subprocess.run(
                    looked, env=environment, capture_output=True, text=True, timeout=120, check=True
                )
            finally:
                launch.send_signal(2)
                shown = launch.communicate(timeout=60)[0]
        return Compared(planned, _seen(json.loads(graph.stdout)), shown)

    return run


def _planned(plan: dict[str, Any]) -> Names:
    nodes: Names = {}
    for node in plan["nodes"]:
        lists = nodes.setdefault(node["fqn"], {name: {} for name in LISTS})
        for interface in node["interfaces"]:
            lists[interface["operation"]][interface["name"]] = interface["type"]
    return nodes


def _seen(graph: dict[str, Any]) -> Names:
    """Actions as actions: the graph lists their parts among topics and services, too."""
    return {
        fqn: {
            name: {topic: types[0] for topic, types in found if "/_action/" not in topic}
            for name, found in lists.items()
        }
        for fqn, lists in graph.items()
    }
