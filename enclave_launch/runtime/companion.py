"""Companions of a launch: each may change what each process is started with, and sees what happens.

Stronger than an observer of events (``run_events``): its answers are awaited, and it lives from before the first
process until after the last. The runtime knows only this; recorders, audits and the like are handed in.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from enclave_launch.process import ResolvedComponent, ResolvedProcess
from enclave_launch.runtime.launch_log import Level
from enclave_launch.runtime.process_tree import ProcessSpec
from enclave_launch.runtime.run_events import Observer, RunEvent


class LaunchControl(Protocol):
    """The launch as a companion controls it."""

    def say(self, level: Level, message: str) -> None:
        """Write a line to the launch log."""

    def publish(self, event: RunEvent) -> None:
        """Publish an event to everything that observes the launch, the companion included."""

    def shut_down(self, reason: str) -> None: ...


class LaunchCompanion(Protocol):
    """Something that accompanies a launch: ``opened`` before the first process, ``closed`` after the last one has
    exited.

    It sees each event before other observers do: what it publishes on ``LaunchOver`` still reaches them first. A
    subclass overrides only what it needs."""

    @property
    def records(self) -> bool:
        """Return True if the companion records what the nodes request of rcl."""
        return False

    def opened(self, launch: LaunchControl) -> None:
        """Start accompanying ``launch``, before any process; raises EnclaveLaunchError if it cannot."""

    def prepared(self, process: ResolvedProcess, spec: ProcessSpec) -> ProcessSpec:
        """Return what to start for ``process``; called last, before each start."""
        return spec

    def happened(self, event: RunEvent) -> None: ...

    def loading(self, components: Sequence[ResolvedComponent]) -> None:
        """Prepare for components about to be loaded into a container that runs."""
        return

    async def closed(self) -> None: ...


class Together:
    """Several companions as one, called in their order."""

    def __init__(self, *companions: LaunchCompanion) -> None:
        self._companions = companions

    @property
    def records(self) -> bool:
        """Return True if one of the companions records."""
        return any(each.records for each in self._companions)

    def opened(self, launch: LaunchControl) -> None:
        """Open all companions; raises EnclaveLaunchError if one of them cannot accompany the launch."""
        for each in self._companions:
            each.opened(launch)

    def prepared(self, process: ResolvedProcess, spec: ProcessSpec) -> ProcessSpec:
        for each in self._companions:
            spec = each.prepared(process, spec)
        return spec

    def happened(self, event: RunEvent) -> None:
        for each in self._companions:
            each.happened(event)

    def loading(self, components: Sequence[ResolvedComponent]) -> None:
        for each in self._companions:
            each.loading(components)

    async def closed(self) -> None:
        for each in self._companions:
            await each.closed()


def companion_first(companion: LaunchCompanion | None, observe: Observer) -> Observer:
    """Return an observer that informs ``companion`` before ``observe``."""
    if companion is None:
        return observe
    inner = companion

    def both(event: RunEvent) -> None:
        inner.happened(event)
        observe(event)

    return both
