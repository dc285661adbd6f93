"""Base of the handlers of events that are about one action."""

from __future__ import annotations

import collections.abc
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from enclave_launch.description.launch.event import Event
from enclave_launch.description.launch.event_handler import BaseEventHandler
from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity

if TYPE_CHECKING:
    from enclave_launch.description.launch.action import Action
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_entities_type import SomeEntitiesType

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
        """Is ``action`` one whose events are handled?"""
        if callable(self.__action_matcher):
            return bool(self.__action_matcher(action))
        return self.__action_matcher is None or action is self.__action_matcher

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        super().handle(event, context)
        if self.__entities:
            return self.__entities  # type: ignore[return-value]
        return self.callback(event, context) if self.callback is not None else None

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
        """The first of the started processes that this handler is about, ``None`` without one."""
        return next((action for action in started if self.accepts(action)), None)


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
