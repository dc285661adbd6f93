"""Packages whose names are imported on first use, so that a dry run loads only what a launch file mentions."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module

from enclave_launch.evaluation.distro import Feature


def lazy_names(
    package: str,
    names: Mapping[str, str],
    submodules: tuple[str, ...] = (),
    gates: Mapping[str, Feature] | None = None,
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """``__getattr__``, ``__dir__`` and ``__all__`` of ``package``: public name -> submodule that defines it.

    ``gates`` are names that some distributions lack: there they do not exist, as in the real package.
    """
    gates = gates or {}

    def get(name: str) -> object:
        if name in submodules:
            return import_module(f"{package}.{name}")
        if name not in names or not _available(gates.get(name)):
            raise AttributeError(f"module {_public(package)!r} has no attribute {name!r}")
        value: object = getattr(import_module(f"{package}.{names[name]}"), name)
        if name not in gates:
            setattr(sys.modules[package], name, value)
        return value

    public = [name for name in names if name not in gates]
    return get, lambda: sorted([*public, *submodules]), public


def _available(gate: Feature | None) -> bool:
    if gate is None:
        return True
    from enclave_launch.evaluation.host import current_release

    return current_release().has(gate)


def _public(package: str) -> str:
    return package.removeprefix("enclave_launch.description.")
