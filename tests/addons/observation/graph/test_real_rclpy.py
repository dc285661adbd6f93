"""Real rclpy nodes (jazzy, Fast DDS): the graph that is observed without ROS is the one that rclpy itself shows."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from enclave_addons.observation.graph.cyclone import CycloneObserver
from enclave_addons.observation.graph.json_form import graph_from_document
from enclave_addons.observation.graph.model import Graph
from tests.addons.observation.graph.nodes import wait_for
from tests.addons.recording.conftest import rclpy_python

pytestmark = pytest.mark.dds

ROOT = Path(__file__).parents[4]
NODES = Path(__file__).parents[1] / "ros_graph" / "nodes"
ASK_RCLPY = """
import json, sys
from enclave_addons.observation.graph.json_form import graph_document
from enclave_addons.observation.graph.observing import Quiet, observe_until
from enclave_addons.observation.graph.rclpy_graph import RclpyObserver
observer = RclpyObserver()
observe_until(observer, lambda: {node.fqn for node in observer.graph().nodes} >= set(sys.argv[1:]))
observe_until(observer, Quiet(observer, 2.0, 30.0))
print(json.dumps(graph_document(observer.graph())))
observer.close()
"""
WANTED = {"/one", "/below/two", "/server", "/client"}


@pytest.fixture
def environment(domain_id: int, tmp_path: Path) -> dict[str, str]:
    return {
        **os.environ,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(domain_id),
        "ROS_LOG_DIR": str(tmp_path),
        "PYTHONPATH": str(ROOT),
        "PYTHONDONTWRITEBYTECODE": "1",
    }


@pytest.fixture
def pids(environment: dict[str, str]) -> Iterator[dict[str, int]]:
    """Two nodes in one process, a server and a client of services and actions in others."""
    python = str(rclpy_python("jazzy"))
    with ExitStack() as ending:
        started = {}
        for program in ("pair", "server", "client"):
            process = subprocess.Popen([python, str(NODES / program)], env=environment)
            ending.callback(process.wait)
            ending.callback(process.kill)
            started[program] = process.pid
        yield started


def shown(graph: Graph) -> set[tuple[str, str, str, str]]:
    return {
        (node.fqn, each.kind.value, each.name, each.type)
        for node in graph.nodes
        if node.fqn in WANTED
        for each in node.interfaces
        if each.complete
    }


def test_the_graph_is_the_one_that_rclpy_shows_and_each_node_is_in_its_process(
    pids: dict[str, int], environment: dict[str, str], domain_id: int
) -> None:
    ran = subprocess.run(
        [str(rclpy_python("jazzy")), "-c", ASK_RCLPY, *WANTED],
        env=environment, capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    by_rclpy = graph_from_document(json.loads(ran.stdout))
    assert {node.fqn for node in by_rclpy.nodes} >= WANTED
    observer = CycloneObserver(domain_id, environment)
    try:
        graph = wait_for(
            observer,
            lambda graph: shown(graph) == shown(by_rclpy) and all(each.listed for each in graph.processes),
        )
    finally:
        observer.close()
    assert shown(graph) == shown(by_rclpy)
    assert {(*sorted(node.fqn for node in each.nodes), each.participant.pid) for each in graph.processes} == {
        ("/below/two", "/one", pids["pair"]),
        ("/server", pids["server"]),
        ("/client", pids["client"]),
    }
    assert [each.name for process in graph.processes for each in process.unowned] == []
    assert {each.gid_size for each in graph.processes} == {16}
    together = [sorted(node.fqn for node in each.nodes) for each in by_rclpy.processes if len(each.nodes) > 1]
    assert together == [["/below/two", "/one"]], "rclpy's identifiers tell one process of two nodes"
