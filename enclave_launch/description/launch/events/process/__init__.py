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

__getattr__, __dir__ = lazy_names(
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
__all__ = [
    "ProcessExited",
    "ProcessIO",
    "ProcessStarted",
    "ProcessStderr",
    "ProcessStdin",
    "ProcessStdout",
    "ProcessTargetedEvent",
    "RunningProcessEvent",
    "ShutdownProcess",
    "SignalProcess",
    "matches_executable",
    "matches_name",
    "matches_pid",
]
