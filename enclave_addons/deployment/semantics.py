"""Find what of a launch file an engine cannot express, so that nobody finds out on the robot.

An engine starts processes, restarts them and ends them. What launch itself does meanwhile (handlers, timers, loading
components, changing states) has nobody to do it there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import Enum
from typing import NamedTuple

from enclave_addons.deployment.processes import DeployedProcess
from enclave_launch.diagnostics import Code
from enclave_launch.dry_run import DryRun


class Engine(str, Enum):
    """Program that runs the processes."""

    SYSTEMD = "systemd"
    COMPOSE = "compose"
    KUBERNETES = "kubernetes"


class Unexpressed(NamedTuple):
    """A part of a launch that an engine cannot express. ``place`` is file:line of the launch file."""

    what: str
    place: str

    def __str__(self) -> str:
        return f"{self.place}: {self.what}"


def unexpressed(document: DryRun, engine: Engine) -> tuple[Unexpressed, ...]:
    """Return everything that would be lost, in the order of the launch file's processes, components and reactions."""
    found = (
        *_late_processes(document),
        *_components(document),
        *_calls(document),
        *_reactions(document, engine),
        *_unforeseen(document),
    )
    return tuple(dict.fromkeys(found))


def unexpressed_needs(processes: Iterable[DeployedProcess], engine: Engine) -> tuple[Unexpressed, ...]:
    """Return the needs of processes that ``engine`` cannot express."""
    if engine is not Engine.KUBERNETES:
        return ()
    wanted = [
        (one, (*one.needs.devices, *(["real-time scheduling"] if one.needs.realtime else [])))
        for one in processes
    ]
    return tuple(
        Unexpressed(
            f"{one.entry.process} needs {', '.join(what)}, which the cluster has to provide", one.entry.place
        )
        for one, what in wanted
        if what
    )


def ends_launch(document: DryRun) -> frozenset[str]:
    """Return the processes whose exit ends the whole launch."""
    return frozenset(one.ends_with for one in document.reactions if one.ends_with)


def differences(document: DryRun, engine: Engine) -> tuple[str, ...]:
    """Return what works, but not as in launch: to be reported, not refused."""
    started = [one for one in document.processes if one.on_event is None]
    respawns = [one.respawn for one in started if one.respawn]
    found = []
    if engine is Engine.KUBERNETES and len(respawns) < len(started):
        found.append("Kubernetes starts every process again when it ends, also those without respawn")
    if engine is Engine.COMPOSE and any(one.delay for one in respawns):
        found.append("Docker waits longer before each new start; respawn_delay is not followed")
    if engine is not Engine.SYSTEMD and any(one.retries >= 0 for one in respawns):
        found.append("respawn_max_retries is not followed: restarts are not limited")
    return tuple(found)


def _late_processes(document: DryRun) -> Iterator[Unexpressed]:
    for one in document.processes:
        if one.on_event is not None:
            yield Unexpressed(f"{one.process} is started by an event ({one.on_event})", one.place)


def _components(document: DryRun) -> Iterator[Unexpressed]:
    for one in document.components:
        what = f"component {one.fqn} is loaded into {one.container} by the launcher"
        yield Unexpressed(what, one.place)


def _calls(document: DryRun) -> Iterator[Unexpressed]:
    for one in document.launcher_calls:
        if not one.service.endswith("/_container/load_node"):
            yield Unexpressed(f"the launcher calls {one.service}", one.place)


def _reactions(document: DryRun, engine: Engine) -> Iterator[Unexpressed]:
    """Yield reactions to exits. systemd can express that an exit ends the launch, unless the process is respawned."""
    respawned = {one.process for one in document.processes if one.respawn}
    for one in document.reactions:
        if one.ends_with and engine is Engine.SYSTEMD and one.ends_with not in respawned:
            continue
        what = f"{one.what}: the end of {one.ends_with} ends the launch" if one.ends_with else one.what
        yield Unexpressed(what, one.place)


def _unforeseen(document: DryRun) -> Iterator[Unexpressed]:
    for one in document.diagnostics:
        if one.code == Code.NOT_FORESEEABLE.value:
            yield Unexpressed(one.text, one.place)
