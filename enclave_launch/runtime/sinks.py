"""Sinks of lines: the screen and files, each written by a thread of its own, so that a stopped terminal holds up
neither the robot nor its logs.

``SinkWriter.write`` only queues. Above ``HIGH_WATER`` queued bytes it says so (``on_full``) and below ``LOW_WATER``
again; who writes then waits or leaves out, so memory stays bounded and the event loop never waits for a reader.
Touches the world: writes.
"""

from __future__ import annotations

import os
import select
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TextIO

HIGH_WATER = 8 << 20  # bytes
LOW_WATER = 2 << 20
FLUSH_TIMEOUT = 5.0  # seconds that a blocked screen may hold up our end


class Sink(Protocol):
    """The destination of what a ``SinkWriter`` queues."""

    def write(self, data: bytes) -> None:
        """Write all of ``data``, in the writer's thread. Failures disable the sink; none reaches a process."""


class ScreenSink:
    """Our own standard output; None where it is closed. A reader that went away costs the screen, not the robot."""

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream
        self._gone = stream is None
        self._descriptor = _descriptor_of(stream)

    def write(self, data: bytes) -> None:
        if self._gone or self._stream is None:
            return
        try:
            if self._descriptor is None:
                self._stream.write(data.decode(errors="replace"))
                self._stream.flush()
            else:
                _write_all(self._descriptor, data)
        except (OSError, ValueError):
            self._gone = True


class FileSink:
    """Appends to a file, opened on first use and again after something (logrotate) moved it away.

    ``report`` gets one line when it cannot be written and one when it can again. At ``limit`` bytes the file becomes
    ``<name>.1``, in place of an older one, and a new one is begun; ``None``: no limit.
    """

    def __init__(
        self, path: Path, report: Callable[[str], None] = lambda text: None, limit: int | None = None
    ) -> None:
        self.path = path
        self._report = report
        self._limit = limit
        self._descriptor = -1
        self._identity: tuple[int, int] | None = None
        self._broken = False

    def write(self, data: bytes) -> None:
        try:
            self._reopen_if_moved()
            if self._limit is None:
                _write_all(self._descriptor, data)
            else:
                self._write_below(self._limit, data)
        except OSError as error:  # a full disk must not end the launch
            if not self._broken:
                lost = "output for it is lost until it can be written"
                self._report(f"cannot write {self.path}: {error.strerror}; {lost}")
            self._broken = True
            return
        if self._broken:
            self._report(f"{self.path} can be written again; output in between is missing")
        self._broken = False

    def close(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor, self._identity = -1, None

    def _write_below(self, limit: int, data: bytes) -> None:
        """Write ``data`` cut between lines at the size limit; only a single line may exceed it."""
        start = 0
        while start < len(data):
            present = os.fstat(self._descriptor).st_size
            end = start + limit - present
            if end < len(data):
                end = data.rfind(b"\n", start, max(start, end)) + 1
            if end <= start and present:
                self.path.replace(self.path.with_name(f"{self.path.name}.1"))
                self._reopen_if_moved()
                continue
            if end <= start:
                end = data.find(b"\n", start) + 1 or len(data)
            _write_all(self._descriptor, data[start:end])
            start = end

    def _reopen_if_moved(self) -> None:
        try:
            status = os.stat(self.path)
            present: tuple[int, int] | None = (status.st_dev, status.st_ino)
        except FileNotFoundError:
            present = None
        if present is not None and present == self._identity:
            return
        self.close()
        self._descriptor = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o644)
        status = os.fstat(self._descriptor)
        self._identity = (status.st_dev, status.st_ino)


class SinkWriter:
    """One thread and its queue. ``on_full`` is called in the caller's thread, ``on_drained`` in the writer's."""

    def __init__(self, on_full: Callable[[], None], on_drained: Callable[[], None]) -> None:
        self._on_full, self._on_drained = on_full, on_drained
        self._queue: list[tuple[Sink, bytes]] = []
        self._pending = 0  # bytes queued and not yet written
        self._full = False
        self._stopping = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="sink-writer", daemon=True)
        self._thread.start()

    def write(self, sink: Sink, data: bytes) -> None:
        with self._changed:
            self._queue.append((sink, data))
            self._pending += len(data)
            became_full = not self._full and self._pending > HIGH_WATER
            self._full |= became_full
            self._changed.notify()
        if became_full:
            self._on_full()

    @property
    def full(self) -> bool:
        return self._full

    def close(self) -> None:
        """Write what is queued, at most for ``FLUSH_TIMEOUT``: a terminal stopped with Ctrl-S must not hold us."""
        with self._changed:
            self._stopping = True
            self._changed.notify()
        self._thread.join(FLUSH_TIMEOUT)

    def _run(self) -> None:
        while batch := self._next_batch():
            for sink, data in _merged(batch):
                sink.write(data)
                self._written(len(data))

    def _next_batch(self) -> list[tuple[Sink, bytes]]:
        with self._changed:
            while not self._queue and not self._stopping:
                self._changed.wait()
            batch, self._queue = self._queue, []
            return batch

    def _written(self, count: int) -> None:
        with self._changed:
            self._pending -= count
            drained = self._full and self._pending < LOW_WATER
            self._full &= not drained
        if drained:
            self._on_drained()


def _merged(batch: list[tuple[Sink, bytes]]) -> list[tuple[Sink, bytes]]:
    """Merge neighbours that go to the same sink, in order of first appearance; order within a sink is kept."""
    pieces: dict[Sink, list[bytes]] = {}
    for sink, data in batch:
        pieces.setdefault(sink, []).append(data)
    return [(sink, b"".join(parts)) for sink, parts in pieces.items()]


def _descriptor_of(stream: TextIO | None) -> int | None:
    if stream is None:
        return None
    try:
        stream.flush()
        return stream.fileno()
    except (OSError, ValueError):
        return None


def _write_all(descriptor: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        try:
            view = view[os.write(descriptor, view) :]
        except BlockingIOError:  # another program made our standard output non-blocking
            select.select([], [descriptor], [], 1.0)
