"""Events: something happened, or is requested; those of processes, their matchers and what a dry run supposes."""

from __future__ import annotations

import signal as signals
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.argument_types import ensure_argument_type

if TYPE_CHECKING:
    import signal as signals


# Types of higher floors: the actions and descriptions that events are about know their events.
Action = Any
ExecuteLocal = Any
LaunchDescription = Any
TimerAction = Any


class Event:
    """Something that happened. ``name`` identifies the kind."""

    name = "launch.Event"

    def subject(self) -> str:
        """Return the subject of the event for the marks of a dry run (``OnProcessExit talker-1``), or an empty text."""
        return ""


@read_only("action")
class ExecutionComplete(Event):
    """The end of an action. ``action`` has been executed; for processes and timers: has ended."""

    name = "launch.events.ExecutionComplete"
    action: Action

    def __init__(self, *, action: Action) -> None:
        self.__action = action

    def subject(self) -> str:
        details = getattr(self.__action, "process_details", None)
        return details["name"] if details else type(self.__action).__name__


@read_only("launch_description")
class IncludeLaunchDescription(Event):
    """A request to visit a description. ``launch_description`` is to be visited."""

    name = "launch.events.IncludeLaunchDescription"
    launch_description: LaunchDescription

    def __init__(self, launch_description: LaunchDescription) -> None:
        self.__launch_description = launch_description


@read_only("reason", "due_to_sigint")
class Shutdown(Event):
    """The launch shuts down. ``reason`` for the log; ``due_to_sigint``: the children got the signal as well."""

    name = "launch.events.Shutdown"
    reason: Any = "reason not given"
    due_to_sigint: bool = False

    def __init__(self, *, reason: Any = "reason not given", due_to_sigint: bool = False) -> None:
        self.__reason = reason
        self.__due_to_sigint = due_to_sigint


@read_only("timer_action")
class TimerEvent(Event):
    """The period of ``timer_action`` has passed."""

    name = "launch.events.TimerEvent"
    timer_action: TimerAction

    def __init__(self, *, timer_action: TimerAction) -> None:
        self.__timer_action = timer_action

    def subject(self) -> str:
        return f"{self.__timer_action.performed_period:g}"


def matches_action(target_action: Action) -> Callable[[Action], bool]:
    """Return a matcher of exactly this action."""
    return lambda action: action == target_action


def event_named(name: str) -> Callable[[Event], bool]:
    """Return a matcher of the events with this name."""
    return lambda event: event.name == name


@read_only("process_name", "cwd", "env", "pid", "action", "cmd")
class RunningProcessEvent(Event):
    """An event of one process. ``process_name`` is NAME-N; ``cmd``, ``cwd``, ``env`` are final."""

    name = "launch.events.process.RunningProcessEvent"
    process_name: str = ""
    cwd: str | None = None
    env: Mapping[str, str] | None = None
    pid: int = 0
    action: ExecuteLocal
    cmd: list[str]

    def __init__(
        self,
        *,
        action: ExecuteLocal,
        name: str,
        cmd: list[str],
        cwd: str | None,
        env: Mapping[str, str] | None,
        pid: int,
    ) -> None:
        self.__action = action
        self.__process_name = name
        self.__cmd = cmd
        self.__cwd = cwd
        self.__env = env
        self.__pid = pid

    @property
    def execute_process_action(self) -> ExecuteLocal:
        return self.__action

    def subject(self) -> str:
        return self.__process_name


class ProcessStarted(RunningProcessEvent):
    """The process runs."""

    name = "launch.events.process.ProcessStarted"


@read_only("returncode")
class ProcessExited(RunningProcessEvent):
    """The process has ended with ``returncode``; negative is the number of a signal."""

    name = "launch.events.process.ProcessExited"
    returncode: int = 0

    def __init__(self, *, returncode: int, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.__returncode = returncode


@read_only("text")
class ProcessIO(RunningProcessEvent):
    """Output or input of a process. ``text`` (bytes) came from, or goes to, the stream with this file descriptor."""

    name = "launch.events.process.ProcessIO"
    text: bytes = b""

    def __init__(self, *, text: bytes, fd: int, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.__text = text
        self.__fd = fd

    @property
    def from_stdin(self) -> bool:
        return self.__fd == 0

    @property
    def from_stdout(self) -> bool:
        return self.__fd == 1

    @property
    def from_stderr(self) -> bool:
        return self.__fd == 2


class ProcessStdin(ProcessIO):
    """Input of a process. ``text`` goes to the standard input of the process."""

    name = "launch.events.process.ProcessStdin"

    def __init__(self, *, text: bytes, **kwargs: Any) -> None:
        super().__init__(text=text, fd=0, **kwargs)


class ProcessStdout(ProcessIO):
    """Standard output of a process. ``text`` came from the standard output of the process."""

    name = "launch.events.process.ProcessStdout"

    def __init__(self, *, text: bytes, **kwargs: Any) -> None:
        super().__init__(text=text, fd=1, **kwargs)


class ProcessStderr(ProcessIO):
    """Standard error output of a process. ``text`` came from the standard error output of the process."""

    name = "launch.events.process.ProcessStderr"

    def __init__(self, *, text: bytes, **kwargs: Any) -> None:
        super().__init__(text=text, fd=2, **kwargs)


@read_only("process_matcher")
class ProcessTargetedEvent(Event):
    """For the processes that ``process_matcher`` accepts."""

    name = "launch.events.process.ProcessTargetedEvent"
    process_matcher: Callable[[ExecuteLocal], bool]

    def __init__(self, *, process_matcher: Callable[[ExecuteLocal], bool]) -> None:
        self.__process_matcher = process_matcher


# Matchers for ``ProcessTargetedEvent``; a process that was not prepared matches none.

Matcher = Callable[["ExecuteLocal"], bool]


def _matches(test: Callable[[dict[str, Any]], bool]) -> Matcher:
    def matcher(action: ExecuteLocal) -> bool:
        details = action.process_details
        return details is not None and test(details)

    return matcher


def matches_pid(pid: int) -> Matcher:
    """Return a matcher of the process with this id."""
    return _matches(lambda details: bool(details["pid"] == pid))


def matches_name(name: str) -> Matcher:
    """Match by NAME-N."""
    return _matches(lambda details: bool(details["name"] == name))


def matches_executable(executable: str) -> Matcher:
    """Match by the end of the first word of the command."""
    return _matches(lambda details: bool(details["cmd"][0].endswith(executable)))


class ShutdownProcess(ProcessTargetedEvent):
    """Ends with SIGINT, then SIGTERM, then SIGKILL."""

    name = "launch.events.process.ShutdownProcess"


@read_only("signal")
class SignalProcess(ProcessTargetedEvent):
    """A request to signal processes. ``signal_number``: one of ``signal.Signals``, or the text ``SIGKILL``."""

    name = "launch.events.process.SignalProcess"
    signal: str | signals.Signals

    def __init__(
        self, *, signal_number: str | signals.Signals, process_matcher: Callable[[ExecuteLocal], bool]
    ) -> None:
        super().__init__(process_matcher=process_matcher)
        ensure_argument_type(signal_number, (str, signals.Signals), "signal_number", "SignalProcess")
        self.__signal = signal_number

    @property
    def signal_name(self) -> str:
        return self.__signal if isinstance(self.__signal, str) else self.__signal.name


def process_event_arguments(action: Any) -> dict[str, Any]:
    """Return the constructor arguments of an event about a process that was prepared."""
    return {"pid": 0, **(action.process_details or {})}


def suppose_process_event(matches: Callable[[Event], bool], started: Sequence[Any]) -> Event | None:
    """Return the first exit or output that ``matches``, foreign code that may raise; None if none does."""

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
