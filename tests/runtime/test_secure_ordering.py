"""A process starts only once its enclave is complete; what cannot be secured is not started, with the reason."""

from __future__ import annotations

import asyncio
import os
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from enclave_launch import ProvisionError, RunSettings, RuntimeFailure
from enclave_launch.plan import LaunchSource
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from enclave_launch.runtime.companion import LaunchControl, Together
from enclave_launch.runtime.gate import StartAdditions
from enclave_launch.runtime.live_launch import LiveLaunch, run_launch
from tests.runtime.conftest import alive, read_pid

pytestmark = pytest.mark.usefixtures("ros_log_dir")


class SlowKeystore:
    """Completes an enclave by writing a file, after a while. ``broken``: names of processes it fails for;
    ``untouched``: of those that need no work."""

    def __init__(self, directory: Path, broken: Sequence[str] = (), untouched: Sequence[str] = ()) -> None:
        self.directory = directory
        self.broken = broken
        self.untouched = untouched
        self.order: list[str] = []
        self.inside = threading.Lock()

    def granted(self, process: ResolvedProcess) -> StartAdditions | None:
        assert not self.inside.locked(), "one process at a time"
        label = process.process_name.rpartition("-")[0]
        if label not in self.untouched:
            return None
        self.order.append(label)
        return StartAdditions()

    def ensure(self, process: ResolvedProcess) -> StartAdditions:
        assert threading.current_thread() is not threading.main_thread(), (
            "the event loop must go on meanwhile"
        )
        assert self.inside.acquire(blocking=False), "one process at a time"
        with_label = process.process_name.rpartition("-")[0]
        self.order.append(with_label)
        try:
            time.sleep(0.05)
            if with_label in self.broken:
                raise ProvisionError(f"keystore {self.directory}: read-only file system")
            (self.directory / with_label).write_text("complete")
        finally:
            self.inside.release()
        return StartAdditions(("extra",), {"ENCLAVE_FILE": str(self.directory / with_label)})

    def ensure_components(self, components: Sequence[ResolvedComponent]) -> None:
        raise AssertionError("no components here")

    def launcher(self) -> StartAdditions | None:
        return None


def launch_file(directory: Path, *actions: str) -> LaunchSource:
    file = directory / "test.launch.xml"
    file.write_text(f"<launch>{''.join(actions)}</launch>")
    return LaunchSource(str(file))


def script(directory: Path, name: str, text: str, **attributes: str) -> str:
    program = directory / f"{name}.sh"
    program.write_text(f"#!/bin/sh\n{text}\n")
    program.chmod(0o755)
    extra = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f'<executable cmd="{program}" name="{name}" output="screen"{extra}/>'


def test_each_process_finds_its_enclave_complete_and_gets_what_the_gate_grants(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    say = 'echo "$1 $(cat $ENCLAVE_FILE)"'
    actions = [script(tmp_path, name, say) for name in ("a", "b", "c")]
    keystore = SlowKeystore(tmp_path)
    assert run_launch(LiveLaunch(launch_file(tmp_path, *actions), gate=keystore)) == 0
    assert keystore.order == ["a", "b", "c"]
    shown = capfd.readouterr().out
    for number, name in enumerate("abc", start=1):
        assert f"[{name}-{number}] extra complete" in shown


def test_what_needs_no_work_is_granted_at_once_but_overtakes_nobody(tmp_path: Path) -> None:
    actions = [script(tmp_path, name, "true") for name in ("a", "b", "c", "d")]
    keystore = SlowKeystore(tmp_path, untouched=("a", "d"))
    assert run_launch(LiveLaunch(launch_file(tmp_path, *actions), gate=keystore)) == 0
    assert keystore.order == ["a", "b", "c", "d"]
    assert (tmp_path / "d").exists(), "behind b and c it was looked at in its turn"


def test_the_enclave_is_looked_at_again_before_each_respawn(tmp_path: Path) -> None:
    keystore = SlowKeystore(tmp_path)
    action = script(tmp_path, "a", "exit 0", respawn="true", respawn_max_retries="2")
    assert run_launch(LiveLaunch(launch_file(tmp_path, action), gate=keystore)) == 0
    assert keystore.order == ["a", "a", "a"]


def test_a_failure_to_provision_starts_nothing_more_and_shuts_down_with_the_reason(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    actions = [
        script(tmp_path, "good", "exec sleep 60"),
        script(tmp_path, "bad", "echo never"),
        script(tmp_path, "later", "echo never"),
    ]
    start = time.monotonic()
    assert (
        run_launch(LiveLaunch(launch_file(tmp_path, *actions), gate=SlowKeystore(tmp_path, broken=["bad"])))
        == 1
    )
    assert time.monotonic() - start < 10
    shown = capfd.readouterr().out
    assert f"[CRITICAL] [launch]: keystore {tmp_path}: read-only file system" in shown
    assert "never" not in shown
    assert "[good-1]: sending signal 'SIGINT'" in shown


def test_secrets_do_not_reach_the_children(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CA_PASSPHRASE", "open sesame")
    monkeypatch.setenv("HARMLESS", "yes")
    file = launch_file(tmp_path, script(tmp_path, "a", 'echo "${CA_PASSPHRASE-absent} $HARMLESS"'))
    assert run_launch(LiveLaunch(file, RunSettings(secrets=frozenset({"CA_PASSPHRASE"})))) == 0
    assert "[a-1] absent yes" in capfd.readouterr().out
    assert os.environ["CA_PASSPHRASE"] == "open sesame"


class Notice(Together):
    def opened(self, launch: LaunchControl) -> None:
        launch.say("WARNING", "/talker ends 2030-01-01")


def test_what_a_companion_says_at_once_is_said_at_the_start(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = launch_file(tmp_path, script(tmp_path, "a", "true"))
    run_launch(LiveLaunch(file, RunSettings(companion=Notice())))
    lines = capfd.readouterr().out.splitlines()
    assert lines.index("[WARNING] [launch]: /talker ends 2030-01-01") < lines.index(
        next(line for line in lines if "process started" in line)
    )


def test_inside_a_running_loop_and_cancelled(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = launch_file(tmp_path, script(tmp_path, "a", f"echo $$ > {tmp_path}/pid; exec sleep 60"))

    async def main() -> str:
        task = asyncio.create_task(LiveLaunch(file).run())
        pid = await asyncio.to_thread(read_pid, tmp_path / "pid")
        task.cancel()
        try:
            await asyncio.wait_for(task, 10)
        except asyncio.CancelledError:
            return "cancelled" if not alive(pid) else "left it running"
        return "returned"

    assert asyncio.run(main()) == "cancelled"
    assert "[a-1]: sending signal 'SIGINT'" in capfd.readouterr().out


def test_two_launches_at_once_in_one_event_loop(tmp_path: Path) -> None:
    file = launch_file(tmp_path, script(tmp_path, "a", f"echo $$ > {tmp_path}/pid; exec sleep 60"))

    async def main() -> None:
        first = asyncio.create_task(LiveLaunch(file).run())
        await asyncio.to_thread(read_pid, tmp_path / "pid")
        assert await LiveLaunch(launch_file(tmp_path, script(tmp_path, "b", "true"))).run() == 0
        assert alive(read_pid(tmp_path / "pid"))
        first.cancel()
        with pytest.raises(asyncio.CancelledError):
            await first

    asyncio.run(main())


def test_a_launch_leaves_our_own_environment_as_it_was(tmp_path: Path) -> None:
    file = tmp_path / "test.launch.xml"
    file.write_text('<launch><set_env name="LAUNCHED" value="1"/></launch>')
    assert run_launch(LiveLaunch(LaunchSource(str(file)))) == 0
    assert "LAUNCHED" not in os.environ


def test_without_rclpy_what_needs_ros_services_is_an_error_before_anything_starts(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = launch_file(tmp_path, script(tmp_path, "a", "echo never"))
    with pytest.raises(RuntimeFailure, match=r"rclpy is not importable .* ros2 launch --secure"):
        run_launch(LiveLaunch(file, needs_ros_services=True))
    assert "process started" not in capfd.readouterr().out
