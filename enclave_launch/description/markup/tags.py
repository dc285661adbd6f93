"""Import the module that registers an element or substitution of XML and YAML launch files.

Upstream imports every installed extension first, which takes 60 ms; here only ours that has the name, then all."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Iterator
from functools import partial

ELEMENTS = {
    "append_env": "actions.environment",
    "arg": "actions.arguments",
    "bool_arg": "actions.arguments",
    "executable": "actions.processes",
    "for": "actions.flow",
    "for_each": "actions.flow",
    "group": "actions.flow",
    "include": "actions.includes",
    "let": "actions.configurations",
    "lifecycle_node": "actions.lifecycle",
    "load_composable_node": "actions.containers",
    "log": "actions.log",
    "log_debug": "actions.log",
    "log_error": "actions.log",
    "log_info": "actions.log",
    "log_warning": "actions.log",
    "node": "actions.nodes",
    "node_container": "actions.containers",
    "push-ros-enclave": "actions.ros_scope",
    "push-ros-namespace": "actions.ros_scope",
    "push_ros_enclave": "actions.ros_scope",
    "push_ros_namespace": "actions.ros_scope",
    "reset": "actions.configurations",
    "rep_env": "actions.environment",
    "reset_env": "actions.environment",
    "ros_timer": "actions.timers",
    "set_env": "actions.environment",
    "set_parameter": "actions.ros_scope",
    "set_parameters_from_file": "actions.ros_scope",
    "set_remap": "actions.ros_scope",
    "set_ros_log_dir": "actions.environment",
    "set_use_sim_time": "actions.ros_scope",
    "shutdown": "actions.events",
    "timer": "actions.timers",
    "unset_env": "actions.environment",
}
"""``<name>``: its module in ``enclave_launch.description``."""

SUBSTITUTIONS = {
    "all": "substitutions.logic",
    "and": "substitutions.logic",
    "anon": "substitutions.variables",
    "any": "substitutions.logic",
    "command": "substitutions.computed",
    "dirname": "substitutions.paths",
    "env": "substitutions.variables",
    "equals": "substitutions.logic",
    "eval": "substitutions.computed",
    "exec-in-pkg": "substitutions.paths",
    "file-content": "substitutions.computed",
    "filename": "substitutions.paths",
    "find-exec": "substitutions.computed",
    "find-pkg-prefix": "substitutions.paths",
    "find-pkg-share": "substitutions.paths",
    "for-var": "substitutions.variables",
    "if": "substitutions.logic",
    "index": "substitutions.variables",
    "launch_log_dir": "substitutions.paths",
    "log_dir": "substitutions.paths",
    "not": "substitutions.logic",
    "not-equals": "substitutions.logic",
    "or": "substitutions.logic",
    "param": "substitutions.variables",
    "path-join": "substitutions.paths",
    "string-join": "substitutions.computed",
    "var": "substitutions.variables",
}
"""``$(name ...)``: its module in ``enclave_launch.description``."""


EXTENSION_GROUP = "launch.frontend.launch_extension"
OUR_EXTENSIONS = frozenset({"launch_ros", "enclave_launch"})  # the second teaches upstream what we know
_OURS = "enclave_launch.description."
_MODULES = {"action": ELEMENTS, "substitution": SUBSTITUTIONS}

_entry_points_loaded = False


def registrations_of(kind: str, name: str) -> Iterator[Callable[[], object]]:
    """Yield steps that may each register the action or substitution; the caller stops as soon as one has."""
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
    import importlib.metadata  # only for an element that is not ours: it takes long to load

    for entry_point in importlib.metadata.entry_points(group=EXTENSION_GROUP):
        if entry_point.name in OUR_EXTENSIONS:
            continue
        try:
            entry_point.load()
        except Exception as error:  # foreign code: it may raise anything, and must not stop the launch
            warnings.warn(f"Failed to load the launch extension: {entry_point.name}\n{error}", stacklevel=2)
