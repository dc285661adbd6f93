"""A launch description of real launch, secured: for programs that build and run their own.

    description = secured(LaunchDescription([Node(...), ...]), "keystore")
    service = LaunchService()
    service.include_launch_description(description)
    service.run()

Every node gets its enclave and least permissions when its turn comes; what cannot be secured ends the launch.
"""

from __future__ import annotations

import atexit
import os
import sys
from collections.abc import Iterable
from contextlib import ExitStack
from importlib.metadata import entry_points
from typing import Any

from launch import LaunchDescription
from launch.actions import OpaqueFunction, SetEnvironmentVariable, UnsetEnvironmentVariable

from enclave_addons.ros2 import attributes  # noqa: F401  # ``enclave=`` in the caller's own nodes
from enclave_addons.ros2.session import EnclaveSession
from enclave_launch import flow
from enclave_launch.errors import UsageError
from enclave_launch.interfaces import InterfaceFinder
from enclave_launch.options import ResolveOptions, SecurityOptions
from enclave_launch.plan import LaunchSource, PlanInputs
from enclave_launch.planner import make_plan
from enclave_launch.process import Evaluation
from enclave_launch.ros_rules.distro import choose_release
from enclave_launch.secured import ProvisionedLaunch
from enclave_launch.security_environment import OVERRIDE, launcher_environment
from nodl.ament_index import search_prefixes

EXTENSION = "enclave_addons.ros2.node_action"


def secured(
    description: LaunchDescription,
    keystore: str | os.PathLike[str],
    *,
    resolve_options: ResolveOptions | None = None,
    security_options: SecurityOptions | None = None,
) -> LaunchDescription:
    """Return a description that secures ``description``; the keystore is created if it does not exist.

    Raises ProvisionError for the keystore, UsageError if launch would not find our extension."""
    options = resolve_options or ResolveOptions()
    check_installed()
    release = choose_release(options.distro, os.environ.get("ROS_DISTRO"), search_prefixes())
    finder = InterfaceFinder(search_prefixes(), options, release.distro.value)
    inputs = PlanInputs(LaunchSource("<program>"), finder, options.plan_options())
    nothing_yet = Evaluation((), (), release=release)
    launch = flow.provision(make_plan(nothing_yet, inputs), keystore, options=security_options)
    return _enclosed(description, EnclaveSession(launch), launch)


def _enclosed(
    description: LaunchDescription, session: EnclaveSession, launch: ProvisionedLaunch
) -> LaunchDescription:
    """Put ``description`` behind actions that begin ``session``; raises RuntimeFailure without a Zenoh router."""
    serving = ExitStack()
    serving.enter_context(
        launch.serve_router(lambda text: print(f"enclave-launch: warning: {text}", file=sys.stderr))
    )
    atexit.register(serving.close)  # after the last process
    actions: list[Any] = [
        SetEnvironmentVariable(name, value) for name, value in launcher_environment(launch.settings).items()
    ]
    # rcl lets this variable of the user's shell win over --enclave.
    actions.append(UnsetEnvironmentVariable(OVERRIDE))
    actions.extend(UnsetEnvironmentVariable(name) for name in _read_secrets(launch))
    actions.append(OpaqueFunction(function=session.install))
    return LaunchDescription([*actions, *description.entities])


def _read_secrets(launch: ProvisionedLaunch) -> Iterable[str]:
    """Read variables that the processes must not inherit from us, now, for what --allow-late signs later."""
    for secret in (launch.options.access.passphrase, launch.options.access.pin):
        if secret is not None and secret.variable and secret.variable in os.environ:
            secret.value()
            yield secret.variable


def check_installed() -> None:
    """Raise UsageError unless launch_ros finds our node extension: nodes would start unsecured."""
    found = [entry.value for entry in entry_points(group="launch_ros.node_action")]
    if not any(value.startswith(EXTENSION) for value in found):
        raise UsageError(
            "enclave-launch is importable but not installed: launch_ros finds its node extension through entry "
            "points; install it with pip or colcon"
        )
