"""Children of the tests: small Python and shell programs, never a stand-in for the runtime itself."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable
from pathlib import Path

import pytest


def alive(pid: int) -> bool:
    """Is there such a process, and is it more than a zombie?"""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return stat.rpartition(")")[2].split()[0] not in {"Z", "X"}


def eventually(condition: Callable[[], bool], seconds: float = 10.0) -> bool:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.01)
    return condition()


def require_descriptors(count: int) -> None:
    """Skips where this machine's limit is lower than what a test of many processes takes, whatever runs them."""
    if resource.getrlimit(resource.RLIMIT_NOFILE)[1] < count:
        pytest.skip(f"needs {count} descriptors (ulimit -Hn)")


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def read_pid(path: Path) -> int:
    """The number that a child wrote into ``path``, once it is there."""
    assert eventually(lambda: path.is_file() and path.read_text().strip() != "")
    return int(path.read_text())


@pytest.fixture
def ros_log_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    directory = tmp_path / "ros_log"
    monkeypatch.setenv("ROS_LOG_DIR", str(directory))
    return directory
