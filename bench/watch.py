"""What ``secure-launch --watch`` costs beside a launch, and whether it is quiet when all is as planned.

    python -m bench.watch [STARTS [PROCESSES]]

STARTS launches of the demo, every other one secured, each with ``--watch``: every finding would be a false alarm. Then
one launch of PROCESSES talkers, unsecured: processor time of the watch's observer and of the supervisor from start to
steady, and for each minute of the steady state, with and without ``--watch``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DEMO_WS = ROOT / "fixtures" / "demo_ws"
DOMAIN = "73"
STEADY = 30.0  # seconds
LONGEST = 240.0
TICKS = os.sysconf("SC_CLK_TCK")


def environment() -> dict[str, str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    return {**os.environ, "PATH": path, "ROS_DOMAIN_ID": DOMAIN, "ROS_LOCALHOST_ONLY": "1"}


def command(*words: str) -> list[str]:
    return [sys.executable, "-m", "enclave_launch", "-n", "--prefix", str(DEMO_WS), *words]


def clean_starts(count: int, folder: Path) -> None:
    report = folder / "drift.jsonl"
    words = [
        "--watch",
        "--watch-report",
        str(report),
        "demo_nodes",
        "talker_listener.launch.xml",
        "seconds:=8",
        "count:=0",
    ]
    statuses = []
    for number in range(count):
        secure = ["--secure", "--keystore", str(folder / "ks")] if number % 2 else []
        ran = subprocess.run(
            command(*secure, *words), env=environment(), cwd=ROOT, capture_output=True, check=False
        )
        statuses.append(ran.returncode)
    told = report.read_text().splitlines() if report.exists() else []
    print(
        f"{count} clean starts: {len(told)} findings told, {sum(status != 0 for status in statuses)} bad statuses"
    )
    for line in told[:5]:
        print(f"  {line}")


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
            if parent == pid and b"nodl.graph.follow" in words:
                return int(entry.name)
    return None


def beside(processes: int, folder: Path, watched: bool) -> None:
    file, report, shown = launch_file(folder, processes), folder / "many.jsonl", folder / "shown"
    words = ["--watch", "--watch-report", str(report)] if watched else []
    with shown.open("wb") as output:
        launch = subprocess.Popen(
            command(*words, str(file)), env=environment(), cwd=ROOT, stdout=output, stderr=subprocess.STDOUT
        )
    try:
        end = time.monotonic() + LONGEST
        while shown.read_bytes().count(b"is up") < processes and time.monotonic() < end:
            time.sleep(0.5)
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
    finally:
        launch.send_signal(2)
        launch.wait(120)


def main(starts: int = 20, processes: int = 50) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        clean_starts(starts, folder)
        beside(processes, folder, watched=False)
        beside(processes, folder, watched=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
