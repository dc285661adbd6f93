"""enclave-launch: a launch file in, secured processes out.

``resolve`` → ``LaunchPlan`` → ``provision`` → ``ProvisionedLaunch`` → ``run``; see ``enclave_launch.flow``.
The public names are listed in ``__init__.pyi``; each is imported when first used, so that ``import enclave_launch``
costs nothing.
"""

from __future__ import annotations

from typing import Any

from enclave_launch.boundary.version import VERSION

__version__ = VERSION


def _homes() -> dict[str, str]:
    """Each public name and the module that has it, as the stub says."""
    import re
    from pathlib import Path

    stub = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    return {
        name: module for module, name in re.findall(r"^from (\S+) import (\w+) as \w+$", stub, re.MULTILINE)
    }


def __getattr__(name: str) -> Any:
    if name.startswith("__") and name != "__all__":
        raise AttributeError(f"module 'enclave_launch' has no attribute {name!r}")
    homes = _homes()
    if name == "__all__":
        return sorted(homes)
    if name not in homes:
        raise AttributeError(f"module 'enclave_launch' has no attribute {name!r}")
    from importlib import import_module

    value = globals()[name] = getattr(import_module(homes[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted(["__version__", *_homes()])
