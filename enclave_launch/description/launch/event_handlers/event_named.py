"""A matcher of events by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event


def event_named(name: str) -> Callable[[Event], bool]:
    return lambda event: event.name == name
