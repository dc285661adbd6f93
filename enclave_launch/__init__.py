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
    from enclave_launch.flow import provision, resolve, run, run_async
    from enclave_launch.options import ResolveOptions, RunSettings, SecurityOptions
    from enclave_launch.plan import LaunchPlan
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
    "provision": "flow",
    "resolve": "flow",
    "run": "flow",
    "run_async": "flow",
    "LaunchPlan": "plan",
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
    "RuntimeFailure",
    "SecurityOptions",
    "provision",
    "resolve",
    "run",
    "run_async",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'enclave_launch' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"enclave_launch.{_HOMES[name]}"), name)
