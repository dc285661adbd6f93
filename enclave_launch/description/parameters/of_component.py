"""Evaluated parameters as the flat list that a component's load request carries.

For components launch reads parameter files itself, by rules of its own (not rcl's): the section ``**``,
updated by the section equal to the component's name; other patterns do not count; a file without any
section is taken flat.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from enclave_common.files import read_text
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.parameters import yaml_text
from enclave_launch.description.parameters.evaluate import evaluate_parameter_dict
from enclave_launch.description.parameters.normalize import normalize_parameter_dict
from enclave_launch.diagnostics.evaluation import parameter_file_missing
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature
from enclave_launch.ros_rules.parameter_file import MAX_BYTES
from enclave_launch.ros_rules.rcl_parameters import section_applies

if TYPE_CHECKING:
    from enclave_launch.description.parameters.types import EvaluatedParameters, EvaluatedParameterValue

_NO_NAME = "node name not provided to launch; parameter files will not apply"


class ParameterAssignment(NamedTuple):
    """One parameter of a load request. The list keeps repeats; in the node the later one wins."""

    name: str
    value: EvaluatedParameterValue


def to_parameters_list(
    context: LaunchContext,
    node_name: str | None,
    namespace: str | None,
    evaluated_parameters: EvaluatedParameters,
) -> list[ParameterAssignment]:
    """Return dicts as they are, files as far as they apply to this node, in order.

    A file of which no section applies contributes the preceding set once more, as upstream does. Raises
    ``FileNotFoundError`` for a missing file, ``RuntimeError`` for a ``Parameter`` description."""
    section = (node_name or "").lstrip("/")
    if namespace and namespace != "/":
        section = f"{namespace.strip('/')}/{section}"
    assignments: list[ParameterAssignment] = []
    current: Mapping[str, Any] = {}
    warned = False
    for item in evaluated_parameters:
        if isinstance(item, os.PathLike):
            content, has_sections = _applicable(_read(context, item), section)
            if has_sections and not section and not warned:
                warnings.warn(_NO_NAME, stacklevel=2)
                warned = True
            if content:
                current = evaluate_parameter_dict(context, normalize_parameter_dict(content))
        else:
            current = item  # type: ignore[assignment]  # checked in the next line
        if not isinstance(current, dict):
            raise RuntimeError(f"invalid evaluated parameters {current!r}")
        assignments += [ParameterAssignment(name, value) for name, value in current.items()]
    return assignments


def _read(context: LaunchContext, path: os.PathLike[str]) -> Any:
    generated = context.host.parameter_file(str(path))
    if generated is None and context.host.allow_missing_packages and not os.path.isfile(path):
        context.host.warn(parameter_file_missing(str(path)))
        return {}
    return yaml_text.load_parameter_file(read_text(path, MAX_BYTES) if generated is None else generated)


def _applicable(document: Any, section: str) -> tuple[Mapping[str, Any], bool]:
    sections = dict(_sections(document, ()))
    if not sections:
        return document, False
    names = ["**", *_matching_patterns(sections, section), section]
    return {key: value for name in names for key, value in (sections.get(name) or {}).items()}, True


def _matching_patterns(sections: Mapping[str, Any], section: str) -> list[str]:
    """Return sections with wildcards that match, in the order of the file. Older releases do not look at them."""
    if not current_release().has(Feature.WILDCARD_SECTIONS):
        return []
    tokens = section.split("/")
    return [name for name in sections if name != "**" and "*" in name and section_applies(name, tokens)]


def _sections(mapping: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """Yield each ``ros__parameters`` with the keys above it; what follows in the same mapping is not read."""
    for key, value in mapping.items():
        if key == "ros__parameters":
            yield "/".join(path), value
            return
        if isinstance(value, Mapping):
            yield from _sections(value, (*path, key.lstrip("/")))
