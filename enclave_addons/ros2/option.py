"""The extension point ``ros2launch.option``: ``ros2 launch --secure --keystore DIR PACKAGE FILE``.

The options are those of ``secure-launch`` and do the same. A secured launch is planned and run by our engine, which
calls the user's code once for both; upstream's engine would have to call it again, with classes of its own. Without
``--secure`` everything is upstream's.

Beside ``ros2launch_security``, which also defines ``--secure``, ours wins: its options are replaced, its
extension sees a launch without security and does nothing. The entry point's name sorts after its
name, and ros2launch adds options in that order.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ros2launch.option import OptionExtension

from enclave_addons.ros2 import attributes  # noqa: F401  # ``enclave=`` in Python launch files, secured or not
from enclave_common.command_line import CommandLine, add_options
from enclave_common.project import ProjectError, find_project, with_project
from enclave_common.terminal import safe_output, stdout_is_for_the_plan
from enclave_launch.errors import EnclaveLaunchError, UsageError

SECURE = "secure_enclaves"


class EnclaveOption(OptionExtension):  # type: ignore[misc]  # untyped without ROS
    """Adds the options of ``secure-launch`` to ``ros2 launch`` and does what they ask for."""

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str, *, argv: Any = None) -> None:
        from enclave_launch.verb.options import DENIALS, LOOKING, POLICY, add_security_options

        group = parser.add_argument_group("secure enclaves", conflict_handler="resolve")
        secure = add_security_options(group)
        self._ours = (*secure, *add_options(group, (*POLICY, *DENIALS, *LOOKING)))
        for action in self._ours:
            action.default = argparse.SUPPRESS  # what is there then was given
            if "--secure" in action.option_strings:
                action.dest = SECURE
        if names_keystore(sys.argv[1:]):
            group.add_argument("--secure", dest=SECURE, metavar="KEYSTORE", default=argparse.SUPPRESS)
        # What ros2launch_security reads: not requested.
        parser.set_defaults(**{SECURE: False, "secure": None, "create_keystore": True})

    def prelaunch(self, launch_description: Any, args: argparse.Namespace) -> tuple[Any, ...]:
        """Plan and secure the launch; raises RuntimeError, whose message ros2 shows without a traceback."""
        from enclave_launch.verb.options import build_parser
        from enclave_launch.verb.usage import (
            FOR_PLAN,
            FOR_SECURE,
            check_needs_secure,
            check_views,
        )

        try:
            keystore = getattr(args, SECURE)
            if isinstance(keystore, str):
                args.keystore = Path(keystore)
            # What ros2 launch does not have, or has in its own way, is at its default.
            options = argparse.Namespace(**{**vars(build_parser().parse_args([])), **vars(args)})
            given = vars(args).keys() & {action.dest for action in self._ours}
            looking = check_views(CommandLine(options, frozenset(given)), self._ours)
            if not keystore:
                check_needs_secure(self._ours, given & (FOR_SECURE if looking else FOR_SECURE | FOR_PLAN))
            if not looking and not keystore:
                return (launch_description,)
            line = CommandLine(options, frozenset(given), tuple(self._ours))
            options = with_project(line, find_project(Path(target_of(options)[0]).parent, Path()))
            if looking:
                raise SystemExit(_shown(options))
            raise SystemExit(_launched(launch_description, options))
        except (EnclaveLaunchError, ProjectError) as error:
            raise RuntimeError(str(error)) from error


def names_keystore(words: Sequence[str]) -> bool:
    """Do the words of the command line say ``--secure KEYSTORE``, as ros2launch_security has it? Only where what to
    launch is left beside it, and ``--keystore`` does not name one already."""
    if "--secure" not in words or any(word.partition("=")[0] == "--keystore" for word in words):
        return False
    where = words.index("--secure")
    if where + 1 == len(words) or words[where + 1].startswith("-") or ":=" in words[where + 1]:
        return False
    others = (
        *words[words.index("launch") + 1 if "launch" in words[:where] else 0 : where],
        *words[where + 2 :],
    )
    named = [word for word in others if not word.startswith("-") and ":=" not in word]
    return len(named) > 1 or any(os.path.isfile(word) for word in named)


def _shown(args: argparse.Namespace) -> int:
    from enclave_launch.flow import resolve
    from enclave_launch.verb.options import resolve_options
    from enclave_launch.verb.secure_launch import show_plan

    path, arguments = target_of(args)
    keystore = os.path.abspath(args.keystore) if getattr(args, SECURE) and args.keystore else None
    with stdout_is_for_the_plan():
        plan = resolve(path, arguments, options=resolve_options(args))
    return show_plan(plan, args, keystore)


def _launched(description: Any, args: argparse.Namespace) -> int:
    from enclave_launch.verb.start import start
    from enclave_launch.verb.target import LaunchTarget

    if args.keystore is None:
        raise UsageError(
            "--secure needs a keystore: give --keystore DIR or set ROS_SECURITY_KEYSTORE; for a temporary one, "
            'as ros2launch_security makes it: --keystore "$(mktemp -d)/ks"'
        )
    _check_nothing_was_added(description)
    with safe_output():
        return start(LaunchTarget(*target_of(args)), args, os.path.abspath(args.keystore))


def _check_nothing_was_added(description: Any) -> None:
    """Refuse a description that another extension of ros2 launch extended: that part is in no plan."""
    from launch.actions import IncludeLaunchDescription

    added = [
        type(each).__name__ for each in description.entities if type(each) is not IncludeLaunchDescription
    ]
    if added or len(description.entities) != 1:
        raise UsageError(
            f"another extension of ros2 launch added to this launch ({', '.join(added) or 'an include'}); a secured "
            "launch holds what its file says: include it in the launch file, or launch without that extension's option"
        )


def target_of(args: argparse.Namespace) -> tuple[str, tuple[tuple[str, str], ...]]:
    """Return launch file and arguments as ros2launch's command takes them from its own command line."""
    from ros2launch.api import get_share_file_path_from_package
    from ros2launch.api.api import parse_launch_arguments

    words = list(args.launch_arguments)
    if os.path.isfile(args.package_name):
        path = args.package_name
        words[:0] = [args.launch_file_name] if args.launch_file_name is not None else []
    else:
        path = get_share_file_path_from_package(
            package_name=args.package_name, file_name=args.launch_file_name
        )
    return path, tuple(parse_launch_arguments(words))
