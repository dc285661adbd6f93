"""``OnIncludeLaunchDescription``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.event_handler import BaseEventHandler
from enclave_launch.description.launch.events.include_launch_description import IncludeLaunchDescription

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_entities_type import SomeEntitiesType


class OnIncludeLaunchDescription(BaseEventHandler):
    """Visits the description that an event brings; every launch has one of these."""

    event_class = IncludeLaunchDescription
    internal = True

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(matcher=lambda event: isinstance(event, IncludeLaunchDescription), **kwargs)

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        super().handle(event, context)
        assert isinstance(event, IncludeLaunchDescription)
        return event.launch_description

    @property
    def handler_description(self) -> str:
        return "returns the launch_description in the event"

    @property
    def matcher_description(self) -> str:
        return "event issubclass of launch.events.IncludeLaunchDescription"
