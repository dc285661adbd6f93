"""enclave-launch: a launch file in, secured processes out.

``resolve`` → ``LaunchPlan`` → ``provision`` → ``ProvisionedLaunch`` → ``run``; see ``enclave_launch.flow``.
The names below are the public interface; they are imported when first used, so that ``import enclave_launch``
costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from enclave_launch.enclave import EnclaveScope
    from enclave_launch.errors import (
        EnclaveLaunchError,
        LaunchFileError,
        ManifestError,
        ProvisionError,
        RuntimeFailure,
    )
    from enclave_launch.flow import evaluate_launch, provision, resolve, run, run_async, start
    from enclave_launch.options import ResolveOptions, RunSettings, SecurityOptions
    from enclave_launch.plan import LaunchPlan
    from enclave_launch.runtime.running_launch import RunningLaunch, RunningProcess, printed, started
    from enclave_launch.secured import ProvisionedLaunch

_HOMES = {
    "EnclaveScope": "enclave",
    "EnclaveLaunchError": "errors",
    "LaunchFileError": "errors",
    "ManifestError": "errors",
    "ProvisionError": "errors",
    "RuntimeFailure": "errors",
    "ResolveOptions": "options",
    "RunSettings": "options",
    "SecurityOptions": "options",
    "evaluate_launch": "flow",
    "provision": "flow",
    "resolve": "flow",
    "run": "flow",
    "run_async": "flow",
    "start": "flow",
    "LaunchPlan": "plan",
    "RunningLaunch": "runtime.running_launch",
    "RunningProcess": "runtime.running_launch",
    "printed": "runtime.running_launch",
    "started": "runtime.running_launch",
    "ProvisionedLaunch": "secured",
}

__all__ = [
    "EnclaveLaunchError",
    "EnclaveScope",
    "LaunchFileError",
    "LaunchPlan",
    "ManifestError",
    "ProvisionError",
    "ProvisionedLaunch",
    "ResolveOptions",
    "RunSettings",
    "RunningLaunch",
    "RunningProcess",
    "RuntimeFailure",
    "SecurityOptions",
    "evaluate_launch",
    "printed",
    "provision",
    "resolve",
    "run",
    "run_async",
    "start",
    "started",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'enclave_launch' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"enclave_launch.{_HOMES[name]}"), name)
