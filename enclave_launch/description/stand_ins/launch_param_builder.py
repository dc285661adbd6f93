"""The package ``launch_param_builder``: parameters of a node from the files of a package.

It is used if the real package is not installed.
Source: what the package (https://github.com/PickNikRobotics/launch_param_builder) gives for the same files.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, Union

from enclave_common.files import read_text
from enclave_common.yaml_reader import load_yaml as yaml_value
from enclave_launch.description.ament_index import get_package_share_directory
from enclave_launch.diagnostics.evaluation import parameter_file_missing
from enclave_launch.host.current import current_host
from enclave_launch.ros_rules.parameter_file import MAX_BYTES

ParameterValueType = Union[  # noqa: UP007  # a value, as upstream has it: users write it in annotations
    str, int, float, bool, list[str], list[int], list[float], list[bool], bytes
]


class ParameterBuilderFileNotFoundError(KeyError):
    """A file that is given to the builder does not exist."""


class ParameterBuilder:
    """Collect parameters, each call adding some. File paths are relative to the share directory of the package."""

    def __init__(self, package_name: str) -> None:
        self._package_path = Path(get_package_share_directory(package_name))
        self._parameters: dict[str, Any] = {}

    def yaml(self, file_path: str, parameter_namespace: str | None = None) -> ParameterBuilder:
        """Add the values of a YAML file, below the name ``parameter_namespace`` if it is given."""
        values = load_yaml(self._package_path / file_path)
        if not parameter_namespace:
            self._parameters.update(values)
        elif parameter_namespace in self._parameters:
            self._parameters[parameter_namespace].update(values)
        else:
            self._parameters[parameter_namespace] = values
        return self

    def file_parameter(self, parameter_name: str, file_path: str) -> ParameterBuilder:
        """Add the text of a file as one parameter."""
        self._parameters[parameter_name] = load_file(self._package_path / file_path)
        return self

    def xacro_parameter(
        self, parameter_name: str, file_path: str, mappings: Mapping[str, str] | None = None
    ) -> ParameterBuilder:
        """Add the description that xacro makes of a file as one parameter."""
        self._parameters[parameter_name] = load_xacro(self._package_path / file_path, mappings=mappings)
        return self

    def parameter(self, parameter_name: str, parameter_value: Any) -> ParameterBuilder:
        self._parameters[parameter_name] = parameter_value
        return self

    def path_parameter(self, parameter_name: str, file_path: str) -> ParameterBuilder:
        """Add the path of a file as one parameter."""
        self._parameters[parameter_name] = str(self._package_path / file_path)
        return self

    def to_dict(self) -> dict[str, Any]:
        return self._parameters


def raise_if_file_not_found(file_path: Path) -> None:
    """Raise ``ParameterBuilderFileNotFoundError`` for a file that does not exist."""
    if not file_path.exists():
        raise ParameterBuilderFileNotFoundError(f"File {file_path} doesn't exist")


def load_file(file_path: Path) -> str | None:
    """Return the text of a file, None if it cannot be read; raises ``ParameterBuilderFileNotFoundError``."""
    raise_if_file_not_found(file_path)
    try:
        return read_text(file_path, MAX_BYTES)
    except OSError:
        return None


def load_yaml(file_path: Path) -> Any:
    """Return the value of a YAML file, None if it cannot be read, no values for a file of a missing package.

    Raises ``ParameterBuilderFileNotFoundError``, and ``yaml.YAMLError`` as PyYAML does.
    """
    if current_host().is_missing(str(file_path)):
        current_host().warn(parameter_file_missing(str(file_path)))
        return {}
    text = load_file(file_path)
    return None if text is None else yaml_value(text, MAX_BYTES)


def load_xacro(file_path: Path, mappings: Mapping[str, str] | None = None) -> str:
    """Return the description that xacro makes of a file; raises ``ParameterBuilderFileNotFoundError``."""
    if not current_host().is_missing(str(file_path)):
        raise_if_file_not_found(file_path)
    xacro = import_module("xacro")  # the installed one, if there is one
    return str(xacro.process_file(file_path, mappings=mappings).toxml())


def get_path(package_name: str, file_path: str) -> str:
    """Return the path of a file in the share directory of a package."""
    return os.path.join(get_package_share_directory(package_name), file_path)
