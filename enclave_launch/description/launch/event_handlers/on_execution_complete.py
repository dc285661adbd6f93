"""``OnExecutionComplete``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.event_handlers.on_action_event_base import OnActionEventBase
from enclave_launch.description.launch.events.execution_complete import ExecutionComplete

if TYPE_CHECKING:
    from collections.abc import Sequence

    from enclave_launch.description.launch.event import Event
    from enclave_launch.description.launch.event_handlers.on_action_event_base import (
        ActionMatcher,
        OnEvent,
    )


class OnExecutionComplete(OnActionEventBase):
    """When an action has been carried out; for processes and timers: has ended."""

    def __init__(self, *, target_action: ActionMatcher = None, on_completion: OnEvent, **kwargs: Any) -> None:
        super().__init__(
            action_matcher=target_action,
            on_event=on_completion,
            target_event_cls=ExecutionComplete,
            target_action_cls=Action,
            **kwargs,
        )

    def foresee(self, started: Sequence[Any]) -> Event | None:
        """Only of processes: everything else completes in the dry run itself."""
        action = self.first_accepted(started)
        return None if action is None else ExecutionComplete(action=action)
