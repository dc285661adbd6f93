"""Loading components and lifecycle transitions through rclpy, with a ROS of one process in its place.

The stand-in answers ``load_node`` and ``change_state`` as a container and a lifecycle node do, and publishes the
transition. The launch, its events and our own node's thread are real.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from enclave_launch.process import ResolvedProcess
from enclave_launch.runtime.gate import LateProcess, StartAdditions
from enclave_launch.runtime.live_launch import run_launch
from enclave_launch.runtime.run_options import RunOptions

pytestmark = pytest.mark.usefixtures("ros_log_dir", "small_ros")

RCLPY = """
import os, threading, time
from types import SimpleNamespace

log = []  # what was asked of ROS, in order
ready_after = time.monotonic() + 0.6  # services appear late, as in life

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
        time.sleep(min(timeout_sec, max(0.0, ready_after - time.monotonic())))
        return time.monotonic() >= ready_after
    def call_async(self, request):
        return Future(self.node.answer(self.kind.__name__, self.name, request))

class Node:
    def __init__(self, name):
        self.subscriptions = {}
        log.append(("node", name))
    def create_client(self, kind, name):
        return Client(self, kind, name)
    def destroy_client(self, client):
        pass
    def destroy_node(self):
        pass
    def create_subscription(self, kind, topic, callback, depth):
        self.subscriptions[topic] = callback
    def answer(self, kind, service, request):
        if kind == "LoadNode":
            log.append((service, request.package_name, request.plugin_name, request.node_name, request.remap_rules))
            works = request.plugin_name != "demo::Broken"
            return SimpleNamespace(success=works, full_node_name=f"/{request.node_name}" if works else "",
                                   error_message="" if works else "no such class")
        log.append((service, request.transition.id))
        labels = {1: ("configuring", "inactive"), 3: ("activating", "active")}
        start, goal = labels[request.transition.id]
        self.subscriptions[service.replace("change_state", "transition_event")](SimpleNamespace(
            timestamp=0, transition=SimpleNamespace(label="x"),
            start_state=SimpleNamespace(label=start), goal_state=SimpleNamespace(label=goal)))
        return SimpleNamespace(success=True)

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
class {name}:
    class Request(SimpleNamespace):
        def __init__(self): super().__init__(transition=SimpleNamespace(id=0))
"""

MESSAGES = """
from enclave_launch.description.lifecycle_msgs import *
class TransitionEvent: ...
"""


@pytest.fixture
def small_ros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    files = {
        "rclpy/__init__.py": RCLPY,
        "rclpy/executors.py": EXECUTORS,
        "rclpy/parameter.py": PARAMETER,
        "composition_interfaces/__init__.py": "",
        "composition_interfaces/srv.py": REQUESTS.format(name="LoadNode"),
        "lifecycle_msgs/__init__.py": "",
        "lifecycle_msgs/srv.py": REQUESTS.format(name="ChangeState"),
        "lifecycle_msgs/msg.py": MESSAGES,
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
        "from launch import LaunchDescription\n"
        "from launch.actions import *\nfrom launch.events import Shutdown as ShutdownEvent\n"
        "from launch_ros.actions import *\nfrom launch_ros.descriptions import ComposableNode\n"
        "from launch_ros.event_handlers import OnStateTransition\nfrom launch_ros.events.lifecycle import ChangeState\n"
        "from launch_ros.events.matchers import matches_node_name\n"
        f"def generate_launch_description():\n    return LaunchDescription([{actions}])\n"
    )
    return run_launch(file, gate=gate, options=RunOptions(needs_ros_services=True))


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


def component(name: str, plugin: str = "demo::X") -> str:
    return f'ComposableNode(package="demo", plugin="{plugin}", name="{name}", remappings=[("a", "b")])'


def test_components_are_loaded_in_order_and_failures_are_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    nodes = ", ".join([component("one"), component("two", "demo::Broken"), component("three")])
    assert launched(tmp_path, CONTAINER.format(nodes=nodes, period=1.5)) == 0
    loads = [entry for entry in asked() if entry[0] == "/box/_container/load_node"]
    assert [entry[3] for entry in loads] == ["one", "two", "three"]
    assert loads[0][1:] == ("demo", "demo::X", "one", ["a:=b"])
    shown = capfd.readouterr().out
    assert "[INFO] [launch]: Loaded node '/one' in container '/box'" in shown
    assert "Failed to load node 'two' of type 'demo::Broken' in container '/box': no such class" in shown


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


def test_shutdown_does_not_wait_for_a_container_that_never_comes(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    sys.modules.pop("rclpy", None)
    import rclpy

    rclpy.ready_after += 1000
    actions = f"""LoadComposableNodes(target_container="/nowhere", composable_node_descriptions=[{component("one")}]),
        TimerAction(period=0.3, actions=[Shutdown()])"""
    assert launched(tmp_path, actions) == 0
    assert "Abandoning wait for the '/nowhere/_container/load_node' service" in capfd.readouterr().out


def test_lifecycle_transitions_and_their_events(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    actions = """*(
        node := LifecycleNode(executable="/bin/sh", arguments=["-c", "exec sleep 60"], name="motor", namespace="/arm"),
        EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_node_name("/arm/motor"), transition_id=1)),
        RegisterEventHandler(OnStateTransition(target_lifecycle_node=node, goal_state="inactive", entities=[
            LogInfo(msg="motor is inactive"),
            EmitEvent(event=ShutdownEvent(reason="done")),
        ])),
    )"""
    assert launched(tmp_path, actions) == 0
    assert ("/arm/motor/change_state", 1) in asked()
    assert "[INFO] [launch.user]: motor is inactive" in capfd.readouterr().out
