"""Import what registers an element or a substitution, when its name is first met.

Upstream imports every installed extension before the first file is parsed. Here a name that is not registered
yet brings in the one module of ours that has it (the ``TAGS`` of its package), then all of ours, then the
entry points of other installed packages. The result is the same, without the 60 ms that entry points take.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Iterator
from functools import partial

OUR_PACKAGES = {
    "action": ("enclave_launch.description.launch.actions", "enclave_launch.description.launch_ros.actions"),
    "substitution": (
        "enclave_launch.description.launch.substitutions",
        "enclave_launch.description.launch_ros.substitutions",
    ),
}
EXTENSION_GROUP = "launch.frontend.launch_extension"
OUR_EXTENSIONS = frozenset({"launch_ros", "enclave_launch"})  # the second teaches upstream what we know

_entry_points_loaded = False


def registrations_of(kind: str, name: str) -> Iterator[Callable[[], object]]:
    """Steps that may each register ``name``; the caller stops as soon as one has.

    ``kind``: ``action`` or ``substitution``.
    """
    for package in OUR_PACKAGES[kind]:
        tags: dict[str, str] = getattr(importlib.import_module(package), "TAGS", {})
        if name in tags:
            yield partial(importlib.import_module, f"{package}.{tags[name]}")
    for package in OUR_PACKAGES[kind]:
        yield partial(_import_all, package)
    yield _load_entry_points


def load_all() -> None:
    """Import everything that can register a name."""
    for packages in OUR_PACKAGES.values():
        for package in packages:
            _import_all(package)
    _load_entry_points()


def _import_all(package: str) -> None:
    """The packages import lazily: touching each name imports its module."""
    module = importlib.import_module(package)
    for name in module.__all__:
        getattr(module, name)


def _load_entry_points() -> None:
    """Load installed third-party extensions, once; one that fails is a warning, as upstream."""
    global _entry_points_loaded
    if _entry_points_loaded:
        return
    _entry_points_loaded = True
    import importlib.metadata

    for entry_point in importlib.metadata.entry_points(group=EXTENSION_GROUP):
        if entry_point.name in OUR_EXTENSIONS:
            continue
        try:
            entry_point.load()
        except Exception as error:  # foreign code: it may raise anything, and must not stop the launch
            warnings.warn(f"Failed to load the launch extension: {entry_point.name}\n{error}", stacklevel=2)
