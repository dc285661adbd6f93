"""``launch.events.process``."""

from enclave_launch.description.launch.events.process.running_process_event import (
    ProcessExited,
    ProcessIO,
    ProcessStarted,
    ProcessStderr,
    ProcessStdin,
    ProcessStdout,
    RunningProcessEvent,
)
from enclave_launch.description.lazy import lazy_names

_get, _dir, _lazy = lazy_names(
    __name__,
    {
        "ProcessTargetedEvent": "process_targeted_event",
        "ShutdownProcess": "shutdown_process",
        "SignalProcess": "signal_process",
        "matches_executable": "process_matchers",
        "matches_name": "process_matchers",
        "matches_pid": "process_matchers",
    },
)
__getattr__, __dir__ = _get, _dir
__all__ = [
    *_lazy,
    "ProcessExited",
    "ProcessIO",
    "ProcessStarted",
    "ProcessStderr",
    "ProcessStdin",
    "ProcessStdout",
    "RunningProcessEvent",
]
