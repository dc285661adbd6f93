"""An action has been carried out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.event import Event

if TYPE_CHECKING:
    from enclave_launch.description.launch.action import Action


class ExecutionComplete(Event):
    """``action`` has been executed; for processes and timers: has ended."""

    name = "launch.events.ExecutionComplete"

    def __init__(self, *, action: Action) -> None:
        self.__action = action

    @property
    def action(self) -> Action:
        return self.__action

    def subject(self) -> str:
        details = getattr(self.__action, "process_details", None)
        return details["name"] if details else type(self.__action).__name__
