"""One writer at a time: an flock on ``<keystore>/.lock``, which the kernel drops when its holder dies.

The file stays; removing it would let two runs lock two different files. It holds who is working, for the
message of those who wait in vain.
"""

from __future__ import annotations

import fcntl
import os
import shlex
import socket
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from enclave_common.terminal import quoted
from keystore.disk import layout
from keystore.errors import KeystoreBusyError, StorageError, UnsafeKeystoreError, storage_errors
from keystore.formats.validity import iso, utc_now

DEFAULT_TIMEOUT = 30.0
_POLL = 0.02


@contextmanager
def exclusive(root: Path, timeout: float = DEFAULT_TIMEOUT) -> Iterator[None]:
    """Hold the lock of ``root``; raises KeystoreBusyError after ``timeout`` seconds, StorageError where none can be."""
    deadline = time.monotonic() + timeout
    while (descriptor := _locked(root, timeout, deadline)) is None:
        continue
    try:
        _sign_in(descriptor)
        yield
    finally:
        os.close(descriptor)


def _locked(root: Path, timeout: float, deadline: float) -> int | None:
    """Return the locked descriptor; None if the file was removed or replaced meanwhile, so that others lock it."""
    path = root / layout.LOCK
    with storage_errors("locking the keystore"):
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    try:
        _refuse_strange(path, os.fstat(descriptor))
        _wait(descriptor, root, timeout, deadline)
        if _is_in_place(path, descriptor):
            kept, descriptor = descriptor, -1
            return kept
        return None
    finally:
        if descriptor >= 0:
            os.close(descriptor)


def _refuse_strange(path: Path, info: os.stat_result) -> None:
    """Refuse a hard link: we write in the file, and it would be another file of ours."""
    if not stat.S_ISREG(info.st_mode) or info.st_nlink > 1:
        raise UnsafeKeystoreError(
            f"{quoted(path)} is not a file of its own, but a device or a hard link; "
            f"remove it: rm {shlex.quote(str(path))}"
        )


def _is_in_place(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(os.lstat(path), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _wait(descriptor: int, root: Path, timeout: float, deadline: float) -> None:
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() >= deadline:
                raise _busy(descriptor, root, timeout) from None
        except OSError as error:
            raise StorageError.of(
                error, "locking the keystore (does its file system support flock?)"
            ) from None
        time.sleep(_POLL)


def _busy(descriptor: int, root: Path, timeout: float) -> KeystoreBusyError:
    holder = os.pread(descriptor, 256, 0).decode("utf-8", "replace").strip() or "another process"
    return KeystoreBusyError(
        f"{quoted(root)} is in use by {quoted(holder)}; waited {timeout:g} s. Try again when it is done"
    )


def _sign_in(descriptor: int) -> None:
    """Write the program's name, never its arguments; best effort: a full disk must not keep anyone from reading."""
    program = os.path.basename(sys.argv[0] if sys.argv else "python")
    text = f"{program} (pid {os.getpid()} on {socket.gethostname()}) since {iso(utc_now())}\n"
    try:
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, text.encode(), 0)
    except OSError:
        return
