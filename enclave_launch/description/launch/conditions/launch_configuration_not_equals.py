"""``LaunchConfigurationNotEquals``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.conditions.launch_configuration_equals import LaunchConfigurationEquals

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    """Holds when ``LaunchConfigurationEquals`` does not."""

    def _predicate_func(self, context: LaunchContext) -> bool:
        return not super()._predicate_func(context)
