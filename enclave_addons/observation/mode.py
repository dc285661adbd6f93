"""The options of ``secure-launch`` for watching (``enclave_launch.verb.modes``)."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from enclave_common.command_line import FLAG, PATH, TEXTS, CommandLine, Option
from enclave_launch.verb.target import LaunchTarget
from enclave_launch.verb.usage import check_needs_secure

TITLE = "watching the DDS domain"
OPTIONS: tuple[Option, ...] = (
    ("--watch", FLAG, "observe the DDS domain during the launch and report what differs from the plan"),
    ("--watch-report FILE", PATH, "write the findings of --watch as JSON lines, too"),
    ("--watch-accept NODE", TEXTS,
     "with --watch: a node that may run beside the plan, such as '/_ros2cli*' (repeatable)"),
)  # fmt: skip


def chosen(options: argparse.Namespace) -> str:
    """Return ``--watch`` if it was given."""
    return "--watch" if options.watch else ""


def plans(options: argparse.Namespace) -> bool:
    """Return True: a launch is compared with its plan."""
    return bool(options.watch)


def check_options(line: CommandLine, actions: Sequence[argparse.Action]) -> None:
    """Raise ``UsageError`` for options that have no effect."""
    if not line.options.watch:
        check_needs_secure(actions, line.given & {"watch_report", "watch_accept"}, "--watch")


def launch(target: LaunchTarget, options: argparse.Namespace, keystore: str | None) -> int:
    """Run the launch and return the exit status."""
    from enclave_addons.observation import launch_options  # asyncio, cryptography

    return launch_options.launch(target, options, keystore)
