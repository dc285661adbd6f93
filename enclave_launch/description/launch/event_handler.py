"""Base of the event handlers, and the plain one made of a matcher and entities."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_entities_type import SomeEntitiesType
    from enclave_launch.source_location import SourceLocation


class BaseEventHandler:
    """Matches events and says what to visit then. ``handle_once`` unregisters it at the first match.

    ``event_class`` and ``target`` speed dispatch up: an event of another class, or about another action, is
    never offered to the handler. ``None`` means any.
    """

    event_class: type[Event] | None = None
    target: object | None = None
    internal = False  # launch's own: part of how it works, not of what the launch file says
    source_location: SourceLocation | None = None  # of the action that registered it

    def __init__(self, *, matcher: Callable[[Event], bool], handle_once: bool = False) -> None:
        self.__matcher = matcher
        self.__handle_once = handle_once

    @property
    def handle_once(self) -> bool:
        return self.__handle_once

    @property
    def handler_description(self) -> str | None:
        return None

    @property
    def matcher_description(self) -> str | None:
        return None

    def matches(self, event: Event) -> bool:
        return self.__matcher(event)

    def describe(self) -> tuple[str, list[Any]]:
        """A line of text, and the entities that are known without an event."""
        return (
            f"{type(self).__name__}(matcher='{self.matcher_description}', "
            f"handler='{self.handler_description}', handle_once={self.handle_once})",
            [],
        )

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        """Subclasses call this first: it makes the event a local and honours ``handle_once``."""
        context.extend_locals({"event": event})
        if self.__handle_once:
            context.unregister_event_handler(self)
        return None

    def foresee(self, started: Sequence[Any]) -> Event | None:
        """An event, not certain to happen, that this handler would answer; ``None``: none can be made up.

        For the dry run. ``started`` are the process actions that were started so far, in order.
        """
        return None

    def computes(self) -> bool:
        """Does a callback compute the entities, so that nothing is known before the event?"""
        return False


class EventHandler(BaseEventHandler):
    """Gives ``entities`` whenever ``matcher`` holds."""

    def __init__(
        self,
        *,
        matcher: Callable[[Event], bool],
        entities: SomeEntitiesType | None = None,
        handle_once: bool = False,
    ) -> None:
        super().__init__(matcher=matcher, handle_once=handle_once)
        self.__entities = entities

    @property
    def entities(self) -> SomeEntitiesType | None:
        return self.__entities

    def describe(self) -> tuple[str, list[Any]]:
        text, entities = super().describe()
        if self.__entities:
            entities.extend(self.__entities)  # type: ignore[arg-type]  # one entity is a TypeError, as upstream
        return text, entities

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        super().handle(event, context)
        return self.__entities

    def foresee(self, started: Sequence[Any]) -> Event | None:
        """The exit, or the first output, of a started process that the matcher takes."""
        if type(self).matches is not BaseEventHandler.matches or self.event_class is not None:
            return None
        from enclave_launch.evaluation.suppositions import suppose_process_event

        return suppose_process_event(self.matches, started)
