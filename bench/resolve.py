"""How fast launch files are resolved: ours, the floor, and real launch, in the same run.

    python bench/resolve.py [runs]

ours    ``secure-launch --dry-run``'s evaluation as a whole process; "whole command" is all of the command
floor   a process that reads every file which was touched and parses it with lxml or PyYAML (libyaml), no more
real    a process that resolves the same file with the sources of ros2/launch, starting nothing
        (``REAL_LAUNCH_PYTHONPATH`` holds their PYTHONPATH; else "not available"). It imports rclpy and the messages as
        launch_ros does, where ``./dev test`` has put real ones (``.ros/jazzy``), and makes no node. "spared" is the
        same without that import.

``INSTALLED_PYTHON`` names the Python of an environment that has this package as a wheel; without it ours and the floor
run in the developer's own, whose editable installation costs both some 10 ms.

Nav2's bring-up is resolved from the checkout of navigation2 that ``NAVIGATION2`` names, its programs stood in for.

CPU seconds of the process and its children, the best of several runs (of real up to three). Two nodes are hardly more
than the import of launch_ros.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from bench.navigation2 import install_bringup  # noqa: E402
from bench.synthetic_stack import write_nodes, write_stack  # noqa: E402

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 5
PYTHON = os.environ.get("INSTALLED_PYTHON", sys.executable)
RCLPY_PYTHON = ROOT / ".ros" / "jazzy" / "bin" / "python"

# What launch_ros imports; composition_interfaces has no wheel.
RCLPY = """
import runpy, sys
import rclpy, rclpy.executors, rclpy.logging, rclpy.parameter, rclpy.utilities
import rclpy.validate_namespace, rclpy.validate_node_name
import lifecycle_msgs.msg, lifecycle_msgs.srv
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""

OURS = """
import gc, sys
from enclave_launch.evaluation.evaluate import evaluate
result = evaluate(sys.argv[1], [word.split(":=", 1) for word in sys.argv[2:]])
print(len(result.processes), len(result.components))
gc.freeze()  # ends as the command line does: without a last search for garbage
"""

COMMAND = """
import sys
from enclave_launch.verb.secure_launch import main
sys.exit(main(["--dry-run", *sys.argv[1:]]))
"""

FLOOR = """
import sys
from pathlib import Path
import lxml.etree
paths = [Path(line) for line in sys.stdin.read().split()]
for path in paths:
    if path.suffix == ".xml":
        lxml.etree.fromstring(path.read_bytes())
if any(path.suffix == ".yaml" for path in paths):
    import yaml
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    for path in paths:
        if path.suffix == ".yaml":
            yaml.load(path.read_text(), loader)
"""


def main() -> None:
    print(f"{'':28}{'ours':>9}{'floor':>9}{'real':>9}{'spared':>9}{'ours/floor':>12}{'real/ours':>11}")
    with tempfile.TemporaryDirectory() as folder:
        prefix = Path(folder)
        files = {
            "driving stack": write_stack(prefix),
            "two nodes": write_nodes(prefix, 2),
            "1,000 nodes": write_nodes(prefix, 1_000),
            "10,000 nodes": write_nodes(prefix, 10_000),
        }
        for name, file in files.items():
            # Real launch takes minutes for the largest file, and its time grows faster than the file.
            _row(name, file, prefix, real=name != "10,000 nodes")
        _row("two nodes, whole command", files["two nodes"], prefix, real=False, program=COMMAND)
    _nav2_rows()
    _print_memory()


def _nav2_rows() -> None:
    checkout = os.environ.get("NAVIGATION2")
    if checkout is None:
        print("nav2's bring-up: not available (NAVIGATION2 names no checkout)")
        return
    with tempfile.TemporaryDirectory() as folder:
        prefix = Path(folder)
        file = install_bringup(Path(checkout), prefix)
        for composed in (True, False):
            name = f"nav2 bring-up, {'' if composed else 'not '}composed"
            given = [f"use_composition:={composed}", f"map:={file.parent.parent}/maps/depot.yaml"]
            _row(name, file, prefix, given)


def _row(
    name: str,
    file: Path,
    prefix: Path,
    arguments: Sequence[str] = (),
    *,
    real: bool = True,
    program: str = OURS,
) -> None:
    ours_at = [] if "INSTALLED_PYTHON" in os.environ else [str(ROOT)]
    python_path = os.pathsep.join([*ours_at, str(prefix / "python")])
    environment = {**os.environ, "AMENT_PREFIX_PATH": str(prefix), "PYTHONPATH": python_path}
    touched = "\n".join(_touched(file, prefix))
    ours = _best([PYTHON, "-c", program, str(file), *arguments], environment)
    floor = _best([PYTHON, "-c", FLOOR], environment, touched)
    peer = os.environ.get("REAL_LAUNCH_PYTHONPATH")
    line = f"{name:28}{ours:9.3f}{floor:9.3f}"
    if peer is None or not real:
        print(f"{line}{'-':>9}{'-':>9}{ours / floor:12.2f}{'not available':>15}", flush=True)
        return
    environment["PYTHONPATH"] = os.pathsep.join([peer, str(prefix / "python")])
    spared = _real([sys.executable], file, environment, arguments)
    whole = spared
    if RCLPY_PYTHON.exists():
        whole = _real([str(RCLPY_PYTHON), "-c", RCLPY], file, environment, arguments)
    print(f"{line}{whole:9.3f}{spared:9.3f}{ours / floor:12.2f}{whole / ours:11.1f}", flush=True)


def _touched(file: Path, prefix: Path) -> list[str]:
    """Every launch file and parameter file that a resolution of ``file`` opens."""
    if file.parent.parent.name == "many":
        return [str(file)]
    if file.name == "bringup_launch.py":
        return [str(file.parent.parent / "params" / "nav2_params.yaml")]
    share = prefix / "share"
    return [str(path) for pattern in ("*/launch/*.xml", "*/config/*.yaml") for path in share.glob(pattern)
            if path.parent.parent.name != "many"]  # fmt: skip


def _real(python: Sequence[str], file: Path, environment: dict[str, str], arguments: Sequence[str]) -> float:
    job = {"file": str(file), "arguments": list(arguments), "environment": {}, "folder": str(file.parent)}
    driver = ROOT / "tests" / "conformance" / "real_driver.py"
    environment = {**environment, "PYTHONWARNINGS": "ignore"}
    runs = 1 if file.name.startswith(("stack", "many_1")) else min(RUNS, 3)  # those take seconds
    return _best([*python, str(driver)], environment, json.dumps([job]), runs)


def _best(
    command: Sequence[str], environment: dict[str, str] | None = None, text: str = "", runs: int = RUNS
) -> float:
    return min(_cpu_seconds(lambda: _run(command, environment, text)) for _ in range(runs))


def _run(command: Sequence[str], environment: dict[str, str] | None, text: str) -> None:
    subprocess.run(command, env=environment, input=text, text=True, check=True, capture_output=True)


def _cpu_seconds(work: Callable[[], None]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    work()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def _print_memory() -> None:
    """Resident memory after 10 and after 60 evaluations in one process."""
    with tempfile.TemporaryDirectory() as folder:
        file = write_nodes(Path(folder), 200)
        script = (
            "import sys, resource\nfrom enclave_launch.evaluation.evaluate import evaluate\n"
            "for count in range(60):\n    evaluate(sys.argv[1])\n    if count in (9, 59):\n"
            "        print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)\n"
        )
        environment = {**os.environ, "AMENT_PREFIX_PATH": folder, "PYTHONPATH": str(ROOT)}
        result = subprocess.run([sys.executable, "-c", script, str(file)], env=environment, text=True,
                                capture_output=True, check=True)  # fmt: skip
    first, last = (int(line) / 1024 for line in result.stdout.split())
    print(f"peak memory, MB: {first:.1f} after 10 evaluations, {last:.1f} after 60")


if __name__ == "__main__":
    main()
