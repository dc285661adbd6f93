"""enclave-launch: a launch file in, secured processes out.

``resolve`` → ``LaunchPlan`` → ``provision`` → ``ProvisionedLaunch`` → ``run``; see ``enclave_launch.flow``.
Each public name is imported when it is first used: a dry run loads neither ``cryptography`` nor ``asyncio``.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from enclave_common import VERSION

__version__ = VERSION

_MODULES = {
    "enclave_launch.enclave": ("EnclaveScope",),
    "enclave_launch.errors": (
        "EnclaveLaunchError",
        "LaunchFileError",
        "ManifestError",
        "ProvisionError",
        "RuntimeFailure",
    ),
    "enclave_launch.flow": (
        "evaluate_launch",
        "find_launch_file",
        "launch_source",
        "provision",
        "resolve",
        "run",
        "run_async",
        "start",
    ),
    "enclave_launch.options": (
        "ResolveOptions",
        "RunSettings",
        "SecurityOptions",
    ),
    "enclave_launch.plan": ("LaunchPlan",),
    "enclave_launch.runtime.running_launch": (
        "RunningLaunch",
        "RunningProcess",
        "endpoint_seen",
        "printed",
        "started",
    ),
    "enclave_launch.running": ("Launch",),
    "enclave_launch.secured": ("ProvisionedLaunch",),
}
"""The public names of each module. ``__init__.pyi`` says the same to type checkers; a test compares the two."""
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}
__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
