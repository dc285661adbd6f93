"""The live launch: one event loop that drives evaluation, processes, timers and signals until all is over.

    run_launch(LiveLaunch(source, ...))      blocks, takes the signals, returns the exit status
    await LiveLaunch(source, ...).run()      the same inside a running loop, cancel-safe

Semantics of launch/launch_service.py: the description is visited while one event is handled; then events,
newest handler first, until nothing is left to wait for. Stricter than there: SIGTERM, SIGQUIT and SIGHUP
shut down in order and leave no orphans; what ended badly on its own shows in the exit status.
"""

from __future__ import annotations

import asyncio
import os
import socket
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import AsyncExitStack, contextmanager
from datetime import datetime, timezone
from pathlib import Path
from signal import SIG_IGN, SIGHUP, SIGINT, SIGQUIT, SIGTERM, Signals, getsignal
from typing import Any

from enclave_launch.description.events.event import IncludeLaunchDescription, Shutdown
from enclave_launch.description.events.handlers import OnIncludeLaunchDescription, OnShutdown
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.logging import log_base_directory
from enclave_launch.description.visit import handle_next
from enclave_launch.errors import EnclaveLaunchError, RuntimeFailure
from enclave_launch.evaluation.active_environment import ENVIRONMENT_SWITCH, LaunchEnvironment
from enclave_launch.evaluation.evaluate import (
    forget_elements_of_launch_files,
    launch_file_error,
    top_description,
)
from enclave_launch.frontend import error_location
from enclave_launch.host.current import active_host
from enclave_launch.options import RunSettings
from enclave_launch.plan import LaunchSource
from enclave_launch.prefixes import prepend_prefixes
from enclave_launch.runtime.companion import companion_first
from enclave_launch.runtime.gate import EnclaveGate
from enclave_launch.runtime.launch_log import (
    BackPressure,
    LaunchLog,
    Level,
    Writers,
    captured_logging,
    make_log_directory,
)
from enclave_launch.runtime.live_host import LiveHost
from enclave_launch.runtime.overlap import many_descriptors
from enclave_launch.runtime.process_tree import ProcessTree
from enclave_launch.runtime.ros_services import RosServices
from enclave_launch.runtime.run_events import (
    LaunchFailed,
    LaunchOver,
    LaunchStarted,
    Observer,
    RunEvent,
    unobserved,
)
from enclave_launch.runtime.sinks import ScreenSink, SinkWriter
from enclave_launch.runtime.warden_process import WardenProcess

_MOST_LAST_EVENTS = 100  # that lead to each other once everything is shut down and over


def run_launch(launch: LiveLaunch) -> int:
    """Run it to the end in the main thread; return the exit status. Raises RuntimeFailure."""
    require_signals()

    async def main() -> int:
        with signals_to(launch.on_signal):
            return await launch.run()

    return asyncio.run(main())


class LiveLaunch:
    """One run of a launch file. ``shut_down`` may be called from the loop at any time.

    ``needs_ros_services``: ``None`` if it is unknown until the file is visited. ``warden``: one that is starting up
    already; it ends with the launch.
    """

    shutdown_when_idle = True

    def __init__(
        self,
        source: LaunchSource,
        settings: RunSettings | None = None,
        *,
        gate: EnclaveGate | None = None,
        needs_ros_services: bool | None = False,
        warden: WardenProcess | None = None,
        observe: Observer = unobserved,
    ) -> None:
        self._settings = settings or RunSettings()
        self._observe = companion_first(self._settings.companion, observe)
        self._source = source._replace(launch_file=os.path.abspath(source.launch_file))
        self._gate = gate
        self._needs_ros_services = needs_ros_services
        self._warden = warden
        self._wake = asyncio.Event()
        self._futures: list[asyncio.Future[Any]] = []
        self._shutting_down = False
        self._last_events = 0  # when all else was over
        self._interrupted = False
        self._failed = False
        self._services: RosServices | None = None
        self.warden_pid: int | None = None
        self._environment = LaunchEnvironment(
            lambda: prepend_prefixes(source.prefixes), lambda: self._host.prefixes()
        )
        self._log: LaunchLog
        self._host: LiveHost
        self._context: LaunchContext

    async def run(self) -> int:
        """Run to its end; cancelling it shuts down in order. Raises RuntimeFailure before anything was started."""
        async with AsyncExitStack() as stack:
            tree = ProcessTree(self._warden)  # first: the warden starts up while we go on
            self.warden_pid = tree.warden_pid
            tree.on_interrupt = lambda: self.on_signal(SIGINT)
            await stack.enter_async_context(tree)
            stack.enter_context(many_descriptors())
            with ENVIRONMENT_SWITCH.restored():
                if self._needs_ros_services:
                    self.services()  # what is missing for them is said before anything starts
                stack.callback(self._close_services)
                self._log = self._open_log(tree)
            stack.callback(self._log.close)
            stack.enter_context(
                captured_logging(self._log, lambda: ENVIRONMENT_SWITCH.is_active(self._environment))
            )
            companion, results = self._settings.companion, self._source.user_code_results
            if companion is not None:
                companion.opened(self)
                stack.push_async_callback(companion.closed)
            self._host = LiveHost(
                tree,
                self._log,
                self._gate,
                secrets=self._settings.secrets,
                fail=self._on_failure,
                services=self.services,
                observe=self._observe,
                companion=companion,
                options=self._source.host_options,
                # What the dry run noted, for the first run that follows it.
                user_code_results=results if results is not None and results.rewind() else None,
            )
            stack.push_async_callback(self._host.close)
            stack.enter_context(active_host(self._host))
            stack.callback(forget_elements_of_launch_files)
            stack.callback(ENVIRONMENT_SWITCH.leave, self._environment)
            return await self._run_until_over(tree)

    def shut_down(self, reason: str, *, due_to_sigint: bool = False) -> None:
        """Queue the ``Shutdown`` event, once; nothing new is started from here on."""
        if not self._shutting_down:
            self._context.emit_event_sync(Shutdown(reason=reason, due_to_sigint=due_to_sigint))
        self._enter_shutdown()

    def say(self, level: Level, message: str) -> None:
        """Write a line to the launch log."""
        self._log.log(level, "launch", message)

    def publish(self, event: RunEvent) -> None:
        """Publish an event that a companion has seen."""
        self._observe(event)

    def on_signal(self, number: Signals) -> None:
        if number is not SIGINT:
            self.say("ERROR", f"received {number.name}, shutting down")
            self._failed = True
            self.shut_down(f"signal {number.name}")
        elif self._interrupted:
            self.say("WARNING", "user interrupted with ctrl-c (SIGINT) again, passing it on...")
            for process in self._host.processes:
                process.interrupt_again()
        else:
            self._interrupted = True
            self.say("WARNING", "user interrupted with ctrl-c (SIGINT)")
            self.shut_down("ctrl-c (SIGINT)", due_to_sigint=True)

    async def _run_until_over(self, tree: ProcessTree) -> int:
        self.say("INFO", f"All log files can be found below {self._log.directory}")
        self.say("INFO", f"Default logging verbosity is set to {'DEBUG' if self._settings.debug else 'INFO'}")
        companion = self._settings.companion
        recorded = companion is not None and companion.records
        self._observe(LaunchStarted(str(self._log.directory), recorded))
        self._check_deadline()
        with ENVIRONMENT_SWITCH.active(self._environment):
            self._begin()
        if tree.lost is not None:
            lost = RuntimeFailure("the warden process was killed, and all processes with it")
            tree.lost.add_done_callback(lambda _: self._on_failure(lost))
        cancelled: asyncio.CancelledError | None = None
        while True:
            try:
                await self._turn()
            except _Over:
                break
            except asyncio.CancelledError as error:
                cancelled = error
                self.shut_down("cancelled")
            except error_location.RAISED_BY_USER_CODE as error:  # it ends the launch
                self._on_error(error)
        if cancelled is not None:
            raise cancelled
        status = self._exit_status()
        self._observe(LaunchOver(status))
        return status

    def _check_deadline(self) -> None:
        """Check the deadline every minute, since a clock can be set, and more often shortly before it."""
        deadline = self._settings.deadline
        if deadline is None or self._shutting_down:
            return
        left = (deadline.at - datetime.now(timezone.utc)).total_seconds()
        if left > 0:
            asyncio.get_running_loop().call_later(min(left, 60.0), self._check_deadline)
            return
        deadline.reached = True
        self.say("WARNING", deadline.reason)
        self.shut_down(deadline.reason)

    def _begin(self) -> None:
        argv = [f"{name}:={value}" for name, value in self._source.arguments]
        noninteractive = self._settings.noninteractive
        self._context = LaunchContext(argv=argv, noninteractive=noninteractive, host=self._host)
        self._context.launch_configurations.update(self._source.launch_configurations)
        self._context._event_queue.wake = self._wake.set
        self._context.register_event_handler(OnIncludeLaunchDescription())
        self._context.register_event_handler(OnShutdown(on_shutdown=lambda *_: self._enter_shutdown()))
        self._context.emit_event_sync(IncludeLaunchDescription(self.description()))

    def description(self) -> Any:
        """Return what is launched: the file, as ``ros2 launch`` includes it."""
        return top_description(self._source.launch_file, self._source.arguments)

    async def _turn(self) -> None:
        """Handle one event, or wait for something to happen. Raises ``_Over`` when there is nothing more."""
        queue = self._context._event_queue
        if not queue.empty():
            self._end_of_endless_events()
            if self._settings.debug:
                name = getattr(queue.next, "process_name", None)
                self.say("DEBUG", f"processing event: {queue.next.name}{f' of {name}' if name else ''}")
            with ENVIRONMENT_SWITCH.active(self._environment):
                self._futures += [future for _, future in handle_next(self._context, lambda *_: None)]
            await asyncio.sleep(0)
            return
        pending = self._pending()
        if not pending and self._shutting_down:
            raise _Over
        if not pending and self.shutdown_when_idle:
            self.shut_down("idle")
            return
        await self._wait_for(pending)

    def _end_of_endless_events(self) -> None:
        """Raise ``_Over`` at the limit of events after all processes: one may emit itself."""
        if not self._shutting_down or self._pending():
            return
        self._last_events += 1
        if self._last_events > _MOST_LAST_EVENTS:
            self.say(
                "WARNING", f"{_MOST_LAST_EVENTS} events after the end of all processes led to more: left out"
            )
            raise _Over

    def _pending(self) -> list[asyncio.Future[Any]]:
        self._futures += self._context._completion_futures
        self._context._completion_futures = []
        done = [future for future in self._futures if future.done()]
        self._futures = [future for future in self._futures if not future.done()]
        for future in done:
            if not future.cancelled() and future.exception() is not None:
                raise future.exception() or RuntimeError()
        return self._futures

    async def _wait_for(self, pending: Sequence[asyncio.Future[Any]]) -> None:
        self._wake.clear()
        if not self._context._event_queue.empty():
            return
        waker = asyncio.ensure_future(self._wake.wait())
        try:
            await asyncio.wait([waker, *pending], return_when=asyncio.FIRST_COMPLETED)
        finally:
            waker.cancel()

    def _enter_shutdown(self) -> None:
        self._shutting_down = True
        self._context._set_is_shutdown(True)
        if self._services is not None:
            self._services.abandon()

    def _on_error(self, error: BaseException) -> None:
        self._failed = True
        file = self._source.launch_file
        reported = error if isinstance(error, EnclaveLaunchError) else launch_file_error(error, file)
        message = f"Caught exception in launch (see debug for traceback): {reported}"
        if self._settings.debug:
            self.say("DEBUG", "".join(traceback.format_exception(error)))
        self.say("ERROR", message)
        self._observe(LaunchFailed(message))
        self.shut_down(message)

    def _on_failure(self, error: EnclaveLaunchError) -> None:
        """End the launch: a process could not be secured, so nothing that depends on it is started."""
        self._failed = True
        self.say("CRITICAL", str(error))
        self._observe(LaunchFailed(str(error)))
        self.shut_down(str(error))

    def _exit_status(self) -> int:
        if self._host.failed:
            self.say("ERROR", f"failed on their own: {', '.join(self._host.failed)}")
        return 1 if self._failed or self._host.failed else 0

    def services(self) -> RosServices | None:
        """Make the services when requested, None for a launch that needs none; raises RuntimeFailure without rclpy."""
        if self._services is None and self._needs_ros_services is not False:
            self._services = RosServices(self._gate.launcher() if self._gate else None, self.say)
        return self._services

    def _close_services(self) -> None:
        if self._services is not None:
            self._services.close()

    def _open_log(self, tree: ProcessTree) -> LaunchLog:
        base = Path(log_base_directory(os.environ))
        directory = make_log_directory(base, datetime.now(), socket.gethostname(), os.getpid())
        pressure = BackPressure(tree)
        writers = Writers(
            screen=SinkWriter(pressure.on_screen_full, pressure.on_screen_drained),
            files=SinkWriter(pressure.on_files_full, pressure.on_files_drained),
        )
        screen = ScreenSink(sys.stdout)
        debug, limit = self._settings.debug, self._settings.log_limit
        log = LaunchLog(directory, screen, writers, os.environ, debug, limit)
        pressure.attach(log)
        return log


class DescribedLaunch(LiveLaunch):
    """A launch of a description that a program made, in the place of a file."""

    def __init__(self, description: Any, noninteractive: bool, debug: bool) -> None:
        super().__init__(LaunchSource("<script>"), RunSettings(noninteractive=noninteractive, debug=debug))
        self._description = description

    def description(self) -> Any:
        return self._description


class _Over(Exception):
    """Nothing is left to wait for."""


def require_signals() -> None:
    """Raise RuntimeFailure unless this is the main thread, which takes the signals, without an event loop."""
    if threading.current_thread() is not threading.main_thread():
        raise RuntimeFailure(
            "run() and run_unsecured() take the signals of the process, which only its main thread can; "
            "in another thread use asyncio.run(run_async(...)), or run_async_unsecured(...)"
        )
    if asyncio._get_running_loop() is not None:
        raise RuntimeFailure(
            "run() and run_unsecured() would block the event loop that is running here; "
            "await run_async(...), or run_async_unsecured(...)"
        )


@contextmanager
def signals_to(on_signal: Callable[[Signals], None]) -> Iterator[None]:
    """Call ``on_signal`` for the signals that end a launch; for SIGHUP unless it is ignored (nohup)."""
    loop = asyncio.get_running_loop()
    ignored = {SIGHUP} if getsignal(SIGHUP) is SIG_IGN else set()
    numbers = [number for number in (SIGINT, SIGTERM, SIGQUIT, SIGHUP) if number not in ignored]
    for number in numbers:
        loop.add_signal_handler(number, on_signal, number)
    try:
        yield
    finally:
        for number in numbers:
            loop.remove_signal_handler(number)
