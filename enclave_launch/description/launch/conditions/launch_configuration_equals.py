"""``LaunchConfigurationEquals``."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

from enclave_launch.description.launch.condition import Condition
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


class LaunchConfigurationEquals(Condition):
    """Holds when a launch configuration has this value; ``None``: when it is not set."""

    def __init__(self, launch_configuration_name: str, expected_value: SomeSubstitutionsType | None) -> None:
        if current_release().has(Feature.DEPRECATED_CONFIGURATION_EQUALS):
            warnings.warn(
                "The 'LaunchConfigurationEquals' and 'LaunchConfigurationNotEquals' Conditions are deprecated. "
                "Use the 'EqualsSubstitution' and 'NotEqualsSubstitution' substitutions instead",
                UserWarning,
                stacklevel=2,
            )
        self.__name = launch_configuration_name
        self.__expected = (
            None if expected_value is None else normalize_to_list_of_substitutions(expected_value)
        )
        super().__init__(predicate=self._predicate_func)

    def _predicate_func(self, context: LaunchContext) -> bool:
        expected = None if self.__expected is None else perform_substitutions(context, self.__expected)
        return bool(context.launch_configurations.get(self.__name) == expected)
