"""``OnProcessIO``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.event_handlers.on_action_event_base import OnActionEventBase
from enclave_launch.description.launch.events.process import ProcessIO
from enclave_launch.evaluation.suppositions import process_event_arguments

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event
    from enclave_launch.description.launch.event_handlers.on_action_event_base import ActionMatcher
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_entities_type import SomeEntitiesType

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
        from enclave_launch.description.launch.actions.execute_local import ExecuteLocal

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
