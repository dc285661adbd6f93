"""Arguments and variables that turn a planned process into a secured one. Performs no I/O.

Source: rcl/src/rcl/security.c and arguments.c. A node gets ``--enclave`` (the last one given wins, so ours is
appended only where the user wrote none); an ``executable`` action, whose command line is not ours to extend, gets
``ROS_SECURITY_ENCLAVE_OVERRIDE``. A process on Zenoh gets its enclave's session configuration too; the variables of
rcl stay, so that it ends without its enclave, and is secured should it load a DDS after all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from enclave_launch.admission.middleware import ZENOH, Vendor, vendor_of
from enclave_launch.admission.variables import ZENOH_CLEARED, ZENOH_SESSION
from enclave_launch.enclave import AssignmentReason
from enclave_launch.plan import PlannedProcess
from keystore.disk import layout

ENABLE = "ROS_SECURITY_ENABLE"
KEYSTORE = "ROS_SECURITY_KEYSTORE"
STRATEGY = "ROS_SECURITY_STRATEGY"
OVERRIDE = "ROS_SECURITY_ENCLAVE_OVERRIDE"
LOG_FILE, LOG_VERBOSITY = "ROS_SECURITY_LOG_FILE", "ROS_SECURITY_LOG_VERBOSITY"
NO_KEYSTORE = "/dev/null/an_executable_without_an_enclave"
"""Below a file, so that nothing can ever be there."""


@dataclass(frozen=True)
class SecuritySettings:
    """The settings of secured processes. ``keystore``: absolute path of the keystore's root (rcl appends ``enclaves``
    itself). ``log_folder``: absolute path of a folder for the security logs of Fast DDS, a file for each process."""

    keystore: str
    strategy: str = "Enforce"
    log_folder: str = ""


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
    log = _security_log(planned, settings.log_folder)
    return {**enclave_environment(path, planned.middleware, settings), **override, **log}


def _security_log(planned: PlannedProcess, folder: str) -> Mapping[str, str]:
    """Return what switches the security log on (rmw_fastrtps_shared_cpp utils.cpp; no other middleware has one).

    A log that the launch file sets up for the process stays as it is.
    """
    process = planned.process
    if not folder or vendor_of(planned.middleware) is not Vendor.FAST or LOG_FILE in process.environment:
        return {}
    verbosity = process.environment.get(LOG_VERBOSITY, "WARNING")
    name = process.process_name.replace("/", "_")
    return {LOG_FILE: f"{folder}/{name}.log", LOG_VERBOSITY: verbosity}


def enclave_environment(enclave: str, middleware: str, settings: SecuritySettings) -> Mapping[str, str]:
    """Return the security variables of a process in ``enclave``; on Zenoh they select its configuration."""
    if middleware != ZENOH:
        return launcher_environment(settings)
    file = f"{settings.keystore}/{layout.zenoh_session(enclave)}"
    return {**launcher_environment(settings), ZENOH_SESSION: file, **dict.fromkeys(ZENOH_CLEARED, "")}


def launcher_environment(settings: SecuritySettings) -> Mapping[str, str]:
    """Return the security variables of the launcher's own node, which every process has."""
    return {ENABLE: "true", KEYSTORE: settings.keystore, STRATEGY: settings.strategy}
