"""What a program hears of the nodes of a launch that it has started: every endpoint as an event, and readiness by it.

The examples are a user's: a blocking program, one on asyncio, a pytest fixture.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from enclave_launch import (
    ResolveOptions,
    RunningLaunch,
    RunSettings,
    RuntimeFailure,
    endpoint_seen,
    launch_source,
    provision,
    resolve,
    start,
    start_unsecured,
)
from enclave_launch.plan import LaunchSource
from enclave_launch.runtime.run_events import EndpointCreated, EndpointRefused, LaunchOver, RunEvent
from nodl.node_interface import EndpointKind
from tests.addons.recording.conftest import rclpy_python
from tests.addons.recording.stand_in_launch import PACKAGE, Program, Workspace, make_workspace

pytestmark = pytest.mark.usefixtures("own_folders")

STRING = "std_msgs/msg/String"
TALKER = Program(
    "talker",
    f"node talker\npublisher chatter {STRING}\nservice_server ~/reset std_srvs/srv/Empty\nwait\n",
    (("publisher", "chatter"), ("service_server", "~/reset")),
    'name="t" namespace="/robot"',
    '<remap from="chatter" to="news"/>',
)


@pytest.fixture
def own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))


def source(workspace: Workspace) -> LaunchSource:
    file = workspace.folder / "share" / PACKAGE / "launch" / "all.launch.xml"
    return launch_source(file, options=options(workspace))


def options(workspace: Workspace) -> ResolveOptions:
    return ResolveOptions(prefixes=(workspace.folder,), distro="jazzy")


@pytest.fixture
def launch(stand_in: Path, tmp_path: Path) -> Iterator[RunningLaunch]:
    """As a test of one's own robot would have it: up before the test, down behind it."""
    workspace = make_workspace(tmp_path, stand_in, [TALKER])
    with start_unsecured(source(workspace), options=RunSettings(record=True)) as running:
        running.wait_until(endpoint_seen("talker-1", "/robot/t/reset"), timeout=30)
        yield running


def test_readiness_by_an_endpoint_under_pytest(launch: RunningLaunch) -> None:
    seen = {
        (each.node, each.kind, each.name, each.written, each.type)
        for each in launch.processes["talker-1"].endpoints
    }
    assert ("/robot/t", EndpointKind.PUBLISHER, "/robot/news", "chatter", STRING) in seen
    assert endpoint_seen("talker-1", "/robot/news", kind=EndpointKind.PUBLISHER, node="/robot/t")(launch)
    assert not endpoint_seen("talker-1", "/robot/news", kind=EndpointKind.SUBSCRIPTION)(launch)
    assert not endpoint_seen("talker-1", "/robot/news", node="/robot/other")(launch)
    assert not endpoint_seen("talker-1", "/robot/chatter")(launch), "its final name is another"
    assert not endpoint_seen("talker-2", "/robot/news")(launch)


def test_events_of_a_program_that_ends_at_once_come_before_the_end_of_the_launch(
    stand_in: Path, tmp_path: Path
) -> None:
    short = Program(
        "short", f"node short\npublisher a {STRING}\naction_server act test_msgs/action/Fibonacci\n"
    )
    with start_unsecured(
        source(make_workspace(tmp_path, stand_in, [short])), options=RunSettings(record=True)
    ) as running:
        events = list(running.events())
    assert isinstance(events[-1], LaunchOver)
    own = [each for each in created(events) if each.endpoint.name in ("/a", "/act")]
    assert [(each.name, each.endpoint.kind.value) for each in own] == [
        ("short-1", "publisher"),
        ("short-1", "action_server"),
    ]
    assert not any("/_action/" in each.endpoint.name for each in created(events)), "an action is one endpoint"


def created(events: list[RunEvent]) -> list[EndpointCreated]:
    return [each for each in events if isinstance(each, EndpointCreated)]


def test_a_refused_endpoint_is_an_event_of_a_secured_launch_without_being_asked_for(
    stand_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STAND_IN_CATCHES", "1")
    script = f"node bold\npublisher granted {STRING}\nsubscription secret {STRING}\n"
    workspace = make_workspace(tmp_path, stand_in, [Program("bold", script, (("publisher", "granted"),))])
    secured = provision(resolve(source(workspace).launch_file, options=options(workspace)), tmp_path / "ks")
    with start(secured) as running:
        events = list(running.events())
    refused = [each for each in events if isinstance(each, EndpointRefused)]
    assert [(each.name, each.endpoint.kind, each.endpoint.name) for each in refused] == [
        ("bold-1", EndpointKind.SUBSCRIPTION, "/secret")
    ]
    assert refused[0].reason[0] == "failed to create topic [rt/secret] for unknown reasons"
    assert "/granted" in [each.endpoint.name for each in created(events)]
    assert "refused: node /bold may not subscribe to topic /secret" in capfd.readouterr().out


def test_a_respawned_process_shows_the_endpoints_of_its_latest_life(stand_in: Path, tmp_path: Path) -> None:
    script = f"node a\npublisher a {STRING}\n"
    workspace = make_workspace(tmp_path, stand_in, [Program("again", script, attributes='respawn="true"')])
    with start_unsecured(source(workspace), options=RunSettings(record=True)) as running:
        pids = set()
        for event in running.events():
            if isinstance(event, EndpointCreated) and event.endpoint.name == "/a":
                pids.add(event.pid)
                names = [each.name for each in running.processes["again-1"].endpoints]
                assert names.count("/a") <= 1
            if len(pids) == 2:
                break


def test_what_nobody_records_is_said_to_be_unknown(stand_in: Path, tmp_path: Path) -> None:
    workspace = make_workspace(tmp_path, stand_in, [TALKER])
    with start_unsecured(source(workspace)) as running:
        assert not running.is_recorded
        with pytest.raises(RuntimeFailure, match=r"not recorded; start it with RunSettings\(record=True\)"):
            running.wait_until(endpoint_seen("talker-1", "/robot/news"), timeout=30)


def test_a_launch_that_must_be_recorded_and_cannot_is_not_started(
    stand_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    workspace = make_workspace(tmp_path, stand_in, [TALKER])
    with pytest.raises(RuntimeFailure, match="nothing can be recorded: recording needs a C compiler"):
        start_unsecured(source(workspace), options=RunSettings(record=True))


def test_real_rclpy_on_asyncio(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A node and its action, from real rclpy; the program's own loop goes on while it waits."""
    python = rclpy_python("jazzy")
    monkeypatch.setenv("PATH", f"{python.parent}:{os.environ['PATH']}")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    script = tmp_path / "node.py"
    script.write_text(
        "import rclpy\nfrom rclpy.executors import ExternalShutdownException\nfrom rclpy.node import Node\n"
        "from std_msgs.msg import String\nrclpy.init()\nnode = Node('py')\n"
        "node.create_publisher(String, '~/out', 1)\n"
        "try:\n    rclpy.spin(node)\nexcept (KeyboardInterrupt, ExternalShutdownException):\n    pass\n"
    )
    file = tmp_path / "py.launch.xml"
    arguments = "--ros-args -r __node:=renamed -r __ns:=/robot"
    file.write_text(
        f"<launch><executable name='py' cmd=\"'{python}' {script} {arguments}\" output='screen'/></launch>"
    )

    async def main() -> int:
        launch = start_unsecured(launch_source(file), options=RunSettings(record=True))
        try:
            await asyncio.to_thread(launch.wait_until, endpoint_seen("py-1", "/robot/renamed/out"), 60)
        finally:
            status = await asyncio.to_thread(launch.stop, timeout=60)
        return status

    assert asyncio.run(main()) == 0
