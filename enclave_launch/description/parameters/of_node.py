"""The parameters of one ``Node``: as words of its command line, and as the values its node will see; and those of a
component, as the flat list that its load request carries.

For components launch reads parameter files itself, by rules of its own (not rcl's): the section ``**``, updated by the
section equal to the component's name; other patterns do not count; a file without any section is taken flat.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.parameters import yaml_text
from enclave_launch.description.parameters.descriptions import Parameter
from enclave_launch.description.parameters.evaluate import evaluate_parameters
from enclave_launch.diagnostics.evaluation import parameter_file_missing
from enclave_launch.process import UnknownParameters
from enclave_launch.ros_rules.distro import Feature
from enclave_launch.ros_rules.rcl_parameters import (
    ResolvedParameters,
    Section,
    parameters_of_text,
    resolve_parameters,
)
from nodl.ros_arguments import ParameterFileArgument, ParameterRule

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.parameters.types import Parameters


import warnings
from typing import TYPE_CHECKING, NamedTuple

from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.parameters.evaluate import evaluate_parameter_dict
from enclave_launch.description.parameters.normalize import normalize_parameter_dict
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.rcl_parameters import section_applies

if TYPE_CHECKING:
    from enclave_launch.description.parameters.types import EvaluatedParameters, EvaluatedParameterValue


class NodeParameters:
    """Global parameters come first, then the node's own; each dict becomes a file of its own."""

    def __init__(self, own: Parameters):
        self.__own = own
        self.__unknown: list[UnknownParameters] = []

    @property
    def unknown(self) -> tuple[UnknownParameters, ...]:
        """Parameters that Python modules which are not installed would have given."""
        return tuple(self.__unknown)

    def write(self, context: LaunchContext, section: str) -> list[str]:
        """Return words to append to the command line. ``section`` is the node's full name, or ``/**``."""
        words = [word for pair in _global_words(context) for word in pair]
        for item in evaluate_parameters(context, self.__own):
            words += self.__own_words(context, section, item)
        return words

    def __own_words(self, context: LaunchContext, section: str, item: Any) -> Sequence[str]:
        if isinstance(item, UnknownParameters):
            self.__unknown.append(item)
            return ()
        if isinstance(item, Parameter):
            name, value = item.evaluate(context)
            return ("-p", f"{name}:={yaml_text.dump(value)}")
        if isinstance(item, os.PathLike):
            return self.__file_words(context, os.fspath(item))
        return ("--params-file", self.__write_file(context, section, item))

    def __file_words(self, context: LaunchContext, path: str) -> Sequence[str]:
        if not context.host.has_parameter_file(path):
            context.host.warn(parameter_file_missing(path))
            return ()
        return ("--params-file", path)

    def __write_file(self, context: LaunchContext, section: str, values: Mapping[str, Any]) -> str:
        quoted = context.host.release.has(Feature.QUOTED_TEXT_PARAMETERS)
        write = yaml_text.quoted_parameter_file if quoted else yaml_text.parameter_file
        return context.host.write_parameter_file(write(section, values))

    def resolve(
        self,
        context: LaunchContext,
        name_tokens: Sequence[str | None],
        sources: Sequence[ParameterFileArgument | ParameterRule],
        directory: str | None,
    ) -> ResolvedParameters:
        """Return what the node sees after rcl has merged everything on its command line."""

        def generated(path: str) -> Mapping[str, Section] | None:
            text = context.host.parameter_file(path)
            return None if text is None else parameters_of_text(text, path)

        return resolve_parameters(name_tokens, sources, generated, directory)


def _global_words(context: LaunchContext) -> Iterator[tuple[str, str]]:
    """Yield ``-p`` with Python's ``str`` of the value, as launch does; raises AssertionError for a missing file."""
    for item in context.launch_configurations.get("global_params") or ():
        if isinstance(item, tuple):
            yield "-p", f"{item[0]}:={item[1]}"
            continue
        is_written = context.host.parameter_file(item) is not None
        path = item if is_written else os.path.abspath(item)
        if not context.host.has_parameter_file(path):
            if context.host.allow_missing_packages:
                context.host.warn(parameter_file_missing(path))
                continue
            raise AssertionError(f"the file of set_parameters_from_file does not exist: {path}")
        yield "--params-file", path


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
        if isinstance(item, UnknownParameters):
            continue
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
    if context.host.allow_missing_packages and not context.host.has_parameter_file(str(path)):
        context.host.warn(parameter_file_missing(str(path)))
        return {}
    return yaml_text.load_parameter_file(context.host.read_parameter_file(str(path)))


def _applicable(document: Any, section: str) -> tuple[Mapping[str, Any], bool]:
    sections = dict(_sections(document, ()))
    if not sections:
        return document, False
    names = ["**", *_matching_patterns(sections, section), section]
    return {key: value for name in names for key, value in (sections.get(name) or {}).items()}, True


def _matching_patterns(sections: Mapping[str, Any], section: str) -> list[str]:
    """Return sections with wildcards that match, in the order of the file. Older releases ignore them."""
    tokens = section.split("/")
    found = [name for name in sections if name != "**" and "*" in name and section_applies(name, tokens)]
    return found if found and current_release().has(Feature.WILDCARD_SECTIONS) else []


def _sections(mapping: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """Yield each ``ros__parameters`` with the keys above it; what follows in the same mapping is not read."""
    for key, value in mapping.items():
        if key == "ros__parameters":
            yield "/".join(path), value
            return
        if isinstance(value, Mapping):
            yield from _sections(value, (*path, key.lstrip("/")))
