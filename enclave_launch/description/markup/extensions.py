"""Import what registers an element or a substitution, when its name is first met.

Upstream imports every installed extension before the first file is parsed. Here a name that is not registered
yet brings in the one module of ours that has it (``tags``), then all of ours, then the entry points of other
installed packages. The result is the same, without the 60 ms that entry points take.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Iterator
from functools import partial

from enclave_launch.description.markup.tags import ELEMENTS, SUBSTITUTIONS

EXTENSION_GROUP = "launch.frontend.launch_extension"
OUR_EXTENSIONS = frozenset({"launch_ros", "enclave_launch"})  # the second teaches upstream what we know
_OURS = "enclave_launch.description."
_MODULES = {"action": ELEMENTS, "substitution": SUBSTITUTIONS}

_entry_points_loaded = False


def registrations_of(kind: str, name: str) -> Iterator[Callable[[], object]]:
    """Steps that may each register ``name``; the caller stops as soon as one has.

    ``kind``: ``action`` or ``substitution``.
    """
    modules = _MODULES[kind]
    if name in modules:
        yield partial(importlib.import_module, _OURS + modules[name])
    yield partial(_import_all, kind)
    yield _load_entry_points


def load_all() -> None:
    """Import everything that can register a name."""
    for kind in _MODULES:
        _import_all(kind)
    _load_entry_points()


def _import_all(kind: str) -> None:
    for module in sorted(set(_MODULES[kind].values())):
        importlib.import_module(_OURS + module)


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
