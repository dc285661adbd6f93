"""``EmitEvent``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event
    from enclave_launch.description.launch.launch_context import LaunchContext


class EmitEvent(Action):
    """Queue an event; it is handled after all that is being visited now."""

    def __init__(self, *, event: Event, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.__event = event

    @property
    def event(self) -> Event:
        return self.__event

    def execute(self, context: LaunchContext) -> None:
        context.emit_event_sync(self.__event)
