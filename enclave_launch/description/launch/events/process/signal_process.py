"""The request to send a signal to a process."""

from __future__ import annotations

import signal as signals
from collections.abc import Callable
from typing import TYPE_CHECKING

from enclave_launch.description.launch.events.process.process_targeted_event import ProcessTargetedEvent
from enclave_launch.description.launch.utilities import ensure_argument_type

if TYPE_CHECKING:
    from enclave_launch.description.launch.actions.execute_local import ExecuteLocal


class SignalProcess(ProcessTargetedEvent):
    """``signal_number``: one of ``signal.Signals``, or the text ``SIGKILL``."""

    name = "launch.events.process.SignalProcess"

    def __init__(
        self, *, signal_number: str | signals.Signals, process_matcher: Callable[[ExecuteLocal], bool]
    ) -> None:
        super().__init__(process_matcher=process_matcher)
        ensure_argument_type(signal_number, (str, signals.Signals), "signal_number", "SignalProcess")
        self.__signal = signal_number

    @property
    def signal(self) -> str | signals.Signals:
        return self.__signal

    @property
    def signal_name(self) -> str:
        return self.__signal if isinstance(self.__signal, str) else self.__signal.name
