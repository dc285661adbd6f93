"""``launch.event_handlers``."""

from enclave_launch.description.lazy import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "OnExecutionComplete": "on_execution_complete",
        "OnIncludeLaunchDescription": "on_include_launch_description",
        "OnProcessExit": "on_process_exit",
        "OnProcessIO": "on_process_io",
        "OnProcessStart": "on_process_start",
        "OnShutdown": "on_shutdown",
        "event_named": "event_named",
    },
)
