"""A timer has fired."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.event import Event

if TYPE_CHECKING:
    from enclave_launch.description.launch.actions.timer_action import TimerAction


class TimerEvent(Event):
    """The period of ``timer_action`` has passed."""

    name = "launch.events.TimerEvent"

    def __init__(self, *, timer_action: TimerAction) -> None:
        self.__timer_action = timer_action

    @property
    def timer_action(self) -> TimerAction:
        return self.__timer_action

    def subject(self) -> str:
        return f"{self.__timer_action.performed_period:g}"
