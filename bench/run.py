"""How long from the command to the first process, and what ``--secure`` adds to it.

Times whole commands as a person starts them: interpreter, imports, evaluation, keystore, process. The nodes
are small shell scripts that write down when they were started. Each figure is the median of several runs.

    plain            secure-launch
    secured, cold    secure-launch --secure, keystore created in the run
    secured, warm    the same with everything in the keystore already
    ros2 launch      upstream's engine without security, where launch, launch_ros and ros2launch are
    importable floor            the interpreter starting the same programs with nothing decided

Also: output through our pumps to a file, against ``cat``.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RUNS = int(os.environ.get("BENCH_RUNS", "5"))
NODES = 50
PACKAGE = "bench_nodes"
UPSTREAM = ("launch", "launch_ros", "launch_xml", "ros2launch", "osrf_pycommon")

SCRIPT = """#!/bin/sh
date +%s%N >> "$BENCH_STAMPS"
"""
MANIFEST = """<interface version="1">
  <node name="node" executable="node">
    <topic name="chatter" type="std_msgs/msg/String" role="publisher"/>
    <topic name="orders" type="std_msgs/msg/String" role="subscription"/>
    <service name="reset" type="std_srvs/srv/Empty" role="server"/>
  </node>
</interface>
"""
FLOOR = "import os, subprocess, sys\nfor _ in range(int(sys.argv[2])): subprocess.Popen([sys.argv[1]])"


@dataclass(frozen=True)
class Times:
    """Milliseconds from the command to the start of its first and of its last process."""

    first: float
    last: float


class Workspace:
    """An ament prefix with one node, launched once and ``NODES`` times."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.prefix = directory / "prefix"
        self.stamps = directory / "stamps"
        self.program = self.prefix / "lib" / PACKAGE / "node"
        self.keystore = directory / "keystore"
        share = self.prefix / "share" / PACKAGE
        for folder in (share, self.program.parent, self.prefix / "share/ament_index/resource_index/packages"):
            folder.mkdir(parents=True, exist_ok=True)
        (self.prefix / "share/ament_index/resource_index/packages" / PACKAGE).touch()
        (share / "node.nodl.xml").write_text(MANIFEST)
        self.program.write_text(SCRIPT)
        self.program.chmod(0o755)
        for count in (1, NODES):
            lines = "".join(
                f'<node pkg="{PACKAGE}" exec="node" name="n{number}" namespace="/r{number % 10}"/>'
                for number in range(count)
            )
            self.launch_file(count).write_text(f"<launch>{lines}</launch>")

    def launch_file(self, count: int) -> Path:
        return self.directory / f"{count}.launch.xml"

    def environment(self) -> dict[str, str]:
        prefixes = [str(self.prefix), os.environ.get("AMENT_PREFIX_PATH", "")]
        return {
            **os.environ,
            "BENCH_STAMPS": str(self.stamps),
            "AMENT_PREFIX_PATH": os.pathsep.join(filter(None, prefixes)),
            "ROS_LOG_DIR": str(self.directory / "log"),
        }

    def time(self, command: list[str]) -> Times:
        self.stamps.unlink(missing_ok=True)
        start = time.time_ns()
        done = subprocess.run(
            command,
            env=self.environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise SystemExit(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
        while not self.stamps.is_file():
            time.sleep(0.01)
        stamps = [int(line) for line in self.stamps.read_text().split()]
        return Times((min(stamps) - start) / 1e6, (max(stamps) - start) / 1e6)


def secure_launch(workspace: Workspace, count: int, *options: str) -> list[str]:
    program = [
        sys.executable,
        "-c",
        "import sys; from enclave_launch.verb.secure_launch import main; sys.exit(main())",
    ]
    return [*program, *options, str(workspace.launch_file(count))]


def secured(workspace: Workspace, count: int) -> list[str]:
    return secure_launch(workspace, count, "--secure", "--keystore", str(workspace.keystore))


def upstream(workspace: Workspace, count: int) -> list[str]:
    return [sys.executable, str(ROOT / "tests/ros2/ros2_launch.py"), str(workspace.launch_file(count))]


def median(measure: Callable[[], Times], prepare: Callable[[], object] = lambda: None) -> Times:
    results = []
    for _ in range(RUNS):
        prepare()
        results.append(measure())
    return Times(statistics.median(r.first for r in results), statistics.median(r.last for r in results))


def measured(workspace: Workspace, count: int) -> Iterable[tuple[str, Times | None]]:
    def forget() -> None:
        shutil.rmtree(workspace.keystore, ignore_errors=True)

    floor = [sys.executable, "-c", FLOOR, str(workspace.program), str(count)]
    yield "floor", median(lambda: workspace.time(floor))
    yield "plain", median(lambda: workspace.time(secure_launch(workspace, count)))
    yield "secured, cold", median(lambda: workspace.time(secured(workspace, count)), forget)
    yield "secured, warm", median(lambda: workspace.time(secured(workspace, count)))
    available = all(importlib.util.find_spec(name) is not None for name in UPSTREAM)
    yield "ros2 launch", median(lambda: workspace.time(upstream(workspace, count))) if available else None


def report_starts(workspace: Workspace) -> None:
    for count in (1, NODES):
        rows = dict(measured(workspace, count))
        peer, floor, plain = rows["ros2 launch"], rows["floor"], rows["plain"]
        assert floor is not None and plain is not None
        print(f"\n{count} node(s), median of {RUNS} runs    first process      last process    x floor   x ros2 launch")
        for name, times in rows.items():
            if times is None:
                print(f"  {name:32} not available")
                continue
            ratio = f"{times.first / peer.first:10.2f}" if peer else "         -"
            print(
                f"  {name:32} {times.first:9.1f} ms      {times.last:9.1f} ms {times.first / floor.first:10.2f} {ratio}"
            )
        warm = rows["secured, warm"]
        assert warm is not None
        print(f"  --secure on a warm keystore adds  {warm.last - plain.last:8.1f} ms until the last process")


def report_output(workspace: Workspace) -> None:
    """One process that writes numbered lines as fast as it can; ours adds the prefix and writes a log
    file.
    """
    lines = 5_000_000
    file = workspace.directory / "output.launch.xml"
    file.write_text(f'<launch><executable cmd="seq {lines}" output="log" name="seq"/></launch>')
    start = time.perf_counter()
    subprocess.run(["sh", "-c", f"seq {lines} | cat > {workspace.directory}/cat.log"], check=True)
    floor = time.perf_counter() - start
    size = (workspace.directory / "cat.log").stat().st_size / 1e6
    command = secure_launch(workspace, 1)[:-1]
    start = time.perf_counter()
    subprocess.run([*command, str(file)], env=workspace.environment(), capture_output=True, check=True)
    ours = time.perf_counter() - start
    logged = (workspace.directory / "log/latest/launch.log").read_bytes().count(b"[seq-1] ")
    print(
        f"\noutput of {size:.0f} MB in {lines} lines: cat {size / floor:.0f} MB/s, secure-launch {size / ours:.0f} MB/s"
    )
    print(f"  lines in launch.log: {logged} of {lines}")


def main() -> None:
    with tempfile.TemporaryDirectory() as directory:
        workspace = Workspace(Path(directory))
        report_starts(workspace)
        report_output(workspace)


if __name__ == "__main__":
    main()
