"""What ``secure-launch --watch`` costs beside a launch, and whether it is quiet when all is as planned.

    python -m bench.watch [STARTS [PROCESSES]]

STARTS launches of 2 to 50 talkers, every other one secured, three at a time in domains of their own, each with
``--watch`` and up for longer than the watch waits before it tells what is missing: every finding would be a false
alarm. Then one launch of PROCESSES talkers, unsecured: processor time of the watch's observer and of the supervisor
from start to steady, and for each minute of the steady state, with and without ``--watch``.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from enclave_addons.observation.drift_watch import SettlingTimes

ROOT = Path(__file__).resolve().parent.parent
DEMO_WS = ROOT / "fixtures" / "demo_ws"
DOMAIN = "73"
SIZES = (2, 5, 10, 20, 50)  # processes of a launch
_AT_ONCE = 3
_LONGER = 15.0  # seconds
_DOMAINS = 28  # up to 100: beyond, ports meet those that Linux gives out
STEADY = 30.0  # seconds
LONGEST = 240.0
TICKS = os.sysconf("SC_CLK_TCK")


def environment(domain: str) -> dict[str, str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    return {**os.environ, "PATH": path, "ROS_DOMAIN_ID": domain, "ROS_LOCALHOST_ONLY": "1"}


def command(*words: str) -> list[str]:
    return [sys.executable, "-m", "enclave_launch", "-n", "--prefix", str(DEMO_WS), *words]


def clean_starts(count: int, folder: Path) -> None:
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        numbers = range(count)
        sizes = [SIZES[number // 2 % len(SIZES)] for number in numbers]
        starts = list(pool.map(clean_start, numbers, sizes, [folder] * count))
    told = [line for each in starts for line in each.told]
    bad = sum(each.status != 0 for each in starts)
    print(f"{count} clean starts: {len(told)} findings told, {bad} bad statuses")
    for line in told[:5]:
        print(f"  {line}")


class CleanStart(NamedTuple):
    """``told``: findings, as JSON lines."""

    status: int
    told: list[str]


def clean_start(number: int, processes: int, folder: Path) -> CleanStart:
    """Up until all nodes are and have been for longer than anything is waited for."""
    place = folder / str(number)
    place.mkdir()
    report, shown = place / "drift.jsonl", place / "shown"
    secure = ["--secure", "--keystore", str(place / "ks")] if number % 2 else []
    words = ["--watch", "--watch-report", str(report), *secure, str(launch_file(place, processes))]
    began, load = time.monotonic(), os.getloadavg()[0]
    with launched(words, shown, str(int(DOMAIN) + number % _DOMAINS)) as launch:
        up = wait_until_up(shown, processes)
        seconds = time.monotonic() - began
        time.sleep(SettlingTimes().absence + _LONGER)
        early = launch.poll()
    status = launch.returncode if early is None else early or 1
    told = report.read_text().splitlines() if report.exists() else []
    how = "secured" if secure else "unsecured"
    print(
        f"start {number}: {processes} processes, {how}, load {load:.1f}: {up} up after {seconds:.0f} s; "
        f"{len(told)} findings, status {status}",
        flush=True,
    )
    return CleanStart(status or int(up != processes), told)


@contextmanager
def launched(words: list[str], shown: Path, domain: str) -> Iterator[subprocess.Popen[bytes]]:
    with shown.open("wb") as output:
        launch = subprocess.Popen(
            command(*words), env=environment(domain), cwd=ROOT, stdout=output, stderr=subprocess.STDOUT
        )
    try:
        yield launch
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(120)


def wait_until_up(shown: Path, processes: int) -> int:
    """How many are."""
    end = time.monotonic() + LONGEST
    while (up := shown.read_bytes().count(b"is up")) < processes and time.monotonic() < end:
        time.sleep(0.5)
    return up


def launch_file(folder: Path, processes: int) -> Path:
    nodes = "".join(
        f'<node pkg="demo_nodes" exec="talker" name="talker_{n}" output="screen">'
        f'<remap from="chatter" to="/chatter_{n}"/>'
        '<param name="count" value="0"/><param name="seconds" value="0"/><param name="rate" value="1.0"/></node>\n'
        for n in range(processes)
    )
    file = folder / "many.launch.xml"
    file.write_text(f"<launch>\n{nodes}</launch>\n")
    return file


def seconds_of(pid: int) -> float:
    """Processor time, user and system."""
    fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def memory_of(pid: int) -> float:
    """Resident, MiB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmRSS")).split()[1]) / 1024


def observer_below(pid: int) -> int | None:
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = int((entry / "stat").read_bytes().rpartition(b")")[2].split()[1])
                words = (entry / "cmdline").read_bytes()
            except OSError:
                continue
            if parent == pid and b"enclave_addons.observation.graph.follow" in words:
                return int(entry.name)
    return None


def beside(processes: int, folder: Path, watched: bool) -> None:
    file, report, shown = launch_file(folder, processes), folder / "many.jsonl", folder / "shown"
    words = ["--watch", "--watch-report", str(report)] if watched else []
    with launched([*words, str(file)], shown, DOMAIN) as launch:
        wait_until_up(shown, processes)
        time.sleep(10)  # discovery goes on for a while
        observer = observer_below(launch.pid)
        pids = {"supervisor": launch.pid, **({"observer": observer} if observer else {})}
        start = {name: seconds_of(pid) for name, pid in pids.items()}
        time.sleep(STEADY)
        for name, pid in pids.items():
            steady = (seconds_of(pid) - start[name]) * 60 / STEADY
            how = f"{'with' if watched else 'without'} --watch, {name}"
            print(
                f"{how}: {start[name]:.1f} s of processor time until steady, "
                f"then {steady:.2f} s a minute, {memory_of(pid):.0f} MiB"
            )
        up = shown.read_bytes().count(b"is up")
        told = report.read_text().splitlines() if report.exists() else []
        kinds = Counter((row["event"], row["level"], row["kind"]) for row in map(json.loads, told))
        print(f"  {up} of {processes} nodes were up; findings told: {dict(kinds) or 'none'}")


def main(starts: int = 20, processes: int = 50) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        clean_starts(starts, folder)
        beside(processes, folder, watched=False)
        beside(processes, folder, watched=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
