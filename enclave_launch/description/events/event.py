"""Events: something happened, or is asked for."""

from __future__ import annotations

from collections.abc import Callable

from enclave_launch.boundary.light import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from enclave_launch.description.action import Action
    from enclave_launch.description.actions.timers import TimerAction
    from enclave_launch.description.launch_description import LaunchDescription


class Event:
    """Something that happened. ``name`` identifies the kind."""

    name = "launch.Event"

    def subject(self) -> str:
        """Whom it is about, for the marks of a dry run (``OnProcessExit talker-1``); empty when nobody."""
        return ""


class ExecutionComplete(Event):
    """``action`` has been executed; for processes and timers: has ended."""

    name = "launch.events.ExecutionComplete"

    def __init__(self, *, action: Action) -> None:
        self.__action = action

    @property
    def action(self) -> Action:
        return self.__action

    def subject(self) -> str:
        details = getattr(self.__action, "process_details", None)
        return details["name"] if details else type(self.__action).__name__


class IncludeLaunchDescription(Event):
    """``launch_description`` is to be visited."""

    name = "launch.events.IncludeLaunchDescription"

    def __init__(self, launch_description: LaunchDescription) -> None:
        self.__launch_description = launch_description

    @property
    def launch_description(self) -> LaunchDescription:
        return self.__launch_description


class Shutdown(Event):
    """``reason`` for the log; ``due_to_sigint``: the children got the signal as well."""

    name = "launch.events.Shutdown"

    def __init__(self, *, reason: Any = "reason not given", due_to_sigint: bool = False) -> None:
        self.__reason = reason
        self.__due_to_sigint = due_to_sigint

    @property
    def reason(self) -> Any:
        return self.__reason

    @property
    def due_to_sigint(self) -> bool:
        return self.__due_to_sigint


class TimerEvent(Event):
    """The period of ``timer_action`` has passed."""

    name = "launch.events.TimerEvent"

    def __init__(self, *, timer_action: TimerAction) -> None:
        self.__timer_action = timer_action

    @property
    def timer_action(self) -> TimerAction:
        return self.__timer_action

    def subject(self) -> str:
        return f"{self.__timer_action.performed_period:g}"


def matches_action(target_action: Action) -> Callable[[Action], bool]:
    """Is it exactly this action?"""
    return lambda action: action == target_action


def event_named(name: str) -> Callable[[Event], bool]:
    """A matcher of the events with this name."""
    return lambda event: event.name == name
