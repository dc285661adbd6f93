"""What recording costs: one endpoint, a program, a secured launch; with the recorder and without, in turns.

    rclpy, 1000 publishers    real rclpy of jazzy, one thread: time for each endpoint, and peak memory
    rclpy, start to end       a program of one node and its 12 lines
    stand-in, 16 threads      960 endpoints of a stand-in for rcl that does nothing: what the recorder itself takes
    secured launch            50 processes on the stand-in, --secure with a warm keystore, from the command to the end

Each pair runs in turns, BENCH_RUNS times (default 9); a figure is the least of them, which other work on the machine
disturbed least. Times are processor time, children included. Nothing is in the path of messages.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from enclave_addons.recording.programs import recorder_library, with_recorder
from tests.addons.recording.stand_in_launch import Program, asks, build_stand_in, make_workspace

ROOT = Path(__file__).resolve().parent.parent
ROUNDS = int(os.environ.get("BENCH_RUNS", "9"))
NODES = 50
RCLPY = """
import sys, time, resource, rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("bench")
start = time.process_time()
for i in range(int(sys.argv[1])):
    node.create_publisher(String, f"topic_{i}", 1)
print(time.process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


class Figures(NamedTuple):
    without: float
    recorded: float

    def line(self, what: str, unit: str, factor: float = 1.0) -> str:
        a, b = self.without * factor, self.recorded * factor
        return f"{what:34} {a:10.1f} {b:10.1f} {b - a:+10.1f}  {unit}"


def in_turns(measure: Callable[[bool], float]) -> Figures:
    results: dict[bool, list[float]] = {False: [], True: []}
    for turn in range(ROUNDS):
        for recorded in (turn % 2 == 0, turn % 2 == 1):
            results[recorded].append(measure(recorded))
    return Figures(min(results[False]), min(results[True]))


class Worn:
    """The environment with the recorder or without, and a record that begins empty."""

    def __init__(self, folder: Path) -> None:
        self._record = folder / "record"
        self._library = str(recorder_library())

    def environment(self, recorded: bool) -> Mapping[str, str]:
        self._record.write_bytes(b"")
        plain = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": "99"}
        return with_recorder(plain, self._library, str(self._record)) if recorded else plain


def rclpy_program(worn: Worn, recorded: bool, count: int) -> tuple[float, float]:
    """Seconds for the endpoints, KiB of peak memory."""
    python = ROOT / ".ros" / "jazzy" / "bin" / "python"
    command = [str(python), "-c", RCLPY, str(count)]
    ran = subprocess.run(command, env=worn.environment(recorded), capture_output=True, text=True, check=True)
    seconds, memory = ran.stdout.split()[-2:]
    return float(seconds), float(memory)


def timed(command: list[str], environment: Mapping[str, str]) -> float:
    """Seconds of processor time."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env=environment, capture_output=True, check=True, cwd=ROOT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def stand_in_threads(worn: Worn, folder: Path) -> Figures:
    program = folder / "many"
    program.symlink_to(folder / "program")
    (folder / "many.asks").write_text("node n\nmany 960 16\n")
    return in_turns(lambda recorded: timed([str(program)], worn.environment(recorded)))


def secured_launch(folder: Path, stand_in: Path) -> Figures:
    granted = (("publisher", "chatter"), ("subscription", "scan"))
    programs = [Program(f"node_{i}", f"node node_{i}\n{asks(granted)}", granted) for i in range(NODES)]
    workspace = make_workspace(folder / "ws", stand_in, programs)
    arguments = ["--prefix", str(workspace.folder), "--secure", "--keystore", str(folder / "ks")]
    target = ["stand_in_nodes", "all.launch.xml"]
    environment = {**os.environ, "ROS_LOG_DIR": str(folder / "log")}

    def launch(recorded: bool) -> float:
        explain = [] if recorded else ["--no-explain-denials"]
        return timed([sys.executable, "-m", "enclave_launch", *arguments, *explain, *target], environment)

    launch(True)  # makes the keystore
    return in_turns(launch)


def main() -> None:
    print(f"{'':34} {'without':>10} {'recorded':>10} {'':>10}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        worn = Worn(folder)
        stand_in = build_stand_in(folder)
        if (ROOT / ".ros" / "jazzy" / "bin" / "python").exists():
            many = in_turns(lambda recorded: rclpy_program(worn, recorded, 1000)[0])
            print(many.line("rclpy, 1000 publishers", "us for each", 1000))
            memory = in_turns(lambda recorded: rclpy_program(worn, recorded, 1000)[1])
            print(memory.line("rclpy, 1000 publishers", "KiB at most"))
            command = [str(ROOT / ".ros/jazzy/bin/python"), "-c", RCLPY, "1"]
            whole = in_turns(lambda recorded: timed(command, worn.environment(recorded)))
            print(whole.line("rclpy, start to end", "ms", 1000))
        print(stand_in_threads(worn, folder).line("stand-in, 960 in 16 threads", "us for each", 1e6 / 960))
        print(secured_launch(folder, stand_in).line(f"secured launch, {NODES} processes", "ms", 1000))


if __name__ == "__main__":
    main()
