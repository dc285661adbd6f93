"""Upstream's place of ``ProcessIO``."""

from enclave_launch.description.launch.events.process.running_process_event import ProcessIO

__all__ = ["ProcessIO"]
