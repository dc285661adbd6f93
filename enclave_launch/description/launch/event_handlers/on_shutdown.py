"""``OnShutdown``."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.event_handler import BaseEventHandler
from enclave_launch.description.launch.events.shutdown import Shutdown

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_entities_type import SomeEntitiesType


class OnShutdown(BaseEventHandler):
    """When the launch begins to end."""

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
            assert isinstance(event, Shutdown)
            return self.__on_shutdown(event, context)
        return self.__on_shutdown

    def computes(self) -> bool:
        return callable(self.__on_shutdown)

    @property
    def handler_description(self) -> str:
        return str(self.__on_shutdown)

    @property
    def matcher_description(self) -> str:
        return "event issubclass of launch.events.Shutdown"
