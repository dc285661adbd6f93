"""A launch that runs beside the program that started it: what a test, a console or a robot's main program does."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from pathlib import Path

import pytest

from enclave_launch import RunningLaunch, RuntimeFailure, evaluate_launch, printed, start_unsecured, started
from enclave_launch.plan import LaunchSource
from enclave_launch.runtime import run_events
from enclave_launch.runtime.run_events import LaunchOver, ProcessOutput, RunEvent
from tests.runtime.conftest import alive

pytestmark = pytest.mark.usefixtures("ros_log_dir")


def launched(directory: Path, *commands: str, attributes: str = "") -> RunningLaunch:
    """Each command is a shell's, its process named ``a``, ``b``, ..."""
    elements = "".join(
        f'<executable name="{name}" cmd="{command}" shell="true" output="screen" {attributes}/>'
        for name, command in zip("abc", commands, strict=False)
    )
    file = directory / "test.launch.xml"
    file.write_text(f"<launch>{elements}</launch>")
    return start_unsecured(evaluate_launch(file))


def test_it_runs_beside_the_caller_and_ends_by_itself(tmp_path: Path) -> None:
    launch = launched(tmp_path, "echo hello; exit 3", "true")
    assert launch.wait(20) == 1
    assert launch.exit_status == 1
    assert {name: (p.state, p.returncode, p.failed) for name, p in launch.processes.items()} == {
        "a-1": ("ended", 3, True),
        "b-2": ("ended", 0, False),
    }
    assert launch.processes["a-1"].output == b"hello\n"


def test_readiness_and_stop(tmp_path: Path) -> None:
    launch = launched(tmp_path, "echo ready; exec sleep 60", "exec sleep 60")
    launch.wait_until(printed("a-1", "ready"), 20)
    launch.wait_until(started("b-2"), 20)
    pids = [process.pid for process in launch.processes.values()]
    assert [process.state for process in launch.processes.values()] == ["running", "running"]
    assert all(pid is not None and alive(pid) for pid in pids)
    assert launch.stop(timeout=20) == 0
    assert not any(pid is not None and alive(pid) for pid in pids)
    assert launch.stop(timeout=20) == 0, "to stop what has ended does nothing"


def test_a_condition_of_ones_own(tmp_path: Path) -> None:
    with launched(tmp_path, "true", attributes='respawn="true"') as launch:
        launch.wait_until(
            lambda launch: sum(process.starts for process in launch.processes.values()) >= 3, 20
        )
    assert launch.exit_status is not None


def test_what_does_not_come_true_is_a_timeout_and_after_the_end_a_failure(tmp_path: Path) -> None:
    launch = launched(tmp_path, "read line; echo never")
    with launch:
        with pytest.raises(TimeoutError, match=r"after 0\.2 s"):
            launch.wait_until(printed("a-1"), 0.2)
        with pytest.raises(TimeoutError, match="the launch has not ended"):
            launch.wait(0.1)
    with pytest.raises(RuntimeFailure, match="the launch ended"):
        launch.wait_until(printed("a-1"), 20)


def test_events_from_the_first_to_the_last_also_for_who_comes_late(tmp_path: Path) -> None:
    launch = launched(tmp_path, "echo hello")
    launch.wait(20)
    told = list(launch.events())
    assert [type(event).__name__ for event in told] == [
        "LaunchStarted",
        "ProcessPlanned",
        "ProcessStarted",
        "ProcessOutput",
        "ProcessExited",
        "ProcessOver",
        "LaunchOver",
    ]
    assert ProcessOutput("a-1", "stdout", b"hello\n") in told
    assert told[-1] == LaunchOver(0)


def test_output_as_a_stream_while_it_runs(tmp_path: Path) -> None:
    seen: list[RunEvent] = []
    with launched(tmp_path, "for n in 1 2 3; do echo line $n; sleep 0.05; done; exec sleep 60") as launch:
        for event in launch.events():
            seen.append(event)
            if isinstance(event, ProcessOutput) and b"line 3" in event.data:
                break
        assert launch.exit_status is None
    assert b"".join(e.data for e in seen if isinstance(e, ProcessOutput)) == b"line 1\nline 2\nline 3\n"


def test_memory_is_bounded_whatever_a_process_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    launch = launched(tmp_path, "head -c 50000000 /dev/zero")
    assert launch.wait(60) == 0
    remembered = sum(
        len(event.data) for event in launch.events() if isinstance(event, run_events.ProcessOutput)
    )
    assert 0 < remembered <= 8 << 20
    assert len(launch.processes["a-1"].output) == 64 << 10


def test_in_asyncio_a_thread_waits(tmp_path: Path) -> None:
    async def main() -> int:
        launch = launched(tmp_path, "echo ready; exec sleep 60")
        await asyncio.to_thread(launch.wait_until, printed("a-1", "ready"), 20)
        return await asyncio.to_thread(launch.stop)

    assert asyncio.run(main()) == 0


def test_from_a_thread_that_is_not_the_main_one(tmp_path: Path) -> None:
    ended: list[int] = []
    thread = threading.Thread(target=lambda: ended.append(launched(tmp_path, "true").wait(20)))
    thread.start()
    thread.join()
    assert ended == [0]


def test_what_run_would_refuse_is_refused_at_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "file" / "below"))
    with pytest.raises(RuntimeFailure, match="cannot create the log directory"):
        launched(tmp_path, "true")


def test_an_error_of_the_launch_file_ends_it_with_the_reason(tmp_path: Path) -> None:
    file = tmp_path / "test.launch.py"
    file.write_text(
        "from launch import LaunchDescription\n"
        "from launch.actions import ExecuteProcess, RegisterEventHandler\n"
        "from launch.event_handlers import OnProcessExit\n"
        "def check(event, context):\n"
        "    if event.returncode == 3: raise ValueError('no such robot')\n"
        "def generate_launch_description():\n"
        "    return LaunchDescription([\n"
        "        RegisterEventHandler(OnProcessExit(on_exit=check)), ExecuteProcess(cmd=['sh', '-c', 'exit 3'])])\n"
    )
    launch = start_unsecured(evaluate_launch(file))
    assert launch.wait(20) == 1
    failed = [event for event in launch.events() if isinstance(event, run_events.LaunchFailed)]
    assert "no such robot" in failed[0].reason


SEES = """
import os
from launch import LaunchDescription
from launch.actions import ExecuteProcess, OpaqueFunction, RegisterEventHandler, SetEnvironmentVariable
from launch.event_handlers import OnProcessExit
from launch.substitutions import EnvironmentVariable

def generate_launch_description():
    first = ExecuteProcess(cmd=["sh", "-c", "echo first sees $ROBOT; while [ ! -e {go} ]; do sleep 0.02; done"])
    return LaunchDescription([
        SetEnvironmentVariable("ROBOT", "{robot}"),
        first,
        RegisterEventHandler(OnProcessExit(target_action=first, on_exit=[
            ExecuteProcess(cmd=["echo", "then", EnvironmentVariable("ROBOT")], name="second"),
            OpaqueFunction(function=lambda context: [ExecuteProcess(cmd=["echo", os.environ["ROBOT"]], name="third")]),
        ])),
    ])
"""


def sees(directory: Path, robot: str) -> RunningLaunch:
    directory.mkdir()
    file = directory / "sees.launch.py"
    file.write_text(SEES.replace("{robot}", robot).replace("{go}", str(directory / "go")))
    return start_unsecured(LaunchSource(str(file)))


def test_several_launches_in_one_program_each_with_an_environment_of_its_own(tmp_path: Path) -> None:
    """What one sets is there again when its next event comes, though the others were there in between."""
    before = dict(os.environ)
    launches = {robot: sees(tmp_path / robot, robot) for robot in ("red", "green", "blue")}
    for robot, launch in launches.items():
        launch.wait_until(printed("sh-1", f"first sees {robot}"), 20)
    for robot in ("green", "red", "blue"):
        (tmp_path / robot / "go").touch()
    for robot, launch in launches.items():
        assert launch.wait(20) == 0
        assert launch.processes["second-2"].output == f"then {robot}\n".encode()
        assert launch.processes["third-3"].output == f"{robot}\n".encode()
    assert dict(os.environ) == before


def test_a_launch_file_can_be_resolved_while_a_launch_runs(tmp_path: Path) -> None:
    launch = sees(tmp_path / "red", "red")
    launch.wait_until(started("sh-1"), 20)
    other = tmp_path / "other.launch.xml"
    other.write_text('<launch><executable cmd="echo $(env ROBOT none)"/></launch>')
    (process,) = evaluate_launch(other).evaluation.processes
    assert process.cmd == ("echo", "none")
    (tmp_path / "red" / "go").touch()
    assert launch.wait(20) == 0
    assert launch.processes["second-2"].output == b"then red\n"


def test_a_launch_that_loses_its_warden_takes_no_other_with_it(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    one, two = (launched(tmp_path / name, "exec sleep 60") for name in ("one", "two"))
    for launch in (one, two):
        launch.wait_until(started("a-1"), 20)
    assert one.warden_pid is not None
    os.kill(one.warden_pid, signal.SIGKILL)
    assert one.wait(20) == 1
    assert two.exit_status is None
    assert two.stop(timeout=20) == 0
