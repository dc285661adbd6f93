"""How a launch ends and what it leaves behind: our supervisor beside upstream's.

    python -m bench.supervisor

Each scenario is a Python launch file, started as a process of its own by ``secure-launch`` and, where the sources of
ros2/launch are in ``REAL_LAUNCH_PYTHONPATH``, by upstream's ``LaunchService``. Counted is what carries the scenario's
mark in its environment, so that nothing of the machine's own is taken for a left-over.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
REAL_LAUNCH = os.environ.get("REAL_LAUNCH_PYTHONPATH", "")
MARK = "BENCH_SUPERVISOR"
PATIENCE = 8.0  # seconds that left-overs get to end

PRELUDE = """
from launch import LaunchDescription
from launch.actions import ExecuteProcess
def sh(script, **options):
    return ExecuteProcess(cmd=["sh", "-c", script], output="screen", **options)
def generate_launch_description():
    return LaunchDescription({actions})
"""
UPSTREAM = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
service = LaunchService(noninteractive=True)
service.include_launch_description(IncludeLaunchDescription(PythonLaunchDescriptionSource(sys.argv[1])))
sys.exit(service.run())
"""
HUNDRED = '[sh("echo up; exec sleep 600") for _ in range(100)]'
# Ten processes, each with a child that ignores polite signals, a daemon and a child in a group of its own.
HOSTILE = """[sh('''
    (trap "" INT TERM; while :; do sleep 0.1; done) &
    setsid sh -c "sleep 600" >/dev/null 2>&1 &
    setsid setsid sh -c "trap '' INT TERM; while :; do sleep 0.1; done" >/dev/null 2>&1 &
    echo up; exec sleep 600
''') for _ in range(10)]"""
ONE_MISSING = '[ExecuteProcess(cmd=["no_such_program"]), sh("echo up; exec sleep 600")]'


class Scenario(NamedTuple):
    name: str
    actions: str
    up: int  # lines "up" until it is complete
    number: signal.Signals


SCENARIOS = (
    Scenario("100 processes, Ctrl-C", HUNDRED, 100, signal.SIGINT),
    Scenario("100 processes, SIGTERM", HUNDRED, 100, signal.SIGTERM),
    Scenario("hostile tree, Ctrl-C", HOSTILE, 10, signal.SIGINT),
    Scenario("hostile tree, SIGTERM", HOSTILE, 10, signal.SIGTERM),
    Scenario("hostile tree, launcher killed (SIGKILL)", HOSTILE, 10, signal.SIGKILL),
    Scenario("one program missing, Ctrl-C", ONE_MISSING, 1, signal.SIGINT),
)


class Ended(NamedTuple):
    """Seconds from the signal until the launcher was gone; processes alive after ``PATIENCE``; its exit status."""

    seconds: float
    left: int
    status: int


def main() -> None:
    launchers = {"secure-launch": [sys.executable, "-m", "enclave_launch", "-n"]}
    if REAL_LAUNCH:
        launchers["upstream"] = [sys.executable, "-W", "ignore", "-c", UPSTREAM]
    print(f"{'':44}" + "".join(f"{name:>36}" for name in launchers))
    for scenario in SCENARIOS:
        cells = (_cell(_ended(scenario, name, command)) for name, command in launchers.items())
        print(f"{scenario.name:44}" + "".join(f"{cell:>36}" for cell in cells), flush=True)


def _cell(ended: Ended) -> str:
    return f"{ended.seconds:.2f} s, {ended.left} left, exit {ended.status}"


def _ended(scenario: Scenario, launcher: str, command: list[str]) -> Ended:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "scenario.launch.py")
        file.write_text(PRELUDE.format(actions=scenario.actions))
        mark = f"{os.getpid()}-{time.monotonic_ns()}"
        path = REAL_LAUNCH if launcher == "upstream" else str(ROOT)
        environment = {**os.environ, MARK: mark, "PYTHONPATH": path, "ROS_LOG_DIR": folder}
        try:
            return _run(scenario, [*command, str(file)], environment, Path(folder, "screen"), mark)
        finally:
            for pid in _marked(mark):
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)


def _run(
    scenario: Scenario, command: list[str], environment: Mapping[str, str], screen: Path, mark: str
) -> Ended:
    with screen.open("wb") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, env=environment)
    _wait_until_up(screen, scenario.up)
    began = time.monotonic()
    process.send_signal(scenario.number)
    status = process.wait(60)
    seconds = time.monotonic() - began
    return Ended(seconds, _left_after_patience(mark), status)


def _left_after_patience(mark: str) -> int:
    deadline = time.monotonic() + PATIENCE
    while (left := len(_marked(mark))) and time.monotonic() < deadline:
        time.sleep(0.1)
    return left


def _wait_until_up(screen: Path, count: int) -> None:
    deadline = time.monotonic() + 60
    while screen.read_bytes().count(b"] up\n") < count:
        if time.monotonic() > deadline:
            raise SystemExit(f"the scenario did not come up:\n{screen.read_text(errors='replace')}")
        time.sleep(0.02)


def _marked(mark: str) -> list[int]:
    """Live processes with the scenario's mark in their environment, this bench left out."""
    wanted = f"{MARK}={mark}".encode()
    found = []
    for entry in filter(str.isdigit, os.listdir("/proc")):
        try:
            if wanted in Path("/proc", entry, "environ").read_bytes().split(b"\0"):
                found.append(int(entry))
        except OSError:
            continue
    return found


if __name__ == "__main__":
    main()
