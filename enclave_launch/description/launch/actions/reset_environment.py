"""``reset_env``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.frontend.expose import expose_action

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.entity import Entity
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.launch_context import LaunchContext


@expose_action("reset_env")
class ResetEnvironment(Action):
    """Make the environment what it was when the launch began."""

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        return cls, super().parse(entity, parser)[1]

    def execute(self, context: LaunchContext) -> None:
        context._reset_environment()
