"""Requests to a process."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from enclave_launch.description.launch.event import Event

if TYPE_CHECKING:
    from enclave_launch.description.launch.actions.execute_local import ExecuteLocal


class ProcessTargetedEvent(Event):
    """For the processes that ``process_matcher`` accepts."""

    name = "launch.events.process.ProcessTargetedEvent"

    def __init__(self, *, process_matcher: Callable[[ExecuteLocal], bool]) -> None:
        self.__process_matcher = process_matcher

    @property
    def process_matcher(self) -> Callable[[ExecuteLocal], bool]:
        return self.__process_matcher
