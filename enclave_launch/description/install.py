"""Our ``launch``, ``launch_ros``, ``launch_xml``, ``launch_yaml`` and ``ament_index_python`` under those names.

Only while we evaluate: a Python launch file and the helpers that it imports then build our classes. Installed
packages of these names, and modules already imported with them, are hidden meanwhile and come back untouched.
Child processes are not concerned: nothing but this interpreter's import system changes. The modules are made from the
table ``upstream_paths``; each name is looked up when first used.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, NamedTuple

from enclave_launch.description.absent_modules import AbsentModules, OpaqueValue
from enclave_launch.description.upstream_paths import GATES, PATHS
from enclave_launch.host.current import current_host, current_release

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

    release = current_release()
    return release.has(gate) if module else gate in release.features  # a list of names asks for none of them


def upstream_name(module: str, name: str) -> str:
    """Return upstream's dotted name of ``name`` in our ``module``, our own if upstream has none."""
    for package, rows in PATHS.items():
        for leaf, text in rows.items():
            row = _row(text)
            if leaf and _OURS + row.module == module and name in row.names():
                return f"{package}.{leaf}.{name}"
    return f"{module}.{name}"


PUBLIC_NAMES = ("launch", "launch_ros", "launch_xml", "launch_yaml", "ament_index_python")
FALLBACK_NAMES = (
    *("launch_param_builder", "lifecycle_msgs", "moveit_configs_utils", "nav2_common", "rclpy", "xacro"),
)
"""Taken over only where the package is not installed: many launch files of robots import these."""

_depth = 0
_guests: dict[str, ModuleType] = {}  # modules of others that were imported with our classes


@contextmanager
def installed(prefixes: Sequence[str] = ()) -> Iterator[None]:
    """Make the public names ours within the block, and the Python packages of the ament ``prefixes``; may be nested."""
    global _depth
    if _depth:
        yield
        return
    _depth += 1
    hidden = _hide_real()
    before = set(sys.modules)
    for name, module in _guests.items():
        sys.modules.setdefault(name, module)
    path = list(sys.path)
    sys.path.extend(folder for folder in _python_folders(prefixes) if folder not in sys.path)
    sys.meta_path[:] = [*_first_finders(), *sys.meta_path, *_last_finders()]
    try:
        yield
    finally:
        for finder in {_FINDER, _XACRO_FINDER, _FALLBACK_FINDER, _ABSENT}.intersection(sys.meta_path):
            sys.meta_path.remove(finder)
        _ABSENT.forget()
        sys.path[:] = path
        _withdraw(before)
        sys.modules.update(hidden)
        _depth -= 1


class _Finder(MetaPathFinder):
    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname.partition(".")[0] not in self._names:
            return None
        return spec_of(fullname)


_FINDER = _Finder(PUBLIC_NAMES)
_FALLBACK_FINDER = _Finder(FALLBACK_NAMES)
_XACRO_FINDER = _Finder(("xacro",))
_ABSENT = AbsentModules(PUBLIC_NAMES, FALLBACK_NAMES)


def _first_finders() -> list[MetaPathFinder]:
    """Return what is asked before Python's own finders.

    Where packages may be missing, the program xacro is used in the place of an installed Python package of that name: a
    placeholder stands for a description that includes a missing package.
    """
    with_program = current_host().allow_missing_packages and shutil.which("xacro") is not None
    return [_FINDER, *([_XACRO_FINDER] if with_program else [])]


def _last_finders() -> list[MetaPathFinder]:
    """Return what is asked about modules that are not installed."""
    return [_FALLBACK_FINDER, *([_ABSENT] if current_host().allow_missing_packages else [])]


def is_public(module: str) -> bool:
    """Return True for one of the names we take over, or a submodule."""
    return module.partition(".")[0] in PUBLIC_NAMES


def _hide_real() -> dict[str, ModuleType]:
    """Take the real packages, and what was imported with them, out of ``sys.modules``."""
    if not any(name in sys.modules for name in PUBLIC_NAMES):
        return {}
    names = {name for name in sys.modules if is_public(name)}
    names |= _dependents(set(sys.modules) - names, is_public)
    return {name: sys.modules.pop(name) for name in names}


def _withdraw(before: set[str]) -> None:
    for name, module in list(sys.modules.items()):
        if is_public(name) or (name not in before and name.startswith(FALLBACK_NAMES) and _is_ours(module)):
            del sys.modules[name]
    new = {name for name in sys.modules if name not in before and _may_be_guest(name)}
    for name in _dependents(new, lambda origin: origin.startswith(_OURS) or is_public(origin)):
        module = sys.modules.pop(name)
        if not any(isinstance(value, OpaqueValue) for value in vars(module).values()):
            _guests[name] = module


def _may_be_guest(name: str) -> bool:
    """Return True if a launch file may have imported it: it is neither ours nor of the standard library."""
    top = name.partition(".")[0]
    return top != "enclave_launch" and top not in sys.stdlib_module_names


def _is_ours(module: ModuleType) -> bool:
    return exists(module.__name__) and module is public_module(module.__name__)


def _dependents(names: set[str], belongs: Callable[[str], bool]) -> set[str]:
    """Return, of ``names``, the modules of each top-level package in which some module holds such an object."""
    tops = {name.partition(".")[0] for name in names if _holds(sys.modules[name], belongs)} - {
        "enclave_launch"
    }
    return {name for name in names if name.partition(".")[0] in tops}


def _holds(module: ModuleType, belongs: Callable[[str], bool]) -> bool:
    for value in list(getattr(module, "__dict__", {}).values()):
        origin = value.__name__ if isinstance(value, ModuleType) else getattr(type(value), "__module__", "")
        if isinstance(value, type) or callable(value):
            origin = getattr(value, "__module__", None) or ""
        if isinstance(origin, str) and belongs(origin):
            return True
    return False


def _python_folders(prefixes: Sequence[str]) -> Iterator[str]:
    """Yield the folders in which colcon and Debian put the Python packages of an install prefix."""
    for prefix in prefixes:
        for base, leaf in (("lib", "site-packages"), ("local/lib", "dist-packages")):
            try:
                names = sorted(os.listdir(os.path.join(prefix, base)))
            except OSError:
                continue
            folders = [os.path.join(prefix, base, name, leaf) for name in names if name.startswith("python3")]
            yield from filter(os.path.exists, folders)
