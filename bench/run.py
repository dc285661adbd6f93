"""How long from the command to the first and the last process, and what ``--secure`` adds to that.

Times whole commands as a person starts them: interpreter, imports, evaluation, keystore, process. The nodes are small
shell scripts that write down when they were started; each has an enclave of its own.

    floor                the interpreter starting the same programs with nothing decided
    plain                secure-launch
    secured, cold        secure-launch --secure, keystore created in the run
    secured, warm        the same with everything in the keystore already
    ros2 launch          upstream's engine without security
    ros2 launch, warm    upstream's engine with our --secure and everything in the keystore already

The last two where launch, launch_ros and ros2launch are importable, from a sourced workspace or from the folders in
``REAL_LAUNCH_PYTHONPATH``; only they get these on their path.

What makes the figures hold on a machine that does other things, too: every round runs each variant once, in random
order, so that a disturbance meets all alike; a figure is the median over rounds (``BENCH_RUNS``,
by default 15) after two that only warm caches; what ``--secure`` adds is the median of the differences *within*
rounds, shown with its quartiles and with the difference of the least disturbed runs. CPU time counts launcher and
nodes together.

Also: output through our pumps to a file, against ``cat``.
"""

from __future__ import annotations

import os
import random
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "ros2"))

if TYPE_CHECKING:
    from tests.addons.ros2 import upstream
else:
    import upstream

REAL_LAUNCH = [path for path in os.environ.get("REAL_LAUNCH_PYTHONPATH", "").split(os.pathsep) if path]
sys.path.extend(REAL_LAUNCH)
ROUNDS = int(os.environ.get("BENCH_RUNS", "15"))
NODES = 50
_WARMING = 2
PACKAGE = "bench_nodes"

SCRIPT = """#!/bin/bash
echo "$EPOCHREALTIME" >> "$BENCH_STAMPS"
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


COLUMNS = ("first", "last", "cpu")


class Workspace:
    """An ament prefix with one node, launched once and ``NODES`` times."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.prefix = directory / "prefix"
        self.stamps = directory / "stamps"
        self.program = self.prefix / "lib" / PACKAGE / "node"
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
                f'<node pkg="{PACKAGE}" exec="node" name="n{number}" namespace="/r{number % 10}" enclave="e{number}"/>'
                for number in range(count)
            )
            self.launch_file(count).write_text(f"<launch>{lines}</launch>")

    def launch_file(self, count: int) -> Path:
        return self.directory / f"{count}.launch.xml"

    def environment(self, path: Sequence[str] = ()) -> dict[str, str]:
        prefixes = [str(self.prefix), os.environ.get("AMENT_PREFIX_PATH", "")]
        inherited = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        return {
            **inherited,
            "PYTHONPYCACHEPREFIX": str(self.directory / "bytecode"),
            "BENCH_STAMPS": str(self.stamps),
            "AMENT_PREFIX_PATH": os.pathsep.join(filter(None, prefixes)),
            "PYTHONPATH": os.pathsep.join(filter(None, [*path, os.environ.get("PYTHONPATH", "")])),
            "ROS_LOG_DIR": str(self.directory / "log"),
        }

    def time(self, variant: Variant, count: int) -> Times:
        if variant.forgets is not None:
            shutil.rmtree(variant.forgets, ignore_errors=True)
        self.stamps.unlink(missing_ok=True)
        used, start = cpu_of_children(), time.time()
        done = subprocess.run(
            variant.command,
            env=self.environment(variant.path),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise SystemExit(f"{' '.join(variant.command)} failed:\n{done.stdout}{done.stderr}")
        stamps = self.all_stamps(count)
        return Times((min(stamps) - start) * 1e3, (max(stamps) - start) * 1e3, cpu_of_children() - used)

    def all_stamps(self, count: int) -> list[float]:
        """Seconds since the epoch at which each node was started; the floor does not wait for them to end."""
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline:
            lines = self.stamps.read_text().splitlines() if self.stamps.is_file() else []
            if len(lines) == count:
                return [float(line.replace(",", ".")) for line in lines]
            time.sleep(0.005)
        raise SystemExit(f"{len(lines)} of {count} nodes were started")


def cpu_of_children() -> float:
    """Milliseconds, of all that have ended: less disturbed by a busy machine than the clock."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (usage.ru_utime + usage.ru_stime) * 1e3


@dataclass(frozen=True)
class Variant:
    """One way to start the nodes. ``path``: before its PYTHONPATH; ``forgets``: a keystore removed before each run."""

    command: Sequence[str]
    path: tuple[str, ...] = ()
    forgets: Path | None = None


def secure_launch(*words: str) -> list[str]:
    main = "import sys; from enclave_launch.verb.secure_launch import main; sys.exit(main())"
    return [sys.executable, "-c", main, *words]


def secured_by(keystore: Path) -> list[str]:
    return ["--secure", "--keystore", str(keystore)]


def variants(workspace: Workspace, count: int) -> Mapping[str, Variant]:
    file = str(workspace.launch_file(count))
    cold, warm = (workspace.directory / f"{name}-{count}" for name in ("cold", "warm"))
    found = {
        "floor": Variant([sys.executable, "-c", FLOOR, str(workspace.program), str(count)]),
        "plain": Variant(secure_launch(file)),
        "secured, cold": Variant(secure_launch(*secured_by(cold), file), forgets=cold),
        "secured, warm": Variant(secure_launch(*secured_by(warm), file)),
    }
    if workspace.site.is_dir():
        peer = [sys.executable, str(ROOT / "tests/addons/ros2/ros2_launch.py")]
        path = (str(workspace.site), str(ROOT / "tests/addons/ros2"), str(ROOT), *REAL_LAUNCH)
        found["ros2 launch"] = Variant([*peer, file], path)
        found["ros2 launch, warm"] = Variant([*peer, *secured_by(warm), file], path)
    return found


def measured(workspace: Workspace, count: int) -> Mapping[str, list[Times]]:
    """All rounds of all variants but those that warm caches: bytecode, files, keystores and what is known of them."""
    chosen = variants(workspace, count)
    results: dict[str, list[Times]] = {name: [] for name in chosen}
    for _ in range(_WARMING + ROUNDS):
        for name in random.sample(list(chosen), len(chosen)):
            results[name].append(workspace.time(chosen[name], count))
    return {name: times[_WARMING:] for name, times in results.items()}


def median(times: Sequence[Times]) -> Times:
    return Times(*(statistics.median(getattr(item, column) for item in times) for column in COLUMNS))


def report_starts(workspace: Workspace) -> None:
    for count in (1, NODES):
        results = measured(workspace, count)
        rows = {name: median(times) for name, times in results.items()}
        peer = rows.get("ros2 launch")
        title = f"{count} node(s), median of {ROUNDS}"
        print(f"\n{title:24} {'first':>10} {'last':>10} {'CPU':>10} {'x floor':>9} {'x ros2 launch':>14}")
        for name, times in rows.items():
            ratio = f"{times.last / peer.last:14.2f}" if peer else f"{'-':>14}"
            columns = f"{times.first:7.0f} ms {times.last:7.0f} ms {times.cpu:7.0f} ms"
            print(f"  {name:22} {columns} {times.last / rows['floor'].last:9.1f} {ratio}")
        if peer is None:
            print(f"  ros2 launch            not available: no {', '.join(upstream.missing())}")
        for before, after in (("plain", "secured, warm"), ("ros2 launch", "ros2 launch, warm")):
            if before in results:
                print(
                    f"  {after!r} adds to {before!r}:",
                    *differences(results[before], results[after]),
                    sep="\n    ",
                )


def differences(before: Sequence[Times], after: Sequence[Times]) -> Iterator[str]:
    """Of runs in the same round."""
    labels = ("until the first process", "until the last process", "CPU")
    for column, label in zip(COLUMNS, labels, strict=True):
        less, more = ([getattr(one, column) for one in times] for times in (before, after))
        low, middle, high = statistics.quantiles([b - a for a, b in zip(less, more, strict=True)], n=4)
        spread = f"half of the rounds between {low:+.1f} and {high:+.1f}"
        yield f"{label:24} {middle:+6.1f} ms  ({spread}; fastest against fastest {min(more) - min(less):+.1f})"


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
    launch = secure_launch(str(file))
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
