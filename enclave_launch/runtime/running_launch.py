"""A launch that runs beside the program that started it: inspected, waited for and stopped from there.

    with start(provision(plan, "keystore")) as launch:
        launch.wait_until(printed("talker-1", "ready"), timeout=10)
        print(launch.processes["talker-1"].pid)
    print(launch.wait())

The launch lives in a thread with an event loop of its own; everything here may be called from any other thread.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable, Coroutine, Iterator, Mapping
from types import MappingProxyType, TracebackType
from typing import Any, Literal, NamedTuple

from enclave_launch.errors import RuntimeFailure
from enclave_launch.process import ResolvedProcess
from enclave_launch.runtime.live_launch import LiveLaunch
from enclave_launch.runtime.run_events import (
    EndpointCreated,
    EndpointRequested,
    LaunchStarted,
    Observer,
    ProcessExited,
    ProcessOutput,
    ProcessOver,
    ProcessPlanned,
    ProcessStarted,
    RunEvent,
)
from nodl.node_interface import EndpointKind

REMEMBERED_EVENTS = 10_000
REMEMBERED_OUTPUT = 8 << 20  # bytes of output among them
TAIL = 64 << 10  # bytes of output that each process has in memory

State = Literal["waiting", "running", "ended"]


class RunningProcess(NamedTuple):
    """One process as it is now.

    ``state``: ``waiting`` for its start or the next one, ``running``, or ``ended`` for good; ``pid`` and ``returncode``
    of its latest life; ``starts`` counts its lives; ``output`` is the end of what it wrote, both streams; ``endpoints``
    are those that its nodes made in its latest life, if the launch is recorded.
    """

    process: ResolvedProcess
    state: State = "waiting"
    pid: int | None = None
    returncode: int | None = None
    starts: int = 0
    failed: bool = False
    output: bytes = b""
    endpoints: tuple[EndpointRequested, ...] = ()

    @property
    def name(self) -> str:
        """Return the name, unique within the launch: ``talker-1``."""
        return self.process.process_name


Condition = Callable[["RunningLaunch"], bool]


def started(name: str) -> Condition:
    """Return a condition that holds once the process ``name`` (``talker-1``) was started."""
    return lambda launch: name in launch.processes and launch.processes[name].starts > 0


def printed(name: str, text: str = "") -> Condition:
    """Return a condition that holds once the process ``name`` wrote ``text``, or anything if it is empty."""
    wanted = text.encode()

    def holds(launch: RunningLaunch) -> bool:
        process = launch.processes.get(name)
        return process is not None and bool(process.output) and wanted in process.output

    return holds


def endpoint_seen(name: str, endpoint: str, *, kind: EndpointKind | None = None, node: str = "") -> Condition:
    """Return a condition that holds while a node of the process ``name`` has ``endpoint``, a final name.

    ``kind`` and ``node`` (a fully qualified name) narrow it. The condition raises ``RuntimeFailure`` if the launch is
    not recorded.
    """

    def holds(launch: RunningLaunch) -> bool:
        if not launch.is_recorded:
            raise RuntimeFailure(
                f"cannot know whether {name} has {endpoint}: this launch is not recorded; start it with "
                "RunSettings(record=True)"
            )
        process = launch.processes.get(name)
        return process is not None and any(
            each.name == endpoint and kind in (None, each.kind) and node in ("", each.node)
            for each in process.endpoints
        )

    return holds


# Runs a launch to its end, with who watches it and who gets its service; gives the exit status.
Main = Callable[[Observer, Callable[[LiveLaunch], None]], Coroutine[Any, Any, int]]


class RunningLaunch:
    """Made by ``enclave_launch.start``. As a context manager it is stopped at the end of the block."""

    def __init__(self, main: Main) -> None:
        """Start the launch; raises RuntimeFailure as ``run``."""
        self._changed = threading.Condition()
        self._processes: dict[str, RunningProcess] = {}
        self._events: deque[RunEvent] = deque()
        self._first = 0  # number of the oldest event that is remembered
        self._output_remembered = 0  # bytes
        self._recorded = False
        self._version = 0  # rises with each change
        self._exit_status: int | None = None
        self._error: BaseException | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._service: LiveLaunch | None = None
        self._thread = threading.Thread(target=self._run, args=(main,), name="launch", daemon=True)
        self._thread.start()
        with self._changed:
            self._changed.wait_for(lambda: self._events or self._is_over)
        if self._error is not None:
            raise self._error

    @property
    def processes(self) -> Mapping[str, RunningProcess]:
        """Return a snapshot of the processes by name, in the order in which the launch came to them."""
        with self._changed:
            return MappingProxyType(dict(self._processes))

    @property
    def exit_status(self) -> int | None:
        """Return the exit status as ``run`` does, None while the launch runs."""
        return self._exit_status

    @property
    def is_recorded(self) -> bool:
        """Return True if endpoints are reported as they are made (``RunSettings.record``)."""
        return self._recorded

    @property
    def warden_pid(self) -> int | None:
        """Return the pid of the parent of all other processes of this launch; None before it runs."""
        return self._service.warden_pid if self._service is not None else None

    def wait(self, timeout: float | None = None) -> int:
        """Wait until all has ended; return the exit status. Raises TimeoutError; the launch goes on."""
        self._wait_for(lambda: self._is_over, timeout, "the launch has not ended")
        self._thread.join()
        if self._error is not None:
            raise self._error
        assert self._exit_status is not None
        return self._exit_status

    def wait_until(self, condition: Condition, timeout: float | None = None) -> None:
        """Wait until ``condition(self)`` holds, such as ``started(...)``; it is evaluated at each event.

        Raises TimeoutError, and RuntimeFailure if the launch ended before."""
        self._wait_for(lambda: condition(self) or self._is_over, timeout, "the condition does not hold")
        if not condition(self):
            raise RuntimeFailure(
                f"the launch ended (exit status {self._exit_status}) before the condition held"
            )

    def events(self) -> Iterator[RunEvent]:
        """Yield every event from the first one on, as they happen; the last is ``LaunchOver``.

        The last 10,000 events and 8 MiB of output are remembered: a reader that comes late, or is slower than
        that, misses the older ones."""
        number = 0
        while True:
            with self._changed:
                self._changed.wait_for(lambda: number < self._first + len(self._events) or self._is_over)  # noqa: B023
                number = max(number, self._first)
                if number == self._first + len(self._events):
                    return
                event = self._events[number - self._first]
            number += 1
            yield event

    def stop(
        self, reason: str = "stopped by the program that started it", timeout: float | None = None
    ) -> int:
        """End every process (SIGINT, SIGTERM, SIGKILL), wait, return the exit status; raises TimeoutError."""
        if self._loop is not None and self._service is not None and not self._is_over:
            with contextlib.suppress(RuntimeError):  # its loop was closed meanwhile: it is over
                self._loop.call_soon_threadsafe(self._service.shut_down, reason)
        return self.wait(timeout)

    def __enter__(self) -> RunningLaunch:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def _is_over(self) -> bool:
        return self._exit_status is not None or self._error is not None

    def _run(self, main: Main) -> None:
        status, error = None, None
        try:
            status = asyncio.run(main(self._observe, self._hold))
        except BaseException as raised:  # to be raised in the thread that waits
            error = raised
        with self._changed:
            self._exit_status, self._error = status, error
            self._version += 1
            self._changed.notify_all()

    def _hold(self, service: LiveLaunch) -> None:
        self._loop, self._service = asyncio.get_running_loop(), service

    def _observe(self, event: RunEvent) -> None:
        with self._changed:
            self._remember(event)
            self._follow(event)
            self._version += 1
            self._changed.notify_all()

    def _remember(self, event: RunEvent) -> None:
        self._events.append(event)
        self._output_remembered += _output_of(event)
        while len(self._events) > REMEMBERED_EVENTS or self._output_remembered > REMEMBERED_OUTPUT:
            self._output_remembered -= _output_of(self._events.popleft())
            self._first += 1

    def _follow(self, event: RunEvent) -> None:
        if isinstance(event, ProcessPlanned):
            self._processes[event.process.process_name] = RunningProcess(event.process)
        elif isinstance(event, LaunchStarted):
            self._recorded = event.recorded
        elif isinstance(event, (ProcessStarted, ProcessOutput, ProcessExited, ProcessOver, EndpointCreated)):
            self._processes[event.name] = _after(self._processes[event.name], event)

    def _wait_for(self, condition: Callable[[], bool], timeout: float | None, what: str) -> None:
        # Evaluated without the lock: it may do anything, such as resolve another launch file.
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            seen = self._version
            if condition():
                return
            left = None if deadline is None else deadline - time.monotonic()
            with self._changed:
                if not self._changed.wait_for(lambda: self._version != seen, left):  # noqa: B023
                    raise TimeoutError(f"{what} after {timeout:g} s")


def _output_of(event: RunEvent) -> int:
    return len(event.data) if isinstance(event, ProcessOutput) else 0


def _after(
    process: RunningProcess,
    event: ProcessStarted | ProcessOutput | ProcessExited | ProcessOver | EndpointCreated,
) -> RunningProcess:
    if isinstance(event, ProcessStarted):
        return process._replace(
            state="running", pid=event.pid, returncode=None, starts=process.starts + 1, endpoints=()
        )
    if isinstance(event, EndpointCreated):
        late = event.pid != process.pid  # of a life that is over
        return process if late else process._replace(endpoints=(*process.endpoints, event.endpoint))
    if isinstance(event, ProcessOutput):
        return process._replace(output=(process.output + event.data)[-TAIL:])
    if isinstance(event, ProcessExited):
        return process._replace(state="waiting", returncode=event.returncode)
    return process._replace(state="ended", failed=event.failed)
