"""The parameters of one ``Node``: as words of its command line, and as the values its node will see."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from enclave_launch.description.parameters import yaml_text
from enclave_launch.description.parameters.descriptions import Parameter
from enclave_launch.description.parameters.evaluate import evaluate_parameters
from enclave_launch.diagnostics.evaluation import parameter_file_missing
from enclave_launch.ros_rules.distro import Feature
from enclave_launch.ros_rules.parameter_value import ParameterValue
from enclave_launch.ros_rules.rcl_parameters import (
    ResolvedParameters,
    Section,
    as_rcl_reads,
    parameters_of_text,
    resolve_parameters,
)
from nodl.ros_arguments import ParameterFileArgument, ParameterRule

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.parameters.types import Parameters


class NodeParameters:
    """Global parameters come first, then the node's own; each dict becomes a file of its own."""

    def __init__(self, own: Parameters):
        self.__own = own
        self.__written: dict[str, Callable[[], Mapping[str, Section]]] = {}  # content of generated files

    def write(self, context: LaunchContext, section: str) -> list[str]:
        """Return words to append to the command line. ``section`` is the node's full name, or ``/**``."""
        words = [word for pair in _global_words(context) for word in pair]
        for item in evaluate_parameters(context, self.__own):
            words += self.__own_words(context, section, item)
        return words

    def __own_words(self, context: LaunchContext, section: str, item: Any) -> Sequence[str]:
        if isinstance(item, Parameter):
            name, value = item.evaluate(context)
            return ("-p", f"{name}:={yaml_text.dump(value)}")
        if isinstance(item, os.PathLike):
            return self.__file_words(context, os.fspath(item))
        return ("--params-file", self.__write_file(context, section, item))

    def __file_words(self, context: LaunchContext, path: str) -> Sequence[str]:
        text = context.host.parameter_file(path)
        if text is not None:
            self.__written[path] = partial(parameters_of_text, text, path)
        elif not os.path.isfile(path):
            context.host.warn(parameter_file_missing(path))
            return ()
        return ("--params-file", path)

    def __write_file(self, context: LaunchContext, section: str, values: Mapping[str, Any]) -> str:
        quoted = context.host.release.has(Feature.QUOTED_TEXT_PARAMETERS)
        write = yaml_text.quoted_parameter_file if quoted else yaml_text.parameter_file
        path = context.host.write_parameter_file(write(section, values))
        read = _as_written if quoted else as_rcl_reads
        self.__written[path] = lambda: {section: {name: read(value) for name, value in values.items()}}
        return path

    def resolve(
        self,
        name_tokens: Sequence[str | None],
        sources: Sequence[ParameterFileArgument | ParameterRule],
        directory: str | None,
    ) -> ResolvedParameters:
        """Return what the node sees after rcl has merged everything on its command line."""
        written = self.__written
        return resolve_parameters(
            name_tokens, sources, lambda path: written[path]() if path in written else None, directory
        )

    def written_files(self, context: LaunchContext) -> dict[str, str]:
        """Map path to text of the files that were generated for this node."""
        return {path: context.host.parameter_file(path) or "" for path in self.__written}


def _as_written(value: Any) -> ParameterValue:
    return tuple(value) if isinstance(value, list) else value


def _global_words(context: LaunchContext) -> Iterator[tuple[str, str]]:
    """Yield ``-p`` with Python's ``str`` of the value, as launch does; raises AssertionError for a missing file."""
    for item in context.launch_configurations.get("global_params") or ():
        if isinstance(item, tuple):
            yield "-p", f"{item[0]}:={item[1]}"
            continue
        path = os.path.abspath(item)
        if not os.path.isfile(path) and context.host.allow_missing_packages:
            context.host.warn(parameter_file_missing(path))
            continue
        if not os.path.isfile(path):
            raise AssertionError(f"the file of set_parameters_from_file does not exist: {path}")
        yield "--params-file", path
