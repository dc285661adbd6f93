"""``OnProcessExit``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.event_handlers.on_action_event_base import OnActionEventBase
from enclave_launch.description.launch.events.process import ProcessExited
from enclave_launch.evaluation.suppositions import process_event_arguments

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event
    from enclave_launch.description.launch.event_handlers.on_action_event_base import (
        ActionMatcher,
        OnEvent,
    )


class OnProcessExit(OnActionEventBase):
    """When a process has exited, also each time before it is respawned."""

    def __init__(self, *, target_action: ActionMatcher = None, on_exit: OnEvent, **kwargs: Any) -> None:
        from enclave_launch.description.launch.actions.execute_local import ExecuteLocal

        super().__init__(
            action_matcher=target_action,
            on_event=on_exit,
            target_event_cls=ProcessExited,
            target_action_cls=ExecuteLocal,
            **kwargs,
        )

    def foresee(self, started: Sequence[Any]) -> Event | None:
        action = self.first_accepted(started)
        return None if action is None else ProcessExited(returncode=0, **process_event_arguments(action))
