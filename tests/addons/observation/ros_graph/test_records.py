"""Inference held against what the same nodes, on real rclpy, were recorded to ask for."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from nodl.verb import main as secure_nodl

NODES = ("talker", "server", "client", "pair")


@pytest.fixture
def records(tmp_path: Path, prefix: Path, environment: dict[str, str]) -> Path:
    file = tmp_path / "all.launch.xml"
    nodes = "".join(f'<node pkg="graph_nodes" exec="{name}" namespace="ns"/>' for name in NODES)
    file.write_text(f"<launch>{nodes}</launch>")
    learn = ["--learn", str(tmp_path / "learnt"), "--learn-for", "3s", "--learn-isolation", "local"]
    command = [sys.executable, "-m", "enclave_launch", "--prefix", str(prefix), *learn, str(file)]
    subprocess.run(command, env=environment, capture_output=True, check=True, timeout=120)
    return tmp_path / "learnt"


def test_inference_says_what_was_recorded(
    records: Path, prefix: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["check-record", str(records), "--judge", "inference", "--format", "json"]
    status = secure_nodl([*arguments, "--prefix", str(prefix)])
    judged = json.loads(capsys.readouterr().out)
    assert {row["program"] for row in judged} == {f"graph_nodes/{name}" for name in NODES}
    assert all(row["says_something"] for row in judged)
    assert [row["differences"] for row in judged if row["differences"]] == []
    assert (status, sum(row["agreed"] for row in judged) > 5) == (0, True)
