"""``shutdown``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.actions.emit_event import EmitEvent
from enclave_launch.description.launch.events.shutdown import Shutdown as ShutdownEvent
from enclave_launch.description.launch.frontend.expose import expose_action

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.entity import Entity
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.launch_context import LaunchContext


@expose_action("shutdown")
class Shutdown(EmitEvent):
    """End the launch. Only an event: what stands beside this action is still visited."""

    def __init__(self, *, reason: Any = "reason not given", **kwargs: Any) -> None:
        super().__init__(event=ShutdownEvent(reason=reason), **kwargs)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        reason = entity.get_attr("reason", optional=True)
        if reason:
            kwargs["reason"] = parser.parse_substitution(reason)
        return cls, kwargs

    def execute(self, context: LaunchContext) -> None:
        from enclave_launch.description.launch.events.process import ProcessExited

        event = context.get_locals_as_dict().get("event")
        if isinstance(event, ProcessExited):
            from enclave_launch.description.launch.logging import get_logger

            name = event.process_name
            get_logger("launch").info(f"process[{name}] was required: shutting down launched system")
        super().execute(context)
