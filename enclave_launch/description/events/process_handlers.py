"""Event handlers for the start, the output and the exit of a process."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from enclave_launch.boundary.light import TYPE_CHECKING, Any
from enclave_launch.description.actions.processes import ExecuteLocal, ExecuteProcess
from enclave_launch.description.events.event import (
    Event,
    ProcessExited,
    ProcessIO,
    ProcessStarted,
    process_event_arguments,
)
from enclave_launch.description.events.handlers import OnActionEventBase

if TYPE_CHECKING:
    from enclave_launch.description.entity import SomeEntitiesType
    from enclave_launch.description.events.handlers import ActionMatcher, OnEvent
    from enclave_launch.description.launch_context import LaunchContext


class OnProcessStart(OnActionEventBase):
    """When a process has started. The target must be an ``ExecuteProcess``, or a node."""

    def __init__(self, *, target_action: ActionMatcher = None, on_start: OnEvent, **kwargs: Any) -> None:
        super().__init__(
            action_matcher=target_action,
            on_event=on_start,
            target_event_cls=ProcessStarted,
            target_action_cls=ExecuteProcess,
            **kwargs,
        )


class OnProcessExit(OnActionEventBase):
    """When a process has exited, also each time before it is respawned."""

    def __init__(self, *, target_action: ActionMatcher = None, on_exit: OnEvent, **kwargs: Any) -> None:
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


if TYPE_CHECKING:
    OnText = Callable[[ProcessIO], SomeEntitiesType | None] | None


class OnProcessIO(OnActionEventBase):
    """When a process writes, or is written to: one callback ``(event)`` for each stream."""

    def __init__(
        self,
        *,
        target_action: ActionMatcher = None,
        on_stdin: OnText = None,
        on_stdout: OnText = None,
        on_stderr: OnText = None,
        **kwargs: Any,
    ) -> None:
        def handle(event: ProcessIO, _: LaunchContext) -> SomeEntitiesType | None:
            if event.from_stdout and on_stdout is not None:
                return on_stdout(event)
            if event.from_stderr and on_stderr is not None:
                return on_stderr(event)
            if event.from_stdin and on_stdin is not None:
                return on_stdin(event)
            return None

        # Whose code this runs: a dry run does not call the user's.
        handle.__module__ = getattr(on_stdout or on_stderr or on_stdin, "__module__", __name__)
        super().__init__(
            action_matcher=target_action,
            on_event=handle,
            target_event_cls=ProcessIO,
            target_action_cls=ExecuteLocal,
            **kwargs,
        )

    def foresee(self, started: Sequence[Any]) -> Event | None:
        action = self.first_accepted(started)
        return None if action is None else ProcessIO(text=b"", fd=1, **process_event_arguments(action))
