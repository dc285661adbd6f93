"""Our end of the socket to the warden: framed messages out, with descriptors, and in. Never blocks the event loop."""

from __future__ import annotations

import array
import asyncio
import marshal
import os
import socket
from collections import deque
from collections.abc import Callable, Sequence

from enclave_launch.runtime.warden import HEADER

CHUNK = 1 << 16
Message = str | int | bytes | list[bytes] | dict[bytes, bytes]


class WardenChannel:
    """``on_message`` gets (kind, id, rest); ``on_lost`` is called once, when the other end is gone."""

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
