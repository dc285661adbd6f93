"""A launch in somebody else's program: it leaves nothing behind, says where it cannot run, and can be cancelled."""

from __future__ import annotations

import asyncio
import os
import re
import subprocess
import sys
import textwrap
import threading
from pathlib import Path
from typing import Any

import pytest

from enclave_launch import (
    RuntimeFailure,
    UsageError,
    evaluate_launch,
    launch_source,
    provision,
    resolve,
    run,
    run_async,
    run_async_unsecured,
    run_unsecured,
    start,
    start_unsecured,
)

pytestmark = pytest.mark.usefixtures("ros_log_dir")


def launch_file(directory: Path, command: str) -> Path:
    file = directory / "test.launch.xml"
    file.write_text(f'<launch><executable name="a" cmd="{command}" output="screen"/></launch>')
    return file


def python(script: str, *words: str, options: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *options, "-c", textwrap.dedent(script), *words],
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_a_launch_that_nobody_provisioned_is_not_started_unless_the_call_says_unsecured(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = launch_file(tmp_path, "echo hello")
    for bare in (resolve(file), evaluate_launch(file), launch_source(file)):
        unprovisioned: Any = bare
        for call in (run, start, lambda launch: asyncio.run(run_async(launch))):
            with pytest.raises(
                UsageError, match=r"what provision\(\) returned, and this \w+ has no keystore"
            ):
                call(unprovisioned)
        assert "hello" not in capfd.readouterr().out
        assert run_unsecured(bare) == 0
        assert asyncio.run(run_async_unsecured(bare)) == 0
        with start_unsecured(bare) as running:
            assert running.wait(timeout=30) == 0
        assert capfd.readouterr().out.count("[a-1] hello") == 3


def test_a_provisioned_launch_is_not_started_unsecured(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    provisioned: Any = provision(resolve(launch_file(tmp_path, "echo hello")), tmp_path / "ks")
    for call in (run_unsecured, start_unsecured, lambda launch: asyncio.run(run_async_unsecured(launch))):
        with pytest.raises(
            UsageError, match=r"not this ProvisionedLaunch; what provision\(\) returned: \w+\(...\)"
        ):
            call(provisioned)
    assert "hello" not in capfd.readouterr().out
    assert run(provisioned) == 0
    assert "[a-1] hello" in capfd.readouterr().out


STRICT = ("-X", "dev", "-W", "error")  # asyncio debug mode; unclosed or never awaited is an error

STATE = """
import asyncio, logging, os, resource, signal, sys, threading
from enclave_launch import launch_source, run_async_unsecured, run_unsecured

def state():
    return {
        "descriptors": sorted(os.listdir("/proc/self/fd")),
        "threads": [thread.name for thread in threading.enumerate()],
        "signals": [signal.getsignal(number) for number in signal.Signals if number not in (9, 19)],
        "environment": dict(os.environ),
        "directory": os.getcwd(),
        "logging": (logging.getLogger().level, list(logging.getLogger().handlers)),
        "limit": resource.getrlimit(resource.RLIMIT_NOFILE),
        "modules": {name for name in sys.modules if name.partition(".")[0] in ("launch", "launch_ros")},
        "path": list(sys.path),
    }

def differences(before):
    after = state()
    return [(name, before[name], after[name]) for name in before if before[name] != after[name]]
"""


def test_three_runs_in_a_row_leave_the_process_as_it_was(tmp_path: Path) -> None:
    script = f"""{STATE}
hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
resource.setrlimit(resource.RLIMIT_NOFILE, (min(256, hard), hard))
before = state()
assert [run_unsecured(launch_source(sys.argv[1])) for _ in range(3)] == [0, 0, 0]
assert not differences(before), differences(before)
"""
    result = python(script, str(launch_file(tmp_path, "echo hello")), options=STRICT)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.count("[a-1] hello") == 3


def test_cancelled_at_any_moment_it_ends_every_process_and_leaves_nothing(tmp_path: Path) -> None:
    script = f"""{STATE}
async def cancelled(seconds, times):
    task = asyncio.ensure_future(run_async_unsecured(launch_source(sys.argv[1])))
    for _ in range(times):
        await asyncio.sleep(seconds)
        task.cancel()
    try:
        await task
    except asyncio.CancelledError:
        assert asyncio.all_tasks() == {{asyncio.current_task()}}
        return
    raise AssertionError("not cancelled")

before = state()
for seconds in (0, 0.001, 0.01, 0.03, 0.06, 0.1, 0.2):
    asyncio.run(cancelled(seconds, 1))
asyncio.run(cancelled(0.2, 3))
assert not differences(before), differences(before)
with open(f"/proc/self/task/{{os.getpid()}}/children") as children:
    assert children.read() == ""
"""
    result = python(script, str(launch_file(tmp_path, "sleep 60")), options=STRICT)
    slow = r"(?m)^Executing <.*> took [\d.]+ seconds\n"  # asyncio's debug mode on a busy machine
    assert (result.returncode, re.sub(slow, "", result.stderr)) == (0, "")
    assert result.stdout.count("process started") == result.stdout.count("process has died") > 0


def test_with_a_time_limit(tmp_path: Path) -> None:
    async def main() -> None:
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(run_async_unsecured(launch_source(launch_file(tmp_path, "sleep 60"))), 0.3)

    asyncio.run(main())


def in_thread(function: object) -> list[object]:
    seen: list[object] = []

    def body() -> None:
        try:
            seen.append(function())  # type: ignore[operator]
        except RuntimeFailure as error:
            seen.append(error)

    thread = threading.Thread(target=body)
    thread.start()
    thread.join(30)
    return seen


def test_in_another_thread_signals_cannot_be_taken_and_the_async_call_works(tmp_path: Path) -> None:
    file = launch_file(tmp_path, "true")
    (refusal,) = in_thread(lambda: run_unsecured(launch_source(file)))
    assert isinstance(refusal, RuntimeFailure)
    assert "main thread" in str(refusal) and "run_async" in str(refusal)
    assert in_thread(lambda: asyncio.run(run_async_unsecured(launch_source(file)))) == [0]


def test_the_blocking_call_in_a_running_loop_says_which_to_use(tmp_path: Path) -> None:
    async def main() -> None:
        with pytest.raises(RuntimeFailure, match=r"await run_async"):
            run_unsecured(launch_source(launch_file(tmp_path, "true")))

    asyncio.run(main())


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&-", "<&- >&- 2>&-"])
def test_started_with_standard_streams_closed(closed: str, tmp_path: Path, ros_log_dir: Path) -> None:
    """As some supervisors do; what we open must not take their places."""
    file = launch_file(tmp_path, "echo hello")
    script = (
        "import sys; from enclave_launch import launch_source, run_unsecured; "
        "sys.exit(run_unsecured(launch_source(sys.argv[1])))"
    )
    command = f'"$0" -c "$1" "$2" {closed}'
    result = subprocess.run(
        ["sh", "-c", command, sys.executable, script, str(file)],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert "Traceback" not in result.stderr
    assert ("[a-1] hello" in result.stdout) is (">&-" not in closed.replace("2>&-", ""))
    log = (ros_log_dir / "latest/launch.log").read_text()
    assert "[a-1]: process started" in log and "[a-1]: process has finished cleanly" in log


def test_a_reader_of_our_output_that_goes_away_does_not_end_the_launch(
    tmp_path: Path, ros_log_dir: Path
) -> None:
    file = launch_file(tmp_path, "sh -c 'for i in 1 2 3 4 5 6; do echo $i; sleep 0.1; done'")
    script = (
        "import sys; from enclave_launch import launch_source, run_unsecured; "
        "sys.exit(run_unsecured(launch_source(sys.argv[1])))"
    )
    command = '("$0" -c "$1" "$2"; echo "status $?" >&2) | head -n 3'
    result = subprocess.run(
        ["sh", "-c", command, sys.executable, script, str(file)],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert result.stderr == "status 0\n"
    assert "process has finished cleanly" in (ros_log_dir / "latest/launch.log").read_text()
