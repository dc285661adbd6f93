"""``OnProcessStart``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.event_handlers.on_action_event_base import OnActionEventBase
from enclave_launch.description.launch.events.process import ProcessStarted

if TYPE_CHECKING:
    from enclave_launch.description.launch.event_handlers.on_action_event_base import (
        ActionMatcher,
        OnEvent,
    )


class OnProcessStart(OnActionEventBase):
    """When a process has started. The target must be an ``ExecuteProcess``, or a node."""

    def __init__(self, *, target_action: ActionMatcher = None, on_start: OnEvent, **kwargs: Any) -> None:
        from enclave_launch.description.launch.actions.execute_process import ExecuteProcess

        super().__init__(
            action_matcher=target_action,
            on_event=on_start,
            target_event_cls=ProcessStarted,
            target_action_cls=ExecuteProcess,
            **kwargs,
        )
