"""Who goes along with a launch: may change what each process is started with, and is told what happens.

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
    """What a companion may do to the launch."""

    def say(self, level: Level, message: str) -> None:
        """A line of the launch log."""

    def tell(self, event: RunEvent) -> None:
        """An event for all who watch the launch, the companion included."""

    def shut_down(self, reason: str) -> None: ...


class LaunchCompanion(Protocol):
    """``opened`` comes before the first process, ``closed`` after the last one has ended. It hears of an event before
    others do: what it tells when ``LaunchOver`` comes is still heard before that. Who inherits from this does nothing
    where it does not say what."""

    @property
    def records(self) -> bool:
        """Once opened: will it tell endpoints as they are made?"""
        return False

    def opened(self, launch: LaunchControl) -> None:
        """:raises EnclaveLaunchError: it cannot go along, so nothing is started."""

    def prepared(self, process: ResolvedProcess, spec: ProcessSpec) -> ProcessSpec:
        """What to start, when everything else has been decided; asked before each start."""
        return spec

    def happened(self, event: RunEvent) -> None: ...

    def loading(self, components: Sequence[ResolvedComponent]) -> None:
        """Components are about to be loaded into a container that runs."""
        return

    async def closed(self) -> None: ...


class Together:
    """Several companions as one: asked and told in their order."""

    def __init__(self, *companions: LaunchCompanion) -> None:
        self._companions = companions

    @property
    def records(self) -> bool:
        """Whether one of them does."""
        return any(each.records for each in self._companions)

    def opened(self, launch: LaunchControl) -> None:
        """:raises EnclaveLaunchError: one of them cannot go along."""
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
    """The companion first: what it adds to the record is there when others look."""
    if companion is None:
        return observe
    told = companion

    def both(event: RunEvent) -> None:
        told.happened(event)
        observe(event)

    return both
