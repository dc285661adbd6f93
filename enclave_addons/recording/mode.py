"""The options of ``secure-launch`` for learning and auditing (``enclave_launch.verb.modes``)."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from enclave_common.command_line import FLAG, PATH, TIME, CommandLine, Option, one_of
from enclave_launch.errors import UsageError
from enclave_launch.verb.target import LaunchTarget
from enclave_launch.verb.usage import check_needs_secure

TITLE = "recording what nodes request"
OPTIONS: tuple[Option, ...] = (
    ("--learn DIR", PATH,
     "run the launch, record what its nodes request, and write their manifests into DIR"),
    ("--learn-for TIME", TIME,
     "end the learning run when nothing new was recorded for TIME, such as 10s (default: at Ctrl-C)"),
    ("--learn-isolation", one_of("auto", "local", "none"),
     "isolate the learning run in a network namespace, else on this machine (auto), only the latter, or not"),
    ("--audit", FLAG,
     "run unsecured, and report what the plan would refuse and what it grants without a request"),
    ("--audit-report FILE", PATH, "write the audit as JSON, too"),
)  # fmt: skip


def chosen(options: argparse.Namespace) -> str:
    """Return ``--learn`` or ``--audit`` if it was given."""
    return "--learn" if options.learn is not None else "--audit" if options.audit else ""


def plans(options: argparse.Namespace) -> bool:
    """Return True for an audit, which compares with the plan of an unsecured launch."""
    return bool(options.audit)


def check_options(line: CommandLine, actions: Sequence[argparse.Action]) -> None:
    """Raise ``UsageError`` for options that have no effect."""
    options = line.options
    if options.audit and (options.secure or options.learn is not None):
        raise UsageError(
            "--audit runs the launch unsecured and reports what --secure would refuse: give it alone"
        )
    if options.learn is None:
        check_needs_secure(actions, line.given & {"learn_for", "learn_isolation"}, "--learn")
    if not options.audit:
        check_needs_secure(actions, line.given & {"audit_report"}, "--audit")


def launch(target: LaunchTarget, options: argparse.Namespace, keystore: str | None) -> int:
    """Run the launch and return the exit status."""
    from enclave_addons.recording import launch_options  # asyncio, cryptography

    return launch_options.launch(target, options, keystore)
