"""``LaunchService``: runs descriptions, by way of our own runtime."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from enclave_launch.description.launch.actions.emit_event import EmitEvent
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.launch_description import LaunchDescription

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event
    from enclave_launch.runtime.service import LaunchService as Runtime
    from enclave_launch.runtime.service import RunOptions


class LaunchService:
    """Include descriptions, emit events, then run: what was asked before is done first, in order.

    One run per object. ``shutdown`` works while ``run_async`` does; ``run`` takes the signals instead.
    """

    def __init__(
        self, *, argv: Iterable[str] | None = None, noninteractive: bool = False, debug: bool = False
    ) -> None:
        self.__argv = tuple(argv or ())
        self.__noninteractive = noninteractive
        self.__debug = debug
        self.__description = LaunchDescription()
        self.__context = LaunchContext(argv=self.__argv, noninteractive=noninteractive)
        self.__running: Runtime | None = None

    @property
    def context(self) -> LaunchContext:
        """The context before the run; a run makes its own."""
        return self.__context

    def include_launch_description(self, launch_description: LaunchDescription) -> None:
        self.__description.add_entity(launch_description)

    def emit_event(self, event: Event) -> None:
        self.__description.add_action(EmitEvent(event=event))

    def run(self, *, shutdown_when_idle: bool = True) -> int:
        """Block until all is over. Gives 0, or 1 when something failed."""
        from enclave_launch.runtime.service import run_launch

        return run_launch(self.__description, options=self.__options(shutdown_when_idle))

    async def run_async(self, *, shutdown_when_idle: bool = True) -> int:
        """As ``run``, inside a running loop, and without touching signals."""
        from enclave_launch.runtime.service import LaunchService as Runtime

        self.__running = Runtime(self.__description, gate=None, options=self.__options(shutdown_when_idle))
        try:
            return await self.__running.run()
        finally:
            self.__running = None

    def shutdown(self, force_sync: bool = False) -> None:
        """End the run in progress, in order; nothing happens without one."""
        if self.__running is not None:
            self.__running.shut_down("LaunchService.shutdown() called")

    def __options(self, shutdown_when_idle: bool) -> RunOptions:
        from enclave_launch.runtime.service import RunOptions

        return RunOptions(
            noninteractive=self.__noninteractive,
            debug=self.__debug,
            shutdown_when_idle=shutdown_when_idle,
            arguments=self.__argv,
        )
