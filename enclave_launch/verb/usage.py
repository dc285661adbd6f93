"""Check that options make sense together: one that would have no effect is wrong usage.

A user who writes ``--keystore`` believes that the robot starts secured. Performs no I/O.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterable, Mapping, Sequence

from enclave_common.command_line import CommandLine
from enclave_launch.errors import UsageError
from enclave_launch.verb.options import DENIALS, LATE, PASSPHRASE, POLICY, SECURITY, names_of

FOR_SECURE = names_of((*SECURITY, *PASSPHRASE, *LATE, *DENIALS)) - {"secure"} | {"restart_expiring"}
"""Options of a keystore or of secured processes."""

FOR_PLAN = names_of(POLICY)
"""Options of the plan: an unsecured launch makes none."""

_VIEWS = ("explain", "dump_params", "show_args", "print_description")


def check_views(line: CommandLine, actions: Sequence[argparse.Action]) -> bool:
    """Return True if the launch is only shown; raises UsageError if two options print or one has no effect."""
    views = [name for name in _VIEWS if name in line.given]
    if len(views) > 1:
        raise UsageError(f"{_flags(actions, views)} each print something of their own: give one of them")
    if "format" in line.given and (views or not line.options.dry_run):
        beside = f" beside {_flags(actions, views)}" if views else ""
        raise UsageError(f"--format has no effect{beside}: it is for --dry-run; nothing was started")
    if "strict" in line.given and not line.options.dry_run:
        raise UsageError("--strict has no effect without --dry-run; nothing was started")
    if "explain" in line.given and not line.options.explain:  # as of a variable that is not set
        raise UsageError("--explain needs the name of an enclave, node or topic; nothing was started")
    return bool(views) or line.options.dry_run


def check_needs_secure(
    actions: Iterable[argparse.Action], given: Collection[str], flag: str = "--secure"
) -> None:
    """Raise ``UsageError`` if one of ``actions`` was given, which have an effect only together with ``flag``."""
    if idle := _flags(actions, given):
        raise UsageError(f"{idle} has no effect without {flag}: nothing was started")


def unsecured_notice(environment: Mapping[str, str]) -> str:
    """Return one line about what a launch without ``--secure`` means."""
    if environment.get("ROS_SECURITY_ENABLE") == "true":
        return "without --secure: no process gets an enclave from here, each follows the ROS_SECURITY_ variables it has"
    return "unsecured: anyone in this DDS domain can read and write all messages of these processes (no --secure)"


PERMISSIVE_NOTICE = (
    "--strategy Permissive: a process whose enclave is missing or incomplete "
    "then runs unsecured instead of exiting"
)


def _flags(actions: Iterable[argparse.Action], names: Collection[str]) -> str:
    return ", ".join(
        next((flag for flag in action.option_strings if flag.startswith("--")), action.dest)
        for action in actions
        if action.dest in names
    )
