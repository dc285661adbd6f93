"""Upstream's place of ``ProcessStdout``."""

from enclave_launch.description.launch.events.process.running_process_event import ProcessStdout

__all__ = ["ProcessStdout"]
