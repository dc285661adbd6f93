"""``LaunchService`` runs descriptions by way of our own runtime; the small parts of asyncio that upstream adds."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.actions.events import EmitEvent
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.launch_description import LaunchDescription

if TYPE_CHECKING:
    from enclave_launch.description.events.event import Event
    from enclave_launch.runtime.live_launch import LiveLaunch


@read_only("context")
class LaunchService:
    """Include descriptions, emit events, then run: what was requested earlier is done first, in order.

    One run per object. ``shutdown`` works while ``run_async`` does.
    """

    context: LaunchContext  # before the run; a run makes its own

    def __init__(
        self, *, argv: Iterable[str] | None = None, noninteractive: bool = False, debug: bool = False
    ) -> None:
        self.__argv = tuple(argv or ())
        self.__noninteractive = noninteractive
        self.__debug = debug
        self.__description = LaunchDescription()
        self.__context = LaunchContext(argv=self.__argv, noninteractive=noninteractive)
        self.__running: LiveLaunch | None = None

    def include_launch_description(self, launch_description: LaunchDescription) -> None:
        self.__description.add_entity(launch_description)

    def emit_event(self, event: Event) -> None:
        self.__description.add_action(EmitEvent(event=event))

    def run(self, *, shutdown_when_idle: bool = True) -> int:
        """Block until all is over; SIGINT shuts down in order. Returns 0, or 1 if something failed."""
        from enclave_launch.runtime.live_launch import run_launch

        with self.__launch(shutdown_when_idle) as launch:
            return run_launch(launch)

    async def run_async(self, *, shutdown_when_idle: bool = True) -> int:
        """Run as ``run`` does, inside a running loop and without touching signals."""
        with self.__launch(shutdown_when_idle) as launch:
            return await launch.run()

    def shutdown(self, force_sync: bool = False) -> None:
        """End the run in progress, in order; nothing happens without one."""
        if self.__running is not None:
            self.__running.shut_down("LaunchService.shutdown() called")

    @contextmanager
    def __launch(self, shutdown_when_idle: bool) -> Iterator[LiveLaunch]:
        from enclave_launch.runtime.live_launch import DescribedLaunch

        self.__running = DescribedLaunch(self.__description, self.__noninteractive, self.__debug)
        self.__running.shutdown_when_idle = shutdown_when_idle
        try:
            yield self.__running
        finally:
            self.__running = None


class AsyncSafeSignalManager:
    """Within its ``with`` block, ``handle(signal, function)`` calls ``function(signum)`` from the loop."""

    def __init__(self, loop: Any) -> None:
        self.__loop = loop
        self.__handled: set[int] = set()

    def __enter__(self) -> AsyncSafeSignalManager:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        for signum in self.__handled:
            self.__loop.remove_signal_handler(signum)
        self.__handled.clear()

    def handle(self, signum: int, handler: Callable[[int], object] | None) -> None:
        """Handle ``signum`` from now on; ``None`` stops that."""
        number = signal.Signals(signum)
        if handler is None:
            self.__handled.discard(number)
            self.__loop.remove_signal_handler(number)
            return
        self.__loop.add_signal_handler(number, handler, number)
        self.__handled.add(number)


def create_future(loop: Any) -> Any:
    """Create a future of ``loop``, or of the loop that is running."""
    if loop is None:
        import asyncio

        loop = asyncio.get_event_loop()
    return loop.create_future()
