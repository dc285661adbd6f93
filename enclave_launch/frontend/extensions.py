"""Import the modules that register elements and substitutions, step by step, only as far as needed.

Upstream imports every installed extension before the first file is parsed. We ask for the next step each
time a name is still unknown: our ``launch``, our ``launch_ros``, then the entry points of other installed
packages. The result is the same, without the 60 ms that looking up entry points takes.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Iterator

OUR_MODULES = (
    "enclave_launch.description.launch.actions",
    "enclave_launch.description.launch.substitutions",
    "enclave_launch.description.launch_ros.actions",
    "enclave_launch.description.launch_ros.substitutions",
)
EXTENSION_GROUP = "launch.frontend.launch_extension"
OUR_EXTENSIONS = frozenset({"launch_ros"})


def load_next_registrations() -> bool:
    """Import one more source of registrations; ``False`` when none is left."""
    step = next(_steps, None)
    if step is None:
        return False
    step()
    return True


def load_all_registrations() -> None:
    """Import everything that can register a name."""
    while load_next_registrations():
        pass


def _pending() -> Iterator[Callable[[], object]]:
    yield lambda: [importlib.import_module(module) for module in OUR_MODULES[:2]]
    yield lambda: [importlib.import_module(module) for module in OUR_MODULES[2:]]
    yield _load_entry_points


_steps = _pending()


def _load_entry_points() -> None:
    """Load installed third-party extensions; one that fails is a warning, as upstream."""
    import importlib.metadata

    for entry_point in importlib.metadata.entry_points(group=EXTENSION_GROUP):
        if entry_point.name in OUR_EXTENSIONS:
            continue
        try:
            entry_point.load()
        except Exception as error:  # foreign code: it may raise anything, and must not stop the launch
            warnings.warn(f"Failed to load the launch extension: {entry_point.name}\n{error}", stacklevel=2)
