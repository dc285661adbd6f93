"""An observation outlives the process that observes: DDS may crash there, and what it raises reaches the caller."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from enclave_addons.observation.graph import observing
from enclave_addons.observation.graph.cyclone import ObserverError
from enclave_addons.observation.graph.observing import in_own_process


@pytest.fixture(autouse=True)
def no_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(observing, "_AFTER_CRASH", 0.0)


def test_a_crash_is_observed_again(tmp_path: Path) -> None:
    crashed = tmp_path / "crashed"

    def crash_once() -> int:
        if not crashed.exists():
            crashed.touch()
            os.kill(os.getpid(), signal.SIGSEGV)
        return os.getpid()

    assert in_own_process(crash_once) != os.getpid()
    assert crashed.exists()


def test_crash_after_crash_is_an_error_that_says_what_to_do() -> None:
    with pytest.raises(ObserverError, match="--with rclpy"):
        in_own_process(lambda: os.kill(os.getpid(), signal.SIGSEGV))


def test_an_error_is_not_tried_again(tmp_path: Path) -> None:
    def fail() -> None:
        with (tmp_path / "calls").open("a") as file:
            file.write("called\n")
        raise ObserverError("domain 7 cannot be joined")

    with pytest.raises(ObserverError, match="domain 7 cannot be joined"):
        in_own_process(fail)
    assert (tmp_path / "calls").read_text() == "called\n"
