"""Describe what upstream's actions are about to start, when names are final: a ``ResolvedProcess``. Touches nothing."""

from __future__ import annotations

import os
import re
from typing import Any

import launch_ros.actions
from launch.descriptions import executable as executable_description
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

from enclave_common.shell_words import split_words
from enclave_common.source_location import SourceLocation
from enclave_launch.description.actions.processes import first_word
from enclave_launch.process import (
    UNSPECIFIED_NODE_NAME,
    UNSPECIFIED_NODE_NAMESPACE,
    EnclaveRequest,
    ProcessKind,
    RemapRule,
    ResolvedProcess,
)
from enclave_launch.ros_rules.namespaces import enclave_scope
from enclave_launch.ros_rules.rcl_parameters import resolve_parameters
from nodl.ros_arguments import parse_ros_arguments, words_after_program

ATTRIBUTE = "_enclave_launch_enclave"
"""The attribute of an action that holds its ``enclave=`` (``attributes``)."""


def enclave_attribute(action: Any, context: Any) -> str | None:
    """Return the performed ``enclave`` of an action, None if the launch file gives none."""
    enclave = getattr(action, ATTRIBUTE, None)
    return None if enclave is None else perform_substitutions(context, enclave)


def observe_node(action: Any, context: Any, ros_specific_arguments: dict[str, Any]) -> ResolvedProcess:
    """Describe the ``launch_ros.actions.Node`` that launch is about to start."""
    context.extend_locals({"ros_specific_arguments": ros_specific_arguments})
    cmd = tuple(perform_substitutions(context, part) for part in action.cmd)
    arguments = parse_ros_arguments(cmd)
    fqn = str(action.node_name)
    namespace, _, name = fqn.rpartition("/")
    number, label = next_process_name(action, context, cmd)
    unknown = (UNSPECIFIED_NODE_NAME, UNSPECIFIED_NODE_NAMESPACE)
    tokens = [None if token in unknown else token for token in fqn.split("/") if token]
    parameters = resolve_parameters(tokens, arguments.parameters)
    return ResolvedProcess(
        number=number,
        kind=_kind(action),
        package=_text(context, action.node_package),
        executable=_text(context, action.node_executable) or "",
        process_name=f"{label}-{number}",
        name=name,
        namespace=namespace or "/",
        fqn=fqn,
        cmd=cmd,
        remaps=tuple(RemapRule(source, target) for source, target in action.expanded_remapping_rules or ()),
        parameters=parameters.values,
        unread_parameter_files=parameters.unread,
        environment={},
        enclave=EnclaveRequest(
            enclave_attribute(action, context),
            enclave_scope(context.launch_configurations),
            arguments.enclave,
        ),
        location=location_in(context, type(action).__name__),
        prefix=_prefix(action, context, cmd),
        final_environment=_environment(action, context),
        shell=bool(action.shell),
    )


def observe_executable(action: Any, context: Any) -> ResolvedProcess:
    """Describe the ``ExecuteProcess``, not a node, that launch is about to start."""
    description = action.process_description
    cmd = tuple(description.final_cmd)
    prefix = cmd[: len(cmd) - len(description.cmd)]
    words = words_after_program(cmd, len(prefix), shell=bool(action.shell))
    return ResolvedProcess(
        number=int(description.final_name.rpartition("-")[2]),
        kind="executable",
        package=None,
        executable=first_word(cmd),
        process_name=description.final_name,
        name=None,
        namespace=None,
        fqn=None,
        cmd=cmd,
        remaps=(),
        parameters={},
        environment={},
        enclave=EnclaveRequest(
            enclave_attribute(action, context),
            enclave_scope(context.launch_configurations),
            parse_ros_arguments(words).enclave,
        ),
        location=location_in(context, type(action).__name__),
        prefix=prefix,
        final_environment=dict(description.final_env),
        shell=bool(action.shell),
    )


def loads_components(action: Any) -> bool:
    """Return True if a container names composable nodes itself; they are not read: they may be iterators."""
    return bool(getattr(action, "_ComposableNodeContainer__composable_node_descriptions", None))


def next_process_name(action: Any, context: Any, cmd: tuple[str, ...]) -> tuple[int, str]:
    """Return the number and label that launch is about to give; its counter advances when the process is prepared."""
    name = action.process_description.name
    label = cmd[0].rpartition("/")[2] if name is None else perform_substitutions(context, name)
    return executable_description._executable_process_counter + 1, label


def location_in(context: Any, element: str) -> SourceLocation:
    """Return the file: real launch keeps no lines."""
    return SourceLocation(
        context.get_locals_as_dict().get("current_launch_file_path", "<program>"), 0, element
    )


def _environment(action: Any, context: Any) -> dict[str, str]:
    """Return the environment as launch's ``Executable.prepare`` makes it (launch/descriptions/executable.py)."""
    description = action.process_description
    base = dict(context.environment) if description.env is None else _performed(description.env, context)
    return {**base, **_performed(description.additional_env or (), context)}


def _performed(variables: Any, context: Any) -> dict[str, str]:
    return {
        perform_substitutions(context, name): perform_substitutions(context, value)
        for name, value in variables
    }


def _prefix(action: Any, context: Any, cmd: tuple[str, ...]) -> tuple[str, ...]:
    description = action.process_description
    pattern = getattr(description, "_Executable__prefix_filter", None)  # upstream shows the prefix only
    if (
        pattern is not None
        and re.match(perform_substitutions(context, pattern), os.path.basename(cmd[0])) is None
    ):
        return ()
    return tuple(split_words(perform_substitutions(context, description.prefix)))


def _kind(action: Any) -> ProcessKind:
    if isinstance(action, launch_ros.actions.ComposableNodeContainer):
        return "container"
    return "lifecycle_node" if isinstance(action, launch_ros.actions.LifecycleNode) else "node"


def _text(context: Any, value: Any) -> str | None:
    return (
        None if value is None else perform_substitutions(context, normalize_to_list_of_substitutions(value))
    )
