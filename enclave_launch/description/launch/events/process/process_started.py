"""Upstream's place of ``ProcessStarted``."""

from enclave_launch.description.launch.events.process.running_process_event import ProcessStarted

__all__ = ["ProcessStarted"]
