"""``PopLaunchConfigurations``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.action import Action

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


class PopLaunchConfigurations(Action):
    """Close a scope of launch configurations."""

    def execute(self, context: LaunchContext) -> None:
        context._pop_launch_configurations()
