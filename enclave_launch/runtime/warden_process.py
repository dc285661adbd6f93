"""The warden as a running process, and our end of its socket. Starts it; ``process_tree`` talks to it."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from enclave_launch.errors import RuntimeFailure


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
