"""Upstream's place of ``ProcessStdin``."""

from enclave_launch.description.launch.events.process.running_process_event import ProcessStdin

__all__ = ["ProcessStdin"]
