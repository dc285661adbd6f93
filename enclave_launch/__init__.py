"""enclave-launch: a launch file in, secured processes out (``enclave_launch.flow``). Names are loaded when used."""

from __future__ import annotations

from enclave_common import VERSION
from enclave_common.lazy_names import lazy_names
from enclave_common.own_packages import prefer_own_nodl

__version__ = VERSION

prefer_own_nodl()  # before any module of ours imports it

_MODULES = {
    "enclave_launch.dry_run": ("DryRun",),
    "enclave_launch.enclave": ("EnclaveScope",),
    "enclave_launch.errors": (
        "EnclaveLaunchError",
        "LaunchFileError",
        "ManifestError",
        "ProvisionError",
        "RuntimeFailure",
        "UsageError",
    ),
    "enclave_launch.flow": (
        "evaluate_launch",
        "find_launch_file",
        "launch_source",
        "provision",
        "resolve",
        "run",
        "run_async",
        "run_async_unsecured",
        "run_unsecured",
        "start",
        "start_unsecured",
    ),
    "enclave_launch.options": ("ResolveOptions", "RunSettings", "SecurityOptions"),
    "enclave_launch.plan": ("LaunchPlan",),
    "enclave_launch.running": ("UnsecuredLaunch",),
    "enclave_launch.runtime.running_launch": (
        "RunningLaunch",
        "RunningProcess",
        "endpoint_seen",
        "printed",
        "started",
    ),
    "enclave_launch.secured": ("ProvisionedLaunch",),
}
"""The public names of each module. ``__init__.pyi`` says the same to type checkers; a test compares the two."""
__all__, __getattr__, __dir__ = lazy_names(__name__, _MODULES)
