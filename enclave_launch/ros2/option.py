"""The extension point ``ros2launch.option``: ``ros2 launch --secure --keystore DIR PACKAGE FILE``.

The options are those of ``secure-launch`` and do the same. The launch file is resolved and provisioned before
upstream's engine starts; then each process is held against that plan.

Beside ``ros2launch_security``, which also defines ``--secure``, ours wins: its options are replaced, its
extension sees a launch that asked for no security and does nothing. The entry point's name sorts after its
name, and ros2launch adds options in that order.
"""

from __future__ import annotations

import argparse
import os
import sys
from typing import Any

from ros2launch.option import OptionExtension

from enclave_launch.boundary.terminal import message
from enclave_launch.errors import EnclaveLaunchError, UsageError
from enclave_launch.ros2 import attributes  # noqa: F401  # ``enclave=`` in Python launch files, secured or not
from enclave_launch.verb.options import add_policy_options, add_security_options, build_parser
from enclave_launch.verb.usage import FOR_PLAN, FOR_SECURE, PERMISSIVE_NOTICE, check_needs_secure

SECURE = "secure_enclaves"


class EnclaveOption(OptionExtension):  # type: ignore[misc]  # untyped without ROS
    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str, *, argv: Any = None) -> None:
        group = parser.add_argument_group("secure enclaves", conflict_handler="resolve")
        add_security_options(group)
        add_policy_options(group)
        self._of_secured = tuple(group._group_actions)
        for action in self._of_secured:
            action.default = argparse.SUPPRESS  # what is there then was given
            if "--secure" in action.option_strings:
                action.dest = SECURE
        # What ros2launch_security reads: not asked for.
        parser.set_defaults(**{SECURE: False, "secure": None, "create_keystore": True})

    def prelaunch(self, launch_description: Any, args: argparse.Namespace) -> tuple[Any, ...]:
        """:raises RuntimeError: what ros2 shows as a message, without traceback."""
        try:
            if not getattr(args, SECURE):
                check_needs_secure(self._of_secured, vars(args).keys() & (FOR_SECURE | FOR_PLAN))
                return (launch_description,)
            return (_secured(launch_description, _with_our_defaults(args)),)
        except EnclaveLaunchError as error:
            raise RuntimeError(str(error)) from error


def _secured(description: Any, args: argparse.Namespace) -> Any:
    from enclave_launch.flow import provision, resolve
    from enclave_launch.ros2.secured import check_installed, enclosed
    from enclave_launch.ros2.session import EnclaveSession, PlannedDoor
    from enclave_launch.runtime.gate import PlannedGate
    from enclave_launch.secured import PlanProvider
    from enclave_launch.verb.secure_launch import resolve_options
    from enclave_launch.verb.security import expiry_notices, repair_notices, security_options

    if args.keystore is None:
        raise UsageError("--secure needs a keystore: give --keystore DIR or set ROS_SECURITY_KEYSTORE")
    check_installed()
    path, arguments = target_of(args)
    plan = resolve(path, arguments, options=resolve_options(args))
    if args.strategy == "Permissive":
        print(f"ros2 launch: {PERMISSIVE_NOTICE}", file=sys.stderr)
    launch = provision(plan, args.keystore, options=security_options(args))
    _say(
        *plan.warnings,
        *repair_notices(launch),
        *launch.report.warnings,
        *launch.handshakes,
        *expiry_notices(launch, args.warn_expiry),
    )
    gate = PlannedGate(
        plan.evaluation.processes,
        plan.evaluation.components,
        PlanProvider(launch),
        allow_late=args.allow_late,
        say_late=_say,
    )
    return enclosed(description, EnclaveSession(PlannedDoor(gate)), launch)


def _with_our_defaults(args: argparse.Namespace) -> argparse.Namespace:
    """Options of ``secure-launch`` that ``ros2 launch`` does not have, or has in its own way, at their defaults."""
    return argparse.Namespace(**{**vars(build_parser().parse_args([])), **vars(args)})


def target_of(args: argparse.Namespace) -> tuple[str, tuple[tuple[str, str], ...]]:
    """Launch file and arguments as ros2launch's command takes them from its own command line."""
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


def _say(*texts: object) -> None:
    for text in texts:
        print(f"ros2 launch: warning: {message(text)}", file=sys.stderr)
