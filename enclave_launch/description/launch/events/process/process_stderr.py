"""Upstream's place of ``ProcessStderr``."""

from enclave_launch.description.launch.events.process.running_process_event import ProcessStderr

__all__ = ["ProcessStderr"]
