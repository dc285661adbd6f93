"""The warden as a running process, and our end of its socket. Starts it; ``process_tree`` talks to it.

Apart from the tree and without ``asyncio``, so that it starts up while the launcher still imports that.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

from enclave_launch.errors import RuntimeFailure


class WardenProcess:
    """Started when made. Leaving it as a context, or closing ``connection``, ends it and all it started.

    :raises RuntimeFailure: it cannot be started.
    """

    def __init__(self) -> None:
        _occupy_standard_descriptors()
        self.connection, theirs = socket.socketpair()
        with theirs:
            os.set_inheritable(theirs.fileno(), True)
            try:
                self.process = subprocess.Popen(
                    [sys.executable, "-I", "-S", _script(), str(theirs.fileno())],
                    pass_fds=[theirs.fileno()],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    start_new_session=True,
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


def _occupy_standard_descriptors() -> None:
    """Where we were started with one of 0, 1, 2 closed: what we open must not end up there, and be printed into."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(descriptor)


def _script() -> str:
    return str(Path(__file__).with_name("warden.py"))
