"""The launch is to end."""

from __future__ import annotations

from typing import Any

from enclave_launch.description.launch.event import Event


class Shutdown(Event):
    """``reason`` for the log; ``due_to_sigint``: the children got the signal as well."""

    name = "launch.events.Shutdown"

    def __init__(self, *, reason: Any = "reason not given", due_to_sigint: bool = False) -> None:
        self.__reason = reason
        self.__due_to_sigint = due_to_sigint

    @property
    def reason(self) -> Any:
        return self.__reason

    @property
    def due_to_sigint(self) -> bool:
        return self.__due_to_sigint
