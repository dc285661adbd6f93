"""One process of the launch over its whole life: started, watched, started again, ended with growing
insistence.

Takes what evaluation decided and a ``ProcessTree``; reports to ``Watcher``, which is the launch's event
queue. Semantics and messages of launch/actions/execute_local.py. Three things are stricter than there: the end
reaches the whole process group, a successor never meets what its predecessor left running, and a process that
ends as soon as it starts, again and again, is started at growing distances.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Mapping
from errno import EMFILE, ENFILE
from signal import SIGINT, SIGKILL, SIGTERM, Signals
from typing import NamedTuple, Protocol

from enclave_launch.runtime.launch_log import Level
from enclave_launch.runtime.process_tree import Child, Hold, ProcessSpec, ProcessTree, Stream

Log = Callable[[Level, str], None]


SHORT_LIFE = 1.0  # seconds
TOLERATED = 5  # short lives in a row that are answered at once, as launch does
LONGEST_PAUSE = 5.0  # seconds


def pause_after(short_lives: int) -> float:
    """Return seconds to wait before the next start after so many lives below ``SHORT_LIFE`` in a row."""
    over = short_lives - TOLERATED
    return 0.0 if over <= 0 else min(LONGEST_PAUSE, 0.1 * 2.0 ** min(over - 1, 10))


def _remedy(error: OSError) -> str:
    if error.errno in (EMFILE, ENFILE):
        return "; each process takes three descriptors of the launcher: raise its limit (ulimit -Hn)"
    return ""


class LifeRules(NamedTuple):
    """Seconds throughout. ``max_retries`` below zero: no limit."""

    respawn: bool = False
    respawn_delay: float = 0.0
    max_retries: int = -1


class Patience(NamedTuple):
    """Seconds from SIGINT to SIGTERM, and from there to SIGKILL."""

    sigterm_timeout: float = 5.0
    sigkill_timeout: float = 5.0


class Watcher(Protocol):
    """Called in the event loop, in the order things happen. ``waits_for``: what may pause the reading of its output."""

    @property
    def waits_for(self) -> Mapping[Stream, frozenset[Hold]]: ...

    def on_started(self, pid: int) -> None: ...

    def on_output(self, stream: Stream, data: bytes) -> None: ...

    def on_exited(self, pid: int, returncode: int) -> None: ...


class ProcessEnd(NamedTuple):
    """The end of the last incarnation. ``returncode`` is None when none could be started."""

    returncode: int | None
    requested_to_end: bool


class SupervisedProcess:
    """One process from its first start to its last exit. ``prepare`` is awaited before every start, so that the
    enclave is complete each time; it gives what to run.

    :raises EnclaveLaunchError: from ``run``, when ``prepare`` refuses.
    """

    def __init__(
        self,
        name: str,
        prepare: Callable[[], Awaitable[ProcessSpec]],
        tree: ProcessTree,
        rules: LifeRules,
        watcher: Watcher,
        log: Log,
    ) -> None:
        self.name = name
        self._prepare = prepare
        self._tree = tree
        self._rules = rules
        self._watcher = watcher
        self._log = log
        self._child: Child | None = None
        self._ending = asyncio.Event()
        self._timers: list[asyncio.TimerHandle] = []
        self._owed: tuple[Patience, bool] | None = None  # an end requested before there was a child

    @property
    def child(self) -> Child | None:
        return self._child

    async def run(self) -> ProcessEnd:
        """Run from the first start to the last exit."""
        retries = short_lives = 0
        clock = asyncio.get_running_loop().time
        try:
            while True:
                began = clock()
                returncode = await self._run_once()
                if returncode is None or not self._may_respawn(retries):
                    break
                short_lives = short_lives + 1 if clock() - began < SHORT_LIFE else 0
                if await self._ending_within(self._delay(short_lives)):
                    break
                self._clear_away()
                retries += 1
            return ProcessEnd(returncode, self._ending.is_set())
        finally:
            self._cancel_timers()

    def end(self, patience: Patience, *, quiet: bool = False) -> None:
        """Send SIGINT now, SIGTERM and SIGKILL if it does not help. ``quiet``: the user pressed Ctrl-C and knows."""
        if self._ending.is_set():
            return
        self._ending.set()
        if self._child is None:
            self._owed = patience, quiet
        else:
            self._begin_escalation(patience, quiet)

    def signal(self, number: Signals, *, quiet: bool = False, whole_group: bool = True) -> None:
        """Send a signal to the process; ``whole_group``: also to what it started."""
        if self._child is None or not self._child.running:
            return
        if not quiet:
            self._log("INFO", f"sending signal '{number.name}' to process[{self.name}]")
        self._child.signal(number, whole_group=whole_group)

    async def _run_once(self) -> int | None:
        if self._ending.is_set():
            return None
        try:
            spec = await self._prepare()
            if self._ending.is_set():
                return None
            child = await self._tree.spawn(spec, self._watcher.on_output, self._watcher.waits_for)
        except OSError as error:
            what = f": {error.filename!r}" if error.filename is not None else ""
            self._log("ERROR", f"cannot start process: {error.strerror}{what}{_remedy(error)}")
            return None
        self._child = child
        self._log("INFO", f"process started with pid [{child.pid}]")
        self._watcher.on_started(child.pid)
        if self._owed is not None:
            self._begin_escalation(*self._owed)
        returncode = await child.wait()
        self._report_exit(child.pid, returncode, spec)
        child.retire()
        return returncode

    def _clear_away(self) -> None:
        """Kill what the previous incarnation left running, before its successor starts."""
        if self._child is not None:
            self._child.sweep()
            self._child.release()
            self._child = None

    def _report_exit(self, pid: int, returncode: int, spec: ProcessSpec) -> None:
        self._cancel_timers()
        if returncode == 0:
            self._log("INFO", f"process has finished cleanly [pid {pid}]")
        else:
            command = " ".join(word for word in spec.cmd if word.strip())
            self._log("ERROR", f"process has died [pid {pid}, exit code {returncode}, cmd '{command}'].")
        self._watcher.on_exited(pid, returncode)

    def _may_respawn(self, retries: int) -> bool:
        limit = self._rules.max_retries
        return self._rules.respawn and (limit < 0 or retries < limit)

    def _delay(self, short_lives: int) -> float:
        pause = pause_after(short_lives)
        if pause <= self._rules.respawn_delay:
            return self._rules.respawn_delay
        self._log(
            "WARNING",
            f"process ended within {SHORT_LIFE:g} s of its start {short_lives} times in a row; "
            f"the next start is in {pause:g} s",
        )
        return pause

    async def _ending_within(self, seconds: float) -> bool:
        if seconds > 0:
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._ending.wait(), seconds)
        return self._ending.is_set()

    def _begin_escalation(self, patience: Patience, quiet: bool) -> None:
        loop = asyncio.get_running_loop()
        first = patience.sigterm_timeout
        both = first + patience.sigkill_timeout
        self.signal(SIGINT, quiet=quiet)
        self._timers = [
            loop.call_later(first, self._escalate, first, SIGINT, SIGTERM),
            loop.call_later(both, self._escalate, both, SIGTERM, SIGKILL),
        ]

    def _escalate(self, seconds: float, sent: Signals, next_signal: Signals) -> None:
        self._log(
            "ERROR",
            f"process[{self.name}] failed to terminate '{seconds:g}' seconds after receiving '{sent.name}', "
            f"escalating to '{next_signal.name}'",
        )
        self.signal(next_signal)

    def _cancel_timers(self) -> None:
        for timer in self._timers:
            timer.cancel()
        self._timers = []
