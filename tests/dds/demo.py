"""Starts nodes of the demo workspace as launch would, for a bounded time, and keeps what they print."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

DEMO_WS = Path(__file__).parents[2] / "fixtures" / "demo_ws"
EXECUTABLES = DEMO_WS / "lib" / "demo_nodes"
LAUNCH_FILES = DEMO_WS / "share" / "demo_nodes" / "launch"
# Every node started here ends by itself; this is for one that hangs.
LONGEST_SECONDS = 60.0


@dataclass(frozen=True)
class Ended:
    status: int
    output: str  # standard output and error, in the order written

    def says(self, text: str) -> bool:
        return text in self.output


def environment(domain: int, keystore: Path | None = None) -> dict[str, str]:
    """That of a launched process: this interpreter first on PATH, and security when there is a keystore."""
    foreign = ("ROS_", "CYCLONEDDS_URI")
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(foreign)}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    own = {"PATH": path, "ROS_DOMAIN_ID": str(domain)}
    security = {
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_SECURITY_KEYSTORE": str(keystore),
    }
    return {**inherited, **own, **(security if keystore else {})}


class Node:
    """A running demo node: ``Node("talker", env, "--enclave", "/talker", "-p", "count:=5")``."""

    def __init__(self, executable: str, env: Mapping[str, str], *ros_arguments: str):
        self._process = subprocess.Popen(
            [str(EXECUTABLES / executable), "--ros-args", *ros_arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=dict(env),
        )

    def end(self) -> Ended:
        """Wait for the node to end by itself."""
        try:
            output, _ = self._process.communicate(timeout=LONGEST_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise
        return Ended(self._process.returncode, output)

    def stop(self) -> Ended:
        self._process.terminate()
        return self.end()
