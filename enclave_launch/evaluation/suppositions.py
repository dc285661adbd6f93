"""Made-up process events, for finding out what handlers would do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event


def process_event_arguments(action: Any) -> dict[str, Any]:
    """The constructor arguments of an event about a process that was prepared."""
    return {"pid": 0, **(action.process_details or {})}


def suppose_process_event(matches: Callable[[Event], bool], started: Sequence[Any]) -> Event | None:
    """The first of exit and output, of the started processes in order, that ``matches``; ``None``: none does.

    ``matches`` is foreign code that may expect another kind of event; what it raises means no.
    """
    from enclave_launch.description.launch.events.process import ProcessExited, ProcessStderr, ProcessStdout

    for action in started:
        arguments = process_event_arguments(action)
        for event in (
            ProcessExited(returncode=0, **arguments),
            ProcessStdout(text=b"", **arguments),
            ProcessStderr(text=b"", **arguments),
        ):
            try:
                if matches(event):
                    return event
            except Exception:  # foreign matcher, see above
                continue
    return None
