"""The shares on disk, one file for each enclave in ``private/shares``, and which launches are running.

A running launch holds a lock on a file of its own there, which the kernel drops when the launch dies."""

from __future__ import annotations

import binascii
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.errors import StorageError, UnsafeKeystoreError
from keystore.formats.enclave_name import from_flat_name
from keystore.formats.shares import Share, parse_shares


def read_shares(root: Path, enclave: str) -> tuple[Share, ...]:
    """Read the shares by owner; none for an enclave that no launch requested, and on a host that issues nothing."""
    relative = layout.shares(enclave)
    text = safe_files.read_if_there(root, relative)
    if text is None:
        return ()
    if problem := safe_files.private_problem(f"{root}/{relative}", os.stat(f"{root}/{relative}")):
        raise UnsafeKeystoreError(problem)  # what it asks for would be signed
    return parse_shares(text, quoted(root / relative))


def enclaves_with_shares(root: Path) -> Iterator[str]:
    """Return the sorted names of the enclaves that launches have shares of; raises StorageError if that is not to be
    seen."""
    try:
        names = os.listdir(root / layout.SHARES)
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:
        raise StorageError.of(error, "reading the shares in") from None
    for name in sorted(names):
        enclave = from_flat_name(name.removesuffix(".json"))
        if name.endswith(".json") and enclave is not None:
            yield enclave


class LaunchHold:
    """The hold of a running launch on a keystore. ``owner`` counts as running on this keystore from ``take`` on, while
    this object or the process lives.

    ``enclaves``: those it was given already and may have processes in; from them nothing is taken any more.
    """

    def __init__(self, keystore: Path | str, owner: str):
        self.root = safe_files.resolve_root(keystore)
        self.owner = owner
        self.enclaves: set[str] = set()
        self._descriptor: int | None = None

    @property
    def descriptor(self) -> int | None:
        """Return the descriptor that holds the lock, for a process that acts for this launch; None without one."""
        return self._descriptor

    def adopt(self, descriptor: int) -> None:
        """Take part in the hold of another process, which gave ``descriptor``; closed with this object."""
        self.close()
        self._descriptor = descriptor

    def take(self) -> None:
        """Take the lock unless it is held. Do nothing without a keystore, or if another user owns it."""
        if self._descriptor is None:
            self._descriptor = _open(self.root, self.owner, os.O_RDWR | os.O_CREAT)
            if self._descriptor is not None:
                fcntl.flock(self._descriptor, fcntl.LOCK_SH)

    def is_alone(self) -> bool:
        """Return True if no other process holds the same launch."""
        if self._descriptor is None:
            return not is_running(self.root, self.owner)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        finally:
            fcntl.flock(self._descriptor, fcntl.LOCK_SH)
        return True

    def close(self) -> None:
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def __del__(self) -> None:
        self.close()


def is_running(root: Path, owner: str) -> bool:
    """Return whether a process holds ``owner``; a ``LaunchHold`` of our own counts too."""
    descriptor = _open(root, owner, os.O_RDWR)
    if descriptor is None:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def _open(root: Path, owner: str, flags: int) -> int | None:
    """Open the file; None if there is none and none can be made: a bundle, a keystore that others own."""
    if not os.path.isdir(root / layout.PRIVATE):
        return None
    path = f"{root}/{layout.SHARES}/{binascii.crc32(os.fsencode(owner)):08x}.lock"
    try:
        if flags & os.O_CREAT:
            os.makedirs(os.path.dirname(path), mode=0o700, exist_ok=True)
        return os.open(path, flags | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    except OSError:
        return None
