"""Inference on the projects of the LiSA4ROS2 paper (tables 2 and 3): speed against its floor, and the counts.

    python bench/infer.py --share FOLDER...     any sources: files that import rclpy and have every name known
    python bench/infer.py --cpp FOLDER...       C++ sources: cold, after an edit, warm; nodes, interfaces, gaps
    python bench/infer.py FOLDER [--counts]     FOLDER: ``ros-tests`` of lisa-analyzer/lisa4ros2
    LISA4ROS2_TESTS=FOLDER python bench/infer.py

    floor     ``ast.parse`` of the same files
    ours      ``infer_paths`` of the folder: reading, parsing, analysis, results
    paper     table 3, total of parsing and analysis on a MacBook Pro of 2019

Every figure is the best of BENCH_RUNS (3); BENCH_CLOCK=process_time counts only our own processor time on a
machine that others use too. ``--counts`` compares nodes, topics, services, actions, publishers, subscriptions,
servers and clients with table 2, system part included (three topics; per node three publishers, one
subscription, seven services). A name that is not known in full counts as a channel of its own, as there.
"""

from __future__ import annotations

import argparse
import ast
import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from enclave_addons.inference import InferredSystem, infer_paths  # noqa: E402
from enclave_addons.inference.report.written import expand  # noqa: E402
from nodl.names import expand_name  # noqa: E402
from nodl.node_interface import Certainty, Endpoint, EndpointKind, NodeInterface  # noqa: E402

RUNS = int(os.environ.get("BENCH_RUNS", "3"))
CLOCK: Callable[[], float] = getattr(time, os.environ.get("BENCH_CLOCK", "perf_counter"))
COLUMNS = ("N", "T", "S", "A", "PUB", "SUB", "SS", "SC", "AS", "AC")

# folder: milliseconds in table 3, then the columns of table 2
PAPER: dict[str, tuple[int, tuple[int, ...]]] = {
    "pubsub_minimal": (2291, (2, 4, 14, 0, 7, 3, 14, 0, 0, 0)),
    "pubsub_minimal_oldschool": (2344, (2, 4, 14, 0, 7, 3, 14, 0, 0, 0)),
    "services_minimal": (2608, (2, 3, 15, 0, 6, 2, 15, 1, 0, 0)),
    "actions_minimal": (2910, (2, 3, 14, 1, 6, 2, 14, 0, 1, 1)),
    "mechaship": (4587, (5, 8, 38, 0, 18, 13, 35, 3, 0, 0)),
    "solar-ros": (2976, (6, 4, 44, 0, 19, 7, 44, 3, 0, 0)),
    "ROS-LLM": (3467, (4, 9, 30, 0, 19, 6, 30, 1, 0, 0)),
    "Catch2023_hichewns": (7710, (8, 30, 56, 0, 52, 34, 56, 0, 0, 0)),
    "fruit_collectors": (3374, (2, 6, 15, 0, 8, 5, 15, 1, 0, 0)),
    "spatial-topology-teleoperation": (2745, (2, 10, 14, 0, 11, 5, 14, 0, 0, 0)),
    "ProjectMarch": (4394, (5, 13, 37, 1, 25, 9, 38, 0, 0, 1)),
    "5g_drone_ROS2": (3607, (6, 12, 53, 0, 20, 15, 45, 11, 0, 0)),
    "virtuoso": (16585, (52, 98, 378, 1, 288, 135, 371, 11, 0, 1)),
    "eml4842_gps_nav": (4212, (7, 12, 50, 0, 28, 15, 50, 2, 0, 0)),
    "MARV-ROS": (5302, (7, 51, 49, 0, 59, 42, 49, 0, 0, 0)),
    "module89": (10199, (15, 28, 113, 0, 71, 33, 111, 7, 0, 0)),
    "zumopi": (6836, (5, 22, 35, 0, 35, 34, 35, 0, 0, 0)),
}


def best(action: Callable[[], object]) -> float:
    """Seconds of the fastest of ``RUNS`` runs."""
    times = []
    for _ in range(RUNS):
        start = CLOCK()
        action()
        times.append(CLOCK() - start)
    return min(times)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", nargs="?", default=os.environ.get("LISA4ROS2_TESTS"))
    parser.add_argument("--counts", action="store_true")
    parser.add_argument("--share", nargs="+", metavar="FOLDER", help="sources of your choice")
    parser.add_argument("--cpp", nargs="+", metavar="FOLDER", help="C++ sources of your choice")
    args = parser.parse_args()
    if args.cpp:
        print(
            f"{'sources':24}{'cold cpu s':>12}{'cold s':>9}{'warm cpu s':>12}{'warm s':>9}{'nodes':>7}{'programs':>10}"
            f"{'known':>11}{'complete':>10}{'gaps':>6}"
        )
        for given in args.cpp:
            compiled(Path(given))
        return 0
    if args.share:
        for given in args.share:
            share(Path(given))
        return 0
    if args.folder is None or not Path(args.folder, "virtuoso").is_dir():
        print("not available: name the folder ros-tests of lisa-analyzer/lisa4ros2 (or LISA4ROS2_TESTS)")
        return 0
    folder = Path(args.folder)
    if args.counts:
        compare(folder)
    else:
        measure(folder)
    return 0


def measure(folder: Path) -> None:
    print(f"{'project':32}{'floor ms':>10}{'ours ms':>10}{'ratio':>8}{'paper ms':>10}")
    totals = [0.0, 0.0, 0.0]
    for project, (paper, _) in PAPER.items():
        sources = [path.read_bytes() for path in sorted((folder / project).glob("*.py"))]
        floor = best(lambda sources=sources: [ast.parse(source) for source in sources])  # type: ignore[misc]
        ours = best(lambda project=project: infer_paths([folder / project]))  # type: ignore[misc]
        row(project, floor, ours, paper)
        totals = [totals[0] + floor, totals[1] + ours, totals[2] + paper]
    row("all", totals[0], totals[1], int(totals[2]))


def row(project: str, floor: float, ours: float, paper: int) -> None:
    print(f"{project:32}{floor * 1e3:10.1f}{ours * 1e3:10.1f}{ours / floor:8.1f}{paper:10}")


# --- share of programs with every name known ------------------------------------------------------------------


def share(folder: Path) -> None:
    """Strictly: a file counts when it imports rclpy and nothing in it is open."""
    sources = {str(path.absolute()): path.read_bytes() for path in sorted(folder.rglob("*.py"))}
    programs = {
        path for path, source in sources.items() if b"import rclpy" in source or b"from rclpy" in source
    }
    floor = best(lambda: [_parsed(source) for source in sources.values()])
    started = CLOCK()
    system = infer_paths([folder])
    ours = CLOCK() - started
    unknown = {question.source.file for question in expand(system).unresolved}
    row(folder.name, floor, ours, 0)
    print(
        f"    {len(programs - unknown)} of {len(programs)} files have every name known; {len(system.nodes)} nodes"
    )


def _parsed(source: bytes) -> ast.Module | None:
    try:
        return ast.parse(source)
    except (SyntaxError, ValueError):
        return None


# --- C++: cold and from the cache -------------------------------------------------------------------------------


def compiled(folder: Path) -> None:
    """With an empty cache, then again. ``known``: interfaces whose name is known, at least as a parameter with its
    default; ``complete``: nodes without a gap and with every name known; ``gaps``: each place and reason once."""
    with tempfile.TemporaryDirectory() as kept:
        os.environ["XDG_CACHE_HOME"] = kept
        before, started = processor_seconds(), time.perf_counter()
        system = infer_paths([folder])
        cold, cold_wall = processor_seconds() - before, time.perf_counter() - started
        before, started = processor_seconds(), time.perf_counter()
        infer_paths([folder])
        warm, warm_wall = processor_seconds() - before, time.perf_counter() - started
    ends = [endpoint for node in system.nodes for endpoint in node.endpoints]
    known = [each for each in ends if each.certainty not in (Certainty.UNKNOWN, Certainty.PATTERN)]
    gaps = {(gap.source, gap.why) for gap in (*system.gaps, *(g for node in system.nodes for g in node.gaps))}
    complete = [
        node for node in system.nodes if not node.gaps and all(each in known for each in node.endpoints)
    ]
    programs = {(node.package, node.executable, node.plugin) for node in system.nodes}
    print(
        f"{folder.name:24}{cold:12.1f}{cold_wall:9.1f}{warm:12.2f}{warm_wall:9.2f}{len(system.nodes):7}{len(programs):10}"
        f"{f'{len(known)}/{len(ends)}':>11}{len(complete):10}{len(gaps):6}",
        flush=True,
    )


def processor_seconds() -> float:
    """Of this process and those that it started."""
    return sum(
        usage.ru_utime + usage.ru_stime
        for usage in (resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN))
    )


# --- counts -------------------------------------------------------------------------------------------------


def compare(folder: Path) -> None:
    print(f"{'project':32}" + "".join(f"{column:>6}" for column in COLUMNS))
    for project, (_, expected) in PAPER.items():
        found = counts(infer_paths([folder / project]))
        cells = (str(a) if a == b else f"{a}/{b}" for a, b in zip(found, expected, strict=True))
        print(f"{project:32}" + "".join(f"{cell:>8}" if "/" in cell else f"{cell:>6}" for cell in cells))
    print("ours/paper where they differ")


def counts(system: InferredSystem) -> tuple[int, ...]:
    nodes = len(system.nodes)
    ends = [(node, endpoint) for node in system.nodes for endpoint in node.endpoints]

    def of(*kinds: EndpointKind) -> list[tuple[NodeInterface, Endpoint]]:
        return [(node, endpoint) for node, endpoint in ends if endpoint.kind in kinds]

    def channels(*kinds: EndpointKind) -> int:
        return len({channel(node, endpoint) for node, endpoint in of(*kinds)})

    kind = EndpointKind
    return (
        nodes,
        channels(kind.PUBLISHER, kind.SUBSCRIPTION) + 3,
        channels(kind.SERVICE_SERVER, kind.SERVICE_CLIENT) + 7 * nodes,
        channels(kind.ACTION_SERVER, kind.ACTION_CLIENT),
        len(of(kind.PUBLISHER)) + 3 * nodes,
        len(of(kind.SUBSCRIPTION)) + nodes,
        len(of(kind.SERVICE_SERVER)) + 7 * nodes,
        len(of(kind.SERVICE_CLIENT)),
        len(of(kind.ACTION_SERVER)),
        len(of(kind.ACTION_CLIENT)),
    )


def channel(node: NodeInterface, endpoint: Endpoint) -> object:
    name_template = endpoint.name.unconditional
    if not name_template.is_literal:
        return endpoint.source, str(name_template)
    return expand_name(name_template.text, namespace=node.namespace or "/", node=node.name or "node")


if __name__ == "__main__":
    raise SystemExit(main())
