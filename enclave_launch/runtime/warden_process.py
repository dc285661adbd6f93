"""The warden as a running process, and our end of its socket: framed messages out, with descriptors, and in.

Starts it; ``process_tree`` talks to it. Never blocks the event loop.
"""

from __future__ import annotations

import array
import asyncio
import contextlib
import marshal
import os
import socket
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from enclave_launch.errors import RuntimeFailure
from enclave_launch.runtime.warden import HEADER

CHUNK = 1 << 16
Message = str | int | bytes | list[bytes] | dict[bytes, bytes]


class WardenChannel:
    """Our end of the warden's socket. ``on_message`` gets (kind, id, rest); ``on_lost`` is called once, when the other
    end is gone."""

    def __init__(
        self,
        connection: socket.socket,
        on_message: Callable[[str, int, list[object]], None],
        on_lost: Callable[[], None],
    ) -> None:
        self._socket = connection
        self._on_message, self._on_lost = on_message, on_lost
        self._received = b""
        # Bytes, and the descriptors that go with the first of them.
        self._waiting: deque[tuple[bytes, Sequence[int]]] = deque()
        self._loop: asyncio.AbstractEventLoop | None = None

    def open(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._socket, self._receive)

    def send(self, *message: Message, descriptors: Sequence[int] = ()) -> None:
        """Queue a message; descriptors are closed once they are sent."""
        data = marshal.dumps(message)
        self._waiting.append((HEADER.pack(len(data)) + data, descriptors))
        self._flush()

    def close(self) -> None:
        if self._loop is not None:
            self._loop.remove_reader(self._socket)
            self._loop.remove_writer(self._socket)
            self._loop = None
        while self._waiting:
            _close_all(self._waiting.popleft()[1])
        self._socket.close()

    def _flush(self) -> None:
        while self._waiting and self._loop is not None:
            data, descriptors = self._waiting[0]
            rights = (socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))
            try:
                sent = self._socket.sendmsg([data], [rights] if descriptors else [], socket.MSG_DONTWAIT)
            except BlockingIOError:
                self._loop.add_writer(self._socket, self._flush)
                return
            except OSError:
                self._lose()
                return
            _close_all(descriptors)
            self._waiting.popleft()
            if sent < len(data):
                self._waiting.appendleft((data[sent:], ()))
        if self._loop is not None:
            self._loop.remove_writer(self._socket)

    def _receive(self) -> None:
        try:
            data = self._socket.recv(CHUNK, socket.MSG_DONTWAIT)
        except BlockingIOError:
            return
        except ConnectionError:
            data = b""
        if not data:
            self._lose()
            return
        self._received += data
        while len(self._received) >= HEADER.size:
            end = HEADER.size + HEADER.unpack_from(self._received)[0]
            if len(self._received) < end:
                return
            kind, identifier, *rest = marshal.loads(self._received[HEADER.size : end])
            self._received = self._received[end:]
            self._on_message(kind, identifier, rest)

    def _lose(self) -> None:
        self.close()
        self._on_lost()


def _close_all(descriptors: Sequence[int]) -> None:
    for descriptor in descriptors:
        os.close(descriptor)


class WardenProcess:
    """Started when made. Leaving it as a context, or closing ``connection``, ends it and all it started.

    ``interactive``: its children may use the terminal that this program is in the foreground of, if it has one.

    :raises RuntimeFailure: it cannot be started.
    """

    def __init__(self, *, interactive: bool = False) -> None:
        _occupy_standard_descriptors()
        self.connection, theirs = socket.socketpair()
        with theirs, _terminal(interactive) as terminal:
            script, handed = str(Path(__file__).with_name("warden.py")), [theirs.fileno(), *terminal]
            try:
                self.process = subprocess.Popen(
                    [sys.executable, "-I", "-S", script, *map(str, handed)],
                    pass_fds=handed,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    start_new_session=not terminal,
                    env={},
                )
            except OSError as error:
                self.connection.close()
                raise RuntimeFailure(
                    f"cannot start the warden with {sys.executable!r}: {error.strerror}"
                ) from error

    def __enter__(self) -> WardenProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.connection.close()
        self.process.wait()


@contextlib.contextmanager
def _terminal(interactive: bool) -> Iterator[list[int]]:
    """Yield a descriptor of our controlling terminal if we are interactive and in its foreground."""
    try:
        descriptor = os.open("/dev/tty", os.O_RDWR) if interactive else -1
    except OSError:  # started without one: a service, a test runner
        descriptor = -1
    try:
        in_foreground = descriptor >= 0 and os.tcgetpgrp(descriptor) == os.getpgrp()
        yield [descriptor] if in_foreground else []
    finally:
        if descriptor >= 0:
            os.close(descriptor)


def _occupy_standard_descriptors() -> None:
    """Open those of descriptors 0, 1 and 2 that we were started without, so that nothing else gets their numbers
    and is printed into."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(descriptor)
