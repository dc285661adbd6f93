"""Modules under upstream's names, made from the table ``upstream_paths``; each name is looked up when first used."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from importlib.abc import Loader
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, NamedTuple

from enclave_launch.description.upstream_paths import GATES, PATHS
from enclave_launch.host.current import current_release

_OURS = "enclave_launch.description."


class UpstreamModule(NamedTuple):
    """One module of upstream's: where its names are, and which of them its package has as well."""

    module: str
    shared: tuple[str, ...]
    own: tuple[str, ...]

    def names(self) -> tuple[str, ...]:
        """Return the names of the row; ``*`` stands for all public names of our module."""
        if self.own != ("*",):
            return (*self.shared, *self.own)
        public = (name for name in dir(import_module(_OURS + self.module)) if not name.startswith("_"))
        return (*self.shared, *public)


def exists(name: str) -> bool:
    """Return True if ``name`` (``launch.actions.node``) is a module of the table."""
    package, _, leaf = name.rpartition(".")
    return name in PATHS or leaf in PATHS.get(package, ())


@cache
def public_module(name: str) -> ModuleType:
    """Return the module of that name; always the same object."""
    module = ModuleType(name, f"API of upstream's ``{name}``; see ``enclave_launch.description``.")
    names = _names_of(name)
    below = _modules_below(name)

    def get(attribute: str) -> Any:
        if attribute == "__all__":
            return _available(names)
        if attribute in names and _is_available(attribute, name):
            value = getattr(import_module(_OURS + names[attribute]), attribute)
            if attribute not in GATES:
                setattr(module, attribute, value)
            return value
        if attribute in below:
            return public_module(f"{name}.{attribute}")
        special = attribute.startswith("__")  # ``__path__``: the import system asks every module for it
        if name not in PATHS and not special and attribute in _unambiguous_names():
            return getattr(import_module(_OURS + _unambiguous_names()[attribute]), attribute)
        raise AttributeError(f"module {name!r} has no attribute {attribute!r}")

    module.__dict__.update(
        __getattr__=get, __dir__=lambda: sorted({*_available(names), *below}), __file__=__file__
    )
    if name in PATHS:
        module.__path__ = []
    return module


class _Loader(Loader):
    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return public_module(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Add modules that a name of their package hides from the start, so that importing one binds nothing."""
        for name in hidden_modules(module.__name__):
            sys.modules.setdefault(name, public_module(name))


def spec_of(name: str) -> ModuleSpec | None:
    """Return the spec that the import system asks for; None for a module that is not in the table."""
    return ModuleSpec(name, _Loader()) if exists(name) else None


def hidden_modules(name: str) -> Iterable[str]:
    """Return the modules below package ``name`` that a name of the package hides.

    Importing one later would bind it in its package, over the function (``launch_ros.utilities.evaluate_parameters``).
    """
    names = _names_of(name) if name in PATHS else {}
    return [f"{name}.{leaf}" for leaf in PATHS.get(name, ()) if leaf in names]


def _names_of(name: str) -> dict[str, str]:
    if name in PATHS:
        rows = [_row(text) for text in PATHS[name].values()]
        names = {shared: row.module for row in rows for shared in row.shared}
        own = PATHS[name].get("")
        return {**names, **dict.fromkeys(_row(own).names(), _row(own).module)} if own else names
    package, _, leaf = name.rpartition(".")
    row = _row(PATHS[package][leaf])
    return dict.fromkeys(row.names(), row.module)


@cache
def _unambiguous_names() -> dict[str, str]:
    """Return the names of packages that only one of our modules has.

    Upstream's modules export imported names as well, and launch files import them from there
    (``launch.actions.execute_process.ExecuteLocal``)."""
    found: dict[str, set[str]] = {}
    for package in PATHS:
        for name, module in _names_of(package).items():
            found.setdefault(name, set()).add(module)
    return {name: min(modules) for name, modules in found.items() if len(modules) == 1}


def _row(text: str) -> UpstreamModule:
    module, _, names = text.partition(": ")
    shared, _, own = names.partition("|")
    return UpstreamModule(module, tuple(shared.split()), tuple(own.split()))


def _modules_below(name: str) -> set[str]:
    prefix = f"{name}."
    packages = {package.removeprefix(prefix) for package in PATHS if package.startswith(prefix)}
    return {leaf for leaf in (*PATHS.get(name, ()), *packages) if leaf and "." not in leaf}


def _available(names: Iterable[str]) -> list[str]:
    return [name for name in names if _is_available(name, "")]


def _is_available(name: str, module: str) -> bool:
    gate = GATES.get(name)
    if gate is None or (module and module not in PATHS):
        return True

    return current_release().has(gate)


def upstream_name(module: str, name: str) -> str:
    """Return upstream's dotted name of ``name`` in our ``module``, our own if upstream has none."""
    for package, rows in PATHS.items():
        for leaf, text in rows.items():
            row = _row(text)
            if leaf and _OURS + row.module == module and name in row.names():
                return f"{package}.{leaf}.{name}"
    return f"{module}.{name}"
