"""``launch.events``."""

from enclave_launch.description.lazy import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "ExecutionComplete": "execution_complete",
        "IncludeLaunchDescription": "include_launch_description",
        "Shutdown": "shutdown",
        "TimerEvent": "timer_event",
        "matches_action": "matchers",
    },
    submodules=("process",),
)
