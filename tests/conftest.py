"""For all tests: which of them one runs while working (``./dev test --fast``), how properties are tried, and what
the end of a run says of real launch.

A property is about values, never about how fast a busy machine makes them.
"""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unhurried")

FAST = (
    "addons/inference",
    "addons/library",
    "description",
    "evaluation",
    "frontend",
    "launch_ros",
    "nodl",
    "policy",
)
"""Folders whose tests start no node, make no key and need no network."""
THOROUGH = (
    "evaluation/test_error_text.py",
    "evaluation/test_explore.py",
    "launch_ros/test_enclave_scopes.py",
    "addons/inference/cpp/test_in_a_launch.py",
    "addons/inference/test_in_a_launch.py",
    "policy/test_components.py",
)
"""Tables in these folders that take more than three seconds each: together half of the time."""


def pytest_configure() -> None:
    """Under nohup, or in the background of a script, signals are ignored, and what a test starts would inherit that.

    A handler that does nothing keeps the tests running likewise, and exec puts the default in its place.
    """
    for number in (
        signal.SIGHUP,
        signal.SIGINT,
        signal.SIGQUIT,
        signal.SIGTERM,
        signal.SIGUSR1,
        signal.SIGUSR2,
    ):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, lambda *_: None)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    tests = Path(__file__).parent
    for item in items:
        file = item.path.relative_to(tests)
        if file.as_posix() in THOROUGH:
            continue
        if file.as_posix().startswith(FAST) or item.path.parent == tests:
            item.add_marker(pytest.mark.fast)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the tests against ROS's own launch that did not run on one line, not each among the skipped ones."""
    skipped = terminalreporter.stats.get("skipped", [])
    without_sources = [report for report in skipped if "real_launch" in report.keywords]
    if without_sources:
        terminalreporter.stats["skipped"] = [each for each in skipped if each not in without_sources]
        terminalreporter.write_line(
            f"not run: {len(without_sources)} tests that compare with ROS's own launch. Its sources are neither on "
            "PyPI nor in Debian; CONTRIBUTING.md says how to name a checkout."
        )
