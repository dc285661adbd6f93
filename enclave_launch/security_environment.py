"""Arguments and variables that turn a planned process into a secured one. Performs no I/O.

Source: rcl/src/rcl/security.c and arguments.c. A node gets ``--enclave`` (the last one given wins, so ours is
appended only where the user wrote none); an ``executable`` action, whose command line is not ours to extend, gets
``ROS_SECURITY_ENCLAVE_OVERRIDE``. A process on Zenoh gets its enclave's session configuration too; the variables of
rcl stay, so that it ends without its enclave, and is secured should it load a DDS after all.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from enclave_launch.admission.middleware import ZENOH
from enclave_launch.admission.variables import ZENOH_CLEARED, ZENOH_SESSION
from enclave_launch.enclave import AssignmentReason
from enclave_launch.plan import PlannedProcess
from keystore.disk import layout

ENABLE = "ROS_SECURITY_ENABLE"
KEYSTORE = "ROS_SECURITY_KEYSTORE"
STRATEGY = "ROS_SECURITY_STRATEGY"
OVERRIDE = "ROS_SECURITY_ENCLAVE_OVERRIDE"
NO_KEYSTORE = "/dev/null/an_executable_without_an_enclave"
"""Below a file, so that nothing can ever be there."""


class SecuritySettings(NamedTuple):
    """The settings of secured processes. ``keystore``: absolute path of the keystore's root (rcl appends ``enclaves``
    itself)."""

    keystore: str
    strategy: str = "Enforce"


def enclave_arguments(planned: PlannedProcess) -> tuple[str, ...]:
    """Return what to append to the command line of a node; empty for executables and if the user already chose."""
    if planned.enclave is None or planned.process.kind == "executable":
        return ()
    if planned.enclave.reason is AssignmentReason.ARGUMENT:
        return ()
    return ("--enclave", planned.enclave.path)


def secured_command(planned: PlannedProcess, settings: SecuritySettings | None) -> tuple[str, ...]:
    """Return the command line; node commands end inside their ``--ros-args`` block, so the arguments simply follow."""
    if settings is None:
        return planned.process.cmd
    return (*planned.process.cmd, *enclave_arguments(planned))


def secured_environment(planned: PlannedProcess, settings: SecuritySettings | None) -> Mapping[str, str]:
    """Return the security variables of one process; without an enclave they point nowhere, so that ROS refuses."""
    if settings is None:
        return {}
    if planned.enclave is None:
        nowhere = {ENABLE: "true", KEYSTORE: NO_KEYSTORE, STRATEGY: "Enforce"}
        return {**nowhere, ZENOH_SESSION: NO_KEYSTORE} if planned.middleware == ZENOH else nowhere
    path, process = planned.enclave.path, planned.process
    override = {OVERRIDE: path} if process.kind == "executable" else {}
    return {**enclave_environment(path, planned.middleware, settings), **override}


def enclave_environment(enclave: str, middleware: str, settings: SecuritySettings) -> Mapping[str, str]:
    """Return the security variables of a process in ``enclave``; on Zenoh they select its configuration."""
    if middleware != ZENOH:
        return launcher_environment(settings)
    file = f"{settings.keystore}/{layout.zenoh_session(enclave)}"
    return {**launcher_environment(settings), ZENOH_SESSION: file, **dict.fromkeys(ZENOH_CLEARED, "")}


def launcher_environment(settings: SecuritySettings) -> Mapping[str, str]:
    """Return the security variables of the launcher's own node, which every process has."""
    return {ENABLE: "true", KEYSTORE: settings.keystore, STRATEGY: settings.strategy}
