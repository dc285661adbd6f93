"""Packages whose names are imported on first use, so that a dry run loads only what a launch file mentions."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from enclave_launch.ros_rules.distro import Feature


def lazy_names(
    package: str,
    names: Mapping[str, str],
    submodules: tuple[str, ...] = (),
    gates: Mapping[str, Feature] | None = None,
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` of ``package``: public name -> submodule that defines it.

    ``gates`` are names that some distributions lack: there they do not exist, as in the real package, and
    ``__all__`` leaves them out.
    """
    gates = gates or {}

    def available() -> list[str]:
        return [name for name in names if _available(gates.get(name))]

    def get(name: str) -> Any:
        if name == "__all__":
            return available()
        if name in submodules:
            return import_module(f"{package}.{name}")
        if name not in names or not _available(gates.get(name)):
            raise AttributeError(f"module {_public(package)!r} has no attribute {name!r}")
        value = getattr(import_module(f"{package}.{names[name]}"), name)
        if name not in gates:
            setattr(sys.modules[package], name, value)
        return value

    return get, lambda: sorted([*available(), *submodules])


def _available(gate: Feature | None) -> bool:
    if gate is None:
        return True
    from enclave_launch.host.current import current_release

    return current_release().has(gate)


def _public(package: str) -> str:
    return package.removeprefix("enclave_launch.description.")
