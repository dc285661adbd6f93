"""Our ``launch``, ``launch_ros``, ``launch_xml``, ``launch_yaml`` and ``ament_index_python`` under those names.

Only while we evaluate: a Python launch file and the helpers that it imports then build our classes. Installed
packages of these names, and modules already imported with them, are hidden meanwhile and come back untouched.
Child processes are not concerned: nothing but this interpreter's import system changes.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from types import ModuleType
from typing import TYPE_CHECKING

from enclave_launch.description.public_modules import exists, public_module, spec_of

if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec

PUBLIC_NAMES = ("launch", "launch_ros", "launch_xml", "launch_yaml", "ament_index_python")
FALLBACK_NAMES = ("lifecycle_msgs",)
"""Taken over only where the package is not installed: launch files read constants from it."""
_OURS = "enclave_launch.description."

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
    sys.meta_path.insert(0, _FINDER)
    sys.meta_path.append(_FALLBACK_FINDER)
    try:
        yield
    finally:
        sys.meta_path.remove(_FINDER)
        sys.meta_path.remove(_FALLBACK_FINDER)
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
        _guests[name] = sys.modules.pop(name)


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
