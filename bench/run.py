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

import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "ros2"))

if TYPE_CHECKING:
    from tests.ros2 import upstream
else:
    import upstream

RUNS = int(os.environ.get("BENCH_RUNS", "5"))
NODES = 50
PACKAGE = "bench_nodes"

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
    """Milliseconds from the command to the start of its first and of its last process; CPU time of the whole."""

    first: float
    last: float
    cpu: float


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
        self.site = directory / "site"
        if not upstream.missing():
            upstream.install(self.site, self.prefix)
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
        inherited = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        return {
            **inherited,
            "PYTHONPYCACHEPREFIX": str(self.directory / "bytecode"),
            "BENCH_STAMPS": str(self.stamps),
            "AMENT_PREFIX_PATH": os.pathsep.join(filter(None, prefixes)),
            "PYTHONPATH": os.pathsep.join(
                [str(self.site), str(ROOT / "tests/ros2"), os.environ.get("PYTHONPATH", "")]
            ),
            "ROS_LOG_DIR": str(self.directory / "log"),
        }

    def time(self, command: list[str]) -> Times:
        self.stamps.unlink(missing_ok=True)
        used = cpu_of_children()
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
        return Times((min(stamps) - start) / 1e6, (max(stamps) - start) / 1e6, cpu_of_children() - used)


def cpu_of_children() -> float:
    """Milliseconds, of all that have ended: less disturbed by a busy machine than the clock."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (usage.ru_utime + usage.ru_stime) * 1e3


def secure_launch(workspace: Workspace, count: int, *options: str) -> list[str]:
    program = [
        sys.executable,
        "-c",
        "import sys; from enclave_launch.verb.secure_launch import main; sys.exit(main())",
    ]
    return [*program, *options, str(workspace.launch_file(count))]


def secured(workspace: Workspace, count: int) -> list[str]:
    return secure_launch(workspace, count, "--secure", "--keystore", str(workspace.keystore))


def ros2_launch(workspace: Workspace, count: int) -> list[str]:
    return [sys.executable, str(ROOT / "tests/ros2/ros2_launch.py"), str(workspace.launch_file(count))]


def median(measure: Callable[[], Times], prepare: Callable[[], object] = lambda: None) -> Times:
    """The first run only warms caches: bytecode, files."""
    results = []
    for _ in range(RUNS + 1):
        prepare()
        results.append(measure())
    del results[0]
    return Times(*(statistics.median(values) for values in zip(*map(astuple, results), strict=True)))


def measured(workspace: Workspace, count: int) -> Iterable[tuple[str, Times | None]]:
    def forget() -> None:
        shutil.rmtree(workspace.keystore, ignore_errors=True)

    floor = [sys.executable, "-c", FLOOR, str(workspace.program), str(count)]
    yield "floor", median(lambda: workspace.time(floor))
    yield "plain", median(lambda: workspace.time(secure_launch(workspace, count)))
    yield "secured, cold", median(lambda: workspace.time(secured(workspace, count)), forget)
    yield "secured, warm", median(lambda: workspace.time(secured(workspace, count)))
    peer = ros2_launch(workspace, count)
    yield "ros2 launch", median(lambda: workspace.time(peer)) if workspace.site.is_dir() else None


def report_starts(workspace: Workspace) -> None:
    for count in (1, NODES):
        rows = dict(measured(workspace, count))
        peer, floor, plain, warm = (rows[name] for name in ("ros2 launch", "floor", "plain", "secured, warm"))
        assert floor is not None and plain is not None and warm is not None
        title = f"{count} node(s), median of {RUNS}"
        print(f"\n{title:24} {'first':>10} {'last':>10} {'CPU':>10} {'x floor':>9} {'x ros2 launch':>14}")
        for name, times in rows.items():
            if times is None:
                print(f"  {name:22} not available")
                continue
            ratio = f"{times.last / peer.last:14.2f}" if peer else f"{'-':>14}"
            columns = f"{times.first:7.0f} ms {times.last:7.0f} ms {times.cpu:7.0f} ms"
            print(f"  {name:22} {columns} {times.last / floor.last:9.1f} {ratio}")
        added = f"{warm.last - plain.last:+.0f} ms until the last process, {warm.cpu - plain.cpu:+.0f} ms CPU"
        print(f"  --secure on a warm keystore: {added}")


def report_output(workspace: Workspace, title: str, command: str) -> None:
    """One process that writes as fast as it can; ours adds name and time to each line and writes launch.log."""
    file = workspace.directory / "output.launch.xml"
    file.write_text(f'<launch><executable cmd="{command}" shell="true" output="log" name="noise"/></launch>')
    plain = workspace.directory / "cat.log"
    start = time.perf_counter()
    subprocess.run(["sh", "-c", f"{command} | cat > {plain}"], check=True)
    floor = time.perf_counter() - start
    size, lines = plain.stat().st_size / 1e6, plain.read_bytes().count(b"\n")
    used, start = cpu_of_children(), time.perf_counter()
    launch = [*secure_launch(workspace, 1)[:-1], str(file)]
    subprocess.run(launch, env=workspace.environment(), capture_output=True, check=True)
    ours, cpu = time.perf_counter() - start, (cpu_of_children() - used) / 1e3
    logged = (workspace.directory / "log/latest/launch.log").read_bytes().count(b" [noise-1] ")
    rates = (
        f"cat {size / floor:.0f} MB/s, secure-launch {size / ours:.0f} MB/s (start included; {cpu:.1f} s CPU)"
    )
    print(f"\n{title}, {size:.0f} MB in {lines} lines: {rates}\n  lines in launch.log: {logged} of {lines}")


def main() -> None:
    with tempfile.TemporaryDirectory() as directory:
        workspace = Workspace(Path(directory))
        report_starts(workspace)
        report_output(workspace, "output, long lines", "yes " + "x" * 99 + " | head -n 3000000")
        report_output(workspace, "output, short lines", "seq 5000000")


if __name__ == "__main__":
    main()
