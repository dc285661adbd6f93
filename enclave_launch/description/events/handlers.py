"""Event handlers: what to visit when an event happens."""

from __future__ import annotations

import collections.abc
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from enclave_launch.description import read_only
from enclave_launch.description.entity import Action, LaunchDescriptionEntity, SomeEntitiesType
from enclave_launch.description.events.event import (
    Event,
    ExecutionComplete,
    IncludeLaunchDescription,
    Shutdown,
    suppose_process_event,
)
from enclave_launch.host.user_code import called_for_entities

if TYPE_CHECKING:
    from enclave_common.source_location import SourceLocation
    from enclave_launch.description.launch_context import LaunchContext


@read_only("handle_once")
class BaseEventHandler:
    """Matches events and says what to visit then. ``handle_once`` unregisters it at the first match.

    ``event_class`` and ``target`` speed dispatch up: an event of another class, or about another action, is
    never offered to the handler. ``None`` means any.
    """

    event_class: type[Event] | None = None
    target: object | None = None
    internal = False  # launch's own: part of how it works, not of what the launch file says
    source_location: SourceLocation | None = None  # of the action that registered it
    handle_once: bool = False

    def __init__(self, *, matcher: Callable[[Event], bool], handle_once: bool = False) -> None:
        self.__matcher = matcher
        self.__handle_once = handle_once

    @property
    def handler_description(self) -> str | None:
        return None

    @property
    def matcher_description(self) -> str | None:
        return None

    def matches(self, event: Event) -> bool:
        return self.__matcher(event)

    def describe(self) -> tuple[str, list[Any]]:
        """Return a line of text, and the entities that are known without an event."""
        return (
            f"{type(self).__name__}(matcher='{self.matcher_description}', "
            f"handler='{self.handler_description}', handle_once={self.__handle_once})",
            [],
        )

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        """Make the event a local and honour ``handle_once``; subclasses call this first."""
        context.extend_locals({"event": event})
        if self.__handle_once:
            context.unregister_event_handler(self)
        return None

    def foresee(self, started: Sequence[Any]) -> Event | None:
        """Return an event that this handler would answer, for the dry run; None if none can be supposed."""
        return None

    def computes(self) -> bool:
        """Return True if a callback computes the entities, so that nothing is known before the event."""
        return False


@read_only("entities")
class EventHandler(BaseEventHandler):
    """Gives ``entities`` whenever ``matcher`` holds."""

    entities: SomeEntitiesType | None = None

    def __init__(
        self,
        *,
        matcher: Callable[[Event], bool],
        entities: SomeEntitiesType | None = None,
        handle_once: bool = False,
    ) -> None:
        super().__init__(matcher=matcher, handle_once=handle_once)
        self.__entities = entities

    def describe(self) -> tuple[str, list[Any]]:
        text, entities = super().describe()
        if self.__entities:
            entities.extend(self.__entities)  # type: ignore[arg-type]  # one entity is a TypeError, as upstream
        return text, entities

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        super().handle(event, context)
        return self.__entities

    def foresee(self, started: Sequence[Any]) -> Event | None:
        """Return the exit, or the first output, of a started process that the matcher takes."""
        if type(self).matches is not BaseEventHandler.matches or self.event_class is not None:
            return None

        return suppose_process_event(self.matches, started)


if TYPE_CHECKING:
    OnEvent: TypeAlias = SomeEntitiesType | Callable[..., SomeEntitiesType | None] | None
    ActionMatcher: TypeAlias = Callable[[Any], bool] | Action | None


class OnActionEventBase(BaseEventHandler):
    """Handles events of one class about one action, about those a callable accepts, or about all (``None``).

    ``on_event``: an entity, several, or a callable ``(event, context)`` that gives them (``callback``).
    """

    def __init__(
        self,
        *,
        action_matcher: ActionMatcher,
        on_event: OnEvent,
        target_event_cls: type[Event],
        target_action_cls: type[Action],
        **kwargs: Any,
    ) -> None:
        if not issubclass(target_event_cls, Event):
            raise TypeError("'target_event_cls' must be a subclass of 'Event'")
        if not isinstance(action_matcher, (target_action_cls, type(None))) and not callable(action_matcher):
            raise TypeError(
                f"action_matcher must be an '{target_action_cls.__name__}' instance or a callable"
            )
        super().__init__(matcher=self.__is_mine, **kwargs)
        self.__action_matcher = action_matcher
        self.__target_action_cls = target_action_cls
        self.event_class = target_event_cls
        self.target = None if callable(action_matcher) else action_matcher
        self.callback = on_event if callable(on_event) else None
        self.__entities = [] if callable(on_event) else _checked(on_event)

    def __is_mine(self, event: Event) -> bool:
        if self.event_class is None or not isinstance(event, self.event_class):
            return False
        return self.accepts(event.action)  # type: ignore[attr-defined]

    def accepts(self, action: Action) -> bool:
        """Return True if the events of ``action`` are handled."""
        if callable(self.__action_matcher):
            return bool(self.__action_matcher(action))
        return self.__action_matcher is None or action is self.__action_matcher

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        super().handle(event, context)
        if self.__entities:
            return self.__entities  # type: ignore[return-value]
        return None if self.callback is None else _answer(self, self.callback, event, context)

    def computes(self) -> bool:
        return self.callback is not None

    def describe(self) -> tuple[str, list[Any]]:
        text, entities = super().describe()
        return text, [*entities, *self.__entities]

    @property
    def handler_description(self) -> str:
        return "<actions>" if self.__entities else str(self.callback)

    @property
    def matcher_description(self) -> str:
        event_name = "" if self.event_class is None else self.event_class.__name__
        if self.__action_matcher is None:
            return f"event == {event_name}"
        return f"event == {event_name} and {self.__target_action_cls.__name__}(event.action)"

    def first_accepted(self, started: Sequence[Any]) -> Any:
        """Return the first of the started processes that this handler is about; None without one."""
        return next((action for action in started if self.accepts(action)), None)


def _answer(
    handler: BaseEventHandler,
    callback: Callable[..., SomeEntitiesType | None],
    event: Event,
    context: LaunchContext,
) -> SomeEntitiesType | None:
    return called_for_entities(handler, callback, lambda: callback(event, context), context)


def _checked(on_event: Any) -> list[LaunchDescriptionEntity | None]:
    if not isinstance(on_event, collections.abc.Iterable):
        return [on_event]
    entities = list(on_event)
    for entity in entities:
        if not isinstance(entity, LaunchDescriptionEntity):
            raise TypeError(
                "expected all items in 'on_event' iterable to be of type "
                f"'LaunchDescriptionEntity' but got '{type(entity)}'"
            )
    return entities


class OnExecutionComplete(OnActionEventBase):
    """Handler of an action's completion; for processes and timers: of their end."""

    def __init__(self, *, target_action: ActionMatcher = None, on_completion: OnEvent, **kwargs: Any) -> None:
        super().__init__(
            action_matcher=target_action,
            on_event=on_completion,
            target_event_cls=ExecutionComplete,
            target_action_cls=Action,
            **kwargs,
        )

    def foresee(self, started: Sequence[Any]) -> Event | None:
        """Foresee the completion of processes only: everything else completes in the dry run itself."""
        action = self.first_accepted(started)
        return None if action is None else ExecutionComplete(action=action)


class OnIncludeLaunchDescription(BaseEventHandler):
    """Visits the description that an event brings; every launch has one of these."""

    event_class = IncludeLaunchDescription
    internal = True

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(matcher=lambda event: isinstance(event, IncludeLaunchDescription), **kwargs)

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        super().handle(event, context)
        assert isinstance(event, IncludeLaunchDescription)
        description: SomeEntitiesType = event.launch_description
        return description

    @property
    def handler_description(self) -> str:
        return "returns the launch_description in the event"

    @property
    def matcher_description(self) -> str:
        return "event issubclass of launch.events.IncludeLaunchDescription"


class OnShutdown(BaseEventHandler):
    """Handler of the launch's shutdown."""

    event_class = Shutdown

    def __init__(
        self,
        *,
        on_shutdown: SomeEntitiesType | Callable[[Shutdown, LaunchContext], SomeEntitiesType | None],
        **kwargs: Any,
    ) -> None:
        super().__init__(matcher=lambda event: isinstance(event, Shutdown), **kwargs)
        self.__on_shutdown = on_shutdown
        self.callback = on_shutdown if callable(on_shutdown) else None

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        super().handle(event, context)
        if callable(self.__on_shutdown):
            return _answer(self, self.__on_shutdown, event, context)
        return self.__on_shutdown

    def computes(self) -> bool:
        return callable(self.__on_shutdown)

    @property
    def handler_description(self) -> str:
        return str(self.__on_shutdown)

    @property
    def matcher_description(self) -> str:
        return "event issubclass of launch.events.Shutdown"
