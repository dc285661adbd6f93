"""The secured run of the README, and what it shows of the keystore afterwards."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.addons.observation.graph.nodes import LOOPBACK
from tests.dds.conftest import domain_id as domain_id

ROOT = Path(__file__).parent.parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.dds
def test_the_secured_run_prints_what_the_readme_shows(tmp_path: Path, domain_id: int) -> None:
    """Its lines, but for process numbers, times and the count that the listener begins with."""
    environment = {
        **{name: value for name, value in os.environ.items() if not name.startswith(("ROS_", "AMENT_"))},
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "ROS_DOMAIN_ID": str(domain_id),
        **LOOPBACK,
    }
    (tmp_path / "fixtures").symlink_to(ROOT / "fixtures")
    blocks = re.findall(r"^```text\n(\$ .*?)\n```$", README, re.S | re.M)
    assert len(blocks) == 2
    for line in "\n".join(blocks).splitlines():
        if line.startswith("$ "):
            printed = subprocess.run(
                shlex.split(line[2:]),
                cwd=tmp_path, env=environment, text=True, check=True, timeout=120,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            ).stdout.replace(f"{tmp_path}/", "/home/me/enclave-launch/")  # fmt: skip
            lines = {without_numbers(each) for each in printed.splitlines()}
        elif line != "...":
            assert without_numbers(line) in lines, f"{line}\nis not in what was printed:\n{printed}"


def without_numbers(line: str) -> str:
    return re.sub(r"(?<=pid )\[?\d+|: \d+|\d{4}-\d\d-\d\dT[\d:]+Z", "#", line)
