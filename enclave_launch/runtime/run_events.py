"""The events of a run, as values for programs that watch it; in order, in the launch's thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

from enclave_launch.process import ResolvedProcess
from nodl.node_interface import EndpointKind


class LaunchStarted(NamedTuple):
    """Evaluation begins. ``log_directory``: where launch.log and the processes' own logs are; ``recorded``: endpoints
    will be reported as they are made."""

    log_directory: str
    recorded: bool = False


class ProcessPlanned(NamedTuple):
    """The launch came to this process; it starts as soon as its enclave is complete."""

    process: ResolvedProcess


class ProcessStarted(NamedTuple):
    """A process was started. ``name`` is the process name (``talker-1``), unique within the launch. A respawned
    process starts again."""

    name: str
    pid: int


class ProcessOutput(NamedTuple):
    """As it was read: not cut into lines."""

    name: str
    stream: Literal["stdout", "stderr"]
    data: bytes


class ProcessExited(NamedTuple):
    """A process has exited. ``returncode`` as of ``subprocess``: negative for a signal."""

    name: str
    pid: int
    returncode: int


class ProcessOver(NamedTuple):
    """It will not be started again. ``failed``: it ended badly on its own, or could not be started."""

    name: str
    failed: bool


class EndpointRequested(NamedTuple):
    """An endpoint that a node requested of rcl.

    ``node`` and ``name`` are final, after all rules; ``written`` as the source has it. ``component``:
    ``package/plugin`` of the composable node that requested it, empty for nodes of the program itself. An action is one
    endpoint."""

    node: str
    kind: EndpointKind
    name: str
    written: str
    type: str = ""
    component: str = ""


class EndpointCreated(NamedTuple):
    """A node of the process has this endpoint now; ``pid`` as of ``ProcessStarted``. Only of a launch that is recorded
    (``RunSettings.record``)."""

    name: str
    pid: int
    endpoint: EndpointRequested


class EndpointRefused(NamedTuple):
    """It was requested and not made: DDS refused it, or rcl its name. ``reason``: rcl's texts, first cause first."""

    name: str
    pid: int
    endpoint: EndpointRequested
    reason: tuple[str, ...]


class LaunchFailed(NamedTuple):
    """The launch cannot go on and is shutting down."""

    reason: str


class LaunchOver(NamedTuple):
    """Nothing is left of it. ``exit_status`` as ``run`` gives it."""

    exit_status: int


RunEvent = (
    LaunchStarted
    | ProcessPlanned
    | ProcessStarted
    | ProcessOutput
    | ProcessExited
    | ProcessOver
    | EndpointCreated
    | EndpointRefused
    | LaunchFailed
    | LaunchOver
)
Observer = Callable[[RunEvent], None]


def unobserved(event: RunEvent) -> None:
    """Ignore the event; the observer of a run without an observer."""
