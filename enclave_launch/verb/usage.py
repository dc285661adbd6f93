"""Check that options make sense together: one that would have no effect is wrong usage.

A user who writes ``--keystore`` believes that the robot starts secured. Performs no I/O.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

from enclave_common.command_line import CommandParser
from enclave_launch.errors import UsageError
from enclave_launch.verb.options import DENIALS, LATE, PASSPHRASE, POLICY, SECURITY, names_of


class CommandLine(NamedTuple):
    """A parsed command line. ``options``: every option with its value; ``given``: the names of those that were
    written."""

    options: argparse.Namespace
    given: frozenset[str]


FOR_SECURE = names_of((*SECURITY, *PASSPHRASE, *LATE, *DENIALS)) - {"secure"} | {"restart_expiring"}
"""Options of a keystore or of secured processes."""

FOR_PLAN = names_of(POLICY)
"""Options of the plan: an unsecured launch makes none."""

_FOR_LEARN = {"learn_for", "learn_isolation", "learn_parameters"}
_VIEWS = ("explain", "dump_params", "show_args", "print_description")


def read_command_line(parser: CommandParser, argv: Sequence[str] | None) -> CommandLine:
    """Parse as ``parse_intermixed_args`` does, separating given values from defaults."""
    defaults = {action.dest: action.default for action in parser.arguments}
    for action in parser.arguments:
        action.default = argparse.SUPPRESS
    given = vars(parser.parse_intermixed_args(argv))
    known = {name: value for name, value in defaults.items() if value is not argparse.SUPPRESS}
    return CommandLine(argparse.Namespace(**{**known, **given}), frozenset(given))


def check_options(line: CommandLine, actions: Sequence[argparse.Action]) -> None:
    """Refuse options without effect: ``UsageError`` names the flag that is missing."""
    given, options = line.given, line.options
    is_view = check_views(line, actions)
    if options.learn is None:
        check_needs_secure(actions, given & _FOR_LEARN, "--learn")
    elif is_view:
        raise UsageError("--learn runs the launch; nothing else is looked at")
    if not options.audit:
        check_needs_secure(actions, given & {"audit_report"}, "--audit")
    elif options.secure or options.learn is not None or is_view:
        raise UsageError(
            "--audit runs the launch unsecured and reports what --secure would refuse: give it alone"
        )
    if not options.watch:
        check_needs_secure(actions, given & {"watch_report", "watch_accept"}, "--watch")
    elif is_view or options.audit or options.learn is not None:
        raise UsageError(
            "--watch is for a launch that runs as planned: it is not for --dry-run, --audit or --learn"
        )
    if options.provision_only and (is_view or options.learn is not None or options.watch):
        raise UsageError(
            "--provision-only writes the keystore and starts nothing: give it with --secure alone"
        )
    if not options.secure:
        check_needs_secure(actions, given & FOR_SECURE)
        if not (is_view or options.audit or options.watch):
            check_needs_secure(actions, given & FOR_PLAN, "--secure (or --dry-run, --audit, --watch)")


def check_views(line: CommandLine, actions: Sequence[argparse.Action]) -> bool:
    """Return True if the launch is only shown; raises UsageError if two options print or one has no effect."""
    views = [name for name in _VIEWS if name in line.given]
    if len(views) > 1:
        raise UsageError(f"{_flags(actions, views)} each print something of their own: give one of them")
    if "format" in line.given and (views or not line.options.dry_run):
        beside = f" beside {_flags(actions, views)}" if views else ""
        raise UsageError(f"--format has no effect{beside}: it is for --dry-run; nothing was started")
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
