"""``UnregisterEventHandler``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action

if TYPE_CHECKING:
    from enclave_launch.description.launch.event_handler import BaseEventHandler
    from enclave_launch.description.launch.launch_context import LaunchContext


class UnregisterEventHandler(Action):
    """Unregister a handler. Raises ``ValueError`` when it is not registered."""

    def __init__(self, event_handler: BaseEventHandler, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.__event_handler = event_handler

    @property
    def event_handler(self) -> BaseEventHandler:
        return self.__event_handler

    def execute(self, context: LaunchContext) -> None:
        context.unregister_event_handler(self.__event_handler)
