"""Actions about events: emit one, register or unregister a handler, ``shutdown``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from enclave_launch.description.argument_types import is_a_subclass
from enclave_launch.description.entity import Action, LaunchDescriptionEntity, normalize_to_list_of_entities
from enclave_launch.description.events.event import Event, ProcessExited
from enclave_launch.description.events.event import Shutdown as ShutdownEvent
from enclave_launch.description.logging import get_logger
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.templates import TemplateAction, stored

if TYPE_CHECKING:
    from enclave_launch.description.events.handlers import BaseEventHandler
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.markup.entity import Entity, Parser


class EmitEvent(TemplateAction):
    """Queue an event; it is handled after all that is being visited now."""

    event: Event = stored()

    def __init__(self, *, event: Event, **kwargs: Any) -> None:
        super().__init__(event=event, **kwargs)
        if not is_a_subclass(event, Event):
            raise RuntimeError(f"EmitEvent() expected an event instance, got '{event}'.")

    def execute(self, context: LaunchContext) -> None:
        context.emit_event_sync(self.event)


class _OfHandler(TemplateAction):
    event_handler: BaseEventHandler = stored(keyword_only=False)


class RegisterEventHandler(_OfHandler):
    """Register a handler, for events that are handled from now on."""

    def execute(self, context: LaunchContext) -> None:
        place = self.source_location
        if place is not None and getattr(self.event_handler, "source_location", None) is None:
            self.event_handler.source_location = place
        context.host.note_namespace(self.event_handler, context)
        context.register_event_handler(self.event_handler)

    def describe_conditional_sub_entities(self) -> list[tuple[str, Iterable[LaunchDescriptionEntity]]]:
        text, entities = self.event_handler.describe()
        return [(text, normalize_to_list_of_entities(entities))] if entities else []


class UnregisterEventHandler(_OfHandler):
    """Unregister a handler. Raises ``ValueError`` when it is not registered."""

    def execute(self, context: LaunchContext) -> None:
        context.unregister_event_handler(self.event_handler)


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
        event = context.get_locals_as_dict().get("event")
        if isinstance(event, ProcessExited):
            name = event.process_name
            get_logger("launch").info(f"process[{name}] was required: shutting down launched system")
        super().execute(context)
