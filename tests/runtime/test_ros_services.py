"""What stands before the launcher's own calls: its enclave, and the gate before a component.

rclpy's wheels hold a Fast DDS without security: a stand-in answers here, for these two questions alone. Loading and
lifecycle transitions are tested on real rclpy (tests/addons/observation/ros_graph).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from enclave_launch.plan import LaunchSource
from enclave_launch.process import ResolvedProcess
from enclave_launch.runtime.gate import LateProcess, StartAdditions
from enclave_launch.runtime.live_launch import LiveLaunch, run_launch

pytestmark = pytest.mark.usefixtures("ros_log_dir", "small_ros")

RCLPY = """
import os, threading
from types import SimpleNamespace

log = []  # what was asked of ROS, in order

class Context:
    pass

def init(*, args, context):
    log.append(("init", tuple(args), os.environ.get("ROS_SECURITY_ENABLE")))

def shutdown(*, context):
    log.append(("shutdown",))

class Future:
    def __init__(self, result):
        self._result = result
    def add_done_callback(self, callback):
        threading.Timer(0.01, callback, [self]).start()
    def result(self):
        return self._result

class Client:
    def __init__(self, node, kind, name):
        self.node, self.kind, self.name = node, kind, name
    def wait_for_service(self, timeout_sec):
        return True
    def call_async(self, request):
        return Future(self.node.answer(self.kind.__name__, self.name, request))

class Node:
    def __init__(self, name):
        log.append(("node", name))
    def create_client(self, kind, name):
        return Client(self, kind, name)
    def destroy_client(self, client):
        pass
    def destroy_node(self):
        pass
    def answer(self, kind, service, request):
        log.append((service, request.node_name))
        return SimpleNamespace(success=True, full_node_name=f"/{request.node_name}", error_message="")

def create_node(name, *, context):
    return Node(name)
"""

EXECUTORS = """
import time
class SingleThreadedExecutor:
    def __init__(self, *, context): pass
    def add_node(self, node): pass
    def spin_once(self, timeout_sec): time.sleep(timeout_sec)
    def shutdown(self): pass
"""

PARAMETER = """
class Parameter:
    def __init__(self, name, value): self.pair = (name, value)
    def to_parameter_msg(self): return self.pair
"""

REQUESTS = """
from types import SimpleNamespace
class LoadNode:
    Request = SimpleNamespace
"""


@pytest.fixture
def small_ros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    files = {
        "rclpy/__init__.py": RCLPY,
        "rclpy/executors.py": EXECUTORS,
        "rclpy/parameter.py": PARAMETER,
        "composition_interfaces/__init__.py": "",
        "composition_interfaces/srv.py": REQUESTS,
    }
    for name, text in files.items():
        path = tmp_path / "ros" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path / "ros"))
    yield
    for name in [
        name for name in sys.modules if name.partition(".")[0] in {path.split("/")[0] for path in files}
    ]:
        del sys.modules[name]


def asked() -> list[tuple[object, ...]]:
    log: list[tuple[object, ...]] = sys.modules["rclpy"].log
    return log


def launched(tmp_path: Path, actions: str, gate: Gate | None = None) -> int:
    file = tmp_path / "test.launch.py"
    file.write_text(
        "from launch import LaunchDescription\nfrom launch.actions import *\n"
        "from launch_ros.actions import *\nfrom launch_ros.descriptions import ComposableNode\n"
        f"def generate_launch_description():\n    return LaunchDescription([{actions}])\n"
    )
    return run_launch(LiveLaunch(LaunchSource(str(file)), gate=gate, needs_ros_services=True))


class Gate:
    """Everything is permitted but components called ``late``."""

    def granted(self, process: ResolvedProcess) -> StartAdditions | None:
        return StartAdditions()

    def ensure(self, process: ResolvedProcess) -> StartAdditions:
        raise AssertionError("granted at once")

    def ensure_components(self, components: object) -> None:
        if "late" in str(components):
            raise LateProcess("refused: component late")

    def launcher(self) -> StartAdditions | None:
        return StartAdditions(("--enclave", "/launcher"), {"ROS_SECURITY_ENABLE": "true"})


CONTAINER = """ComposableNodeContainer(
    executable="/bin/sh", arguments=["-c", "exec sleep 60"], name="box", namespace="/",
    composable_node_descriptions=[{nodes}]),
    TimerAction(period={period}, actions=[Shutdown()])"""


def component(name: str) -> str:
    return f'ComposableNode(package="demo", plugin="demo::X", name="{name}")'


def test_our_own_node_runs_in_the_launchers_enclave(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_SECURITY_ENABLE", raising=False)
    assert launched(tmp_path, CONTAINER.format(nodes=component("one"), period=1.0), Gate()) == 0
    assert asked()[0] == ("init", ("--ros-args", "--enclave", "/launcher"), "true")
    assert asked()[1] == ("node", "launcher")
    assert asked()[-1] == ("shutdown",)


def test_a_component_that_was_not_planned_ends_the_launch(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert launched(tmp_path, CONTAINER.format(nodes=component("late"), period=5.0), Gate()) == 1
    assert not any(entry[0] == "/box/_container/load_node" for entry in asked())
    assert "refused: component late" in capfd.readouterr().out
