"""Upstream's place of ``ProcessExited``."""

from enclave_launch.description.launch.events.process.running_process_event import ProcessExited

__all__ = ["ProcessExited"]
