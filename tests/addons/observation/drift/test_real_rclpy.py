"""Real rclpy nodes (jazzy, Fast DDS) run as planned from their source: no finding; who joins them is found."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.addons.observation.graph.nodes import LONGEST_SECONDS
from tests.addons.observation.ros_graph.conftest import environment as environment
from tests.addons.observation.ros_graph.conftest import prefix as prefix
from tests.addons.recording.conftest import rclpy_python
from tests.dds.conftest import domain_id as domain_id

pytestmark = pytest.mark.dds

NODES = """
  <node pkg="graph_nodes" exec="server" namespace="s"><remap from="start" to="begin"/></node>
  <node pkg="graph_nodes" exec="client" namespace="s"><remap from="start" to="begin"/></node>
  <node pkg="graph_nodes" exec="pair"><remap from="chatter" to="news"/></node>"""


def test_a_launch_of_real_nodes_is_as_planned_until_somebody_joins(
    tmp_path: Path, prefix: Path, environment: dict[str, str], domain_id: int
) -> None:
    environment["ROS_DOMAIN_ID"] = str(domain_id)
    file = tmp_path / "real.launch.xml"
    file.write_text(f"<launch>{NODES}\n</launch>\n")

    def drift() -> tuple[int, dict[str, Any]]:
        command = [sys.executable, "-m", "enclave_addons.review.verb", "drift", "--prefix", str(prefix)]
        ran = subprocess.run(
            [*command, str(file), "--for", str(LONGEST_SECONDS), "--settle", "5", "--format", "json"],
            env=environment, capture_output=True, text=True, timeout=180,
        )  # fmt: skip
        assert ran.stdout, ran.stderr
        return ran.returncode, json.loads(ran.stdout)

    launch = subprocess.Popen(
        [sys.executable, "-m", "enclave_launch", "-n", "--prefix", str(prefix), str(file)],
        env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        status, document = drift()
        assert (status, document["findings"]) == (0, [])
        assert document["nodes"] == ["/below/two", "/one", "/s/client", "/s/server"]
        talker = prefix / "lib" / "graph_nodes" / "talker"
        intruder = subprocess.Popen([str(rclpy_python("jazzy")), str(talker)], env=environment)
        try:
            end = time.monotonic() + LONGEST_SECONDS
            while (found := drift())[0] == 0 and time.monotonic() < end:
                pass
            assert {(each["kind"], each["subject"]) for each in found[1]["findings"]} == {
                ("unplanned-node", "/talker")
            }
        finally:
            intruder.kill()
            intruder.wait()
    finally:
        launch.send_signal(2)
        launch.wait(60)
