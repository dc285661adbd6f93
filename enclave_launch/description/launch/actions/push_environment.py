"""``PushEnvironment``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.action import Action

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


class PushEnvironment(Action):
    """Open an environment scope: what changes from here is undone by the matching pop."""

    def execute(self, context: LaunchContext) -> None:
        context._push_environment()
