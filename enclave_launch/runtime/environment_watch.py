"""Check the environment of what really runs, from /proc, and end what is not what was planned.

A program between us and a node (a prefix that was vouched for, a shell, a script's ``#!/usr/bin/env -S -u``) may drop
the variables that lead to the enclave; the node would then join unsecured. So some time after each start, and every
now and then, the process itself must have the variables it was given, and so must each of its descendants that has
loaded a ROS middleware or a DDS. Where /proc does not show an environment (another user, no /proc) nothing is said.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from enclave_common.files import read_bytes
from enclave_launch.runtime.warden import children_by_parent, descendants, proc_is_ours

FIRST_INTERVAL = 0.25  # seconds after a start; then ever rarer
LONGEST_INTERVAL = 15.0
_SPEAKS_DDS = re.compile(rb"/lib(rcl|rmw|ddsc|fastrtps|fastdds|nddsc|zenoh)[-_.\w]*\.so")
_VARIABLE = re.compile(rb"[A-Za-z_][A-Za-z0-9_]*=")


class Watched(NamedTuple):
    """A running process of the launch and the variables that were planned for it."""

    name: str
    pid: int
    planned: Mapping[str, str]


class Unplanned(NamedTuple):
    """A process with another environment than planned. ``pid`` is the process itself or a descendant of it."""

    watched: Watched
    pid: int
    why: str

    def __str__(self) -> str:
        who = "" if self.pid == self.watched.pid else f" (its descendant with pid {self.pid})"
        return (
            f"{self.watched.name}{who} does not run with the environment that was planned: {self.why}; it was "
            "stopped, since it would not be secured. Something between launch and the program changes it"
        )


def unplanned(watched: Watched, children: Mapping[int, set[int]]) -> Iterator[Unplanned]:
    """Yield those of a process and its descendants that run with other variables than planned."""
    for pid in (watched.pid, *descendants(watched.pid, children)):
        if pid == watched.pid or _speaks_dds(pid):
            environment = environment_of(pid)
            why = None if environment is None else _difference(environment, watched.planned)
            if why is not None:
                yield Unplanned(watched, pid, why)


def environment_of(pid: int) -> dict[str, str] | None:
    """Return the environment that ``pid`` was started with; None if /proc does not show it."""
    if not proc_is_ours():
        return None
    try:
        entries = [entry for entry in read_bytes(f"/proc/{pid}/environ").split(b"\0") if entry]
    except OSError:
        return None
    if not all(_VARIABLE.match(entry) for entry in entries):
        return None
    pairs = (os.fsdecode(entry).partition("=") for entry in entries)
    return {name: value for name, _, value in pairs}


class EnvironmentWatch:
    """Checks the environment of running processes from time to time. ``running`` returns the processes that run;
    ``ended`` is called with each that had to be killed."""

    def __init__(self, running: Callable[[], list[Watched]], ended: Callable[[Unplanned], None]) -> None:
        self._running = running
        self._ended = ended
        self._started = asyncio.Event()

    def process_started(self) -> None:
        """Check soon."""
        self._started.set()

    async def run(self) -> None:
        """Run until cancelled."""
        pause = LONGEST_INTERVAL
        while True:
            # Not wait_for: until Python 3.12 it loses a cancellation that comes together with what it waits for.
            started = asyncio.ensure_future(self._started.wait())
            try:
                await asyncio.wait({started}, timeout=pause)
            finally:
                started.cancel()
            if self._started.is_set():
                self._started.clear()
                pause = FIRST_INTERVAL
                await asyncio.sleep(pause)
            self.check()
            pause = min(2 * pause, LONGEST_INTERVAL)

    def check(self) -> None:
        watched = self._running()
        if not watched:
            return
        children = children_by_parent()
        for process in watched:
            for found in unplanned(process, children):
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.kill(found.pid, signal.SIGKILL)
                    self._ended(found)


def _speaks_dds(pid: int) -> bool:
    try:
        return _SPEAKS_DDS.search(read_bytes(f"/proc/{pid}/maps")) is not None
    except OSError:
        return False


def _difference(environment: Mapping[str, str], planned: Mapping[str, str]) -> str | None:
    for name, value in planned.items():
        if name not in environment:
            return f"{name} is not set"
        if environment[name] != value:
            return f"{name} is {environment[name]!r}, not {value!r}"
    return None
