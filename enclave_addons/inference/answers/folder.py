"""The folder that keeps answers: ``$XDG_CACHE_HOME/enclave-launch/inferred`` or ``~/.cache/enclave-launch/inferred``.

An entry is a file, written whole or not at all, with a checksum in its first line. Folders and files that are not ours
alone to write are not believed. Digests are SHA-256. Reads and writes files.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile

from enclave_common.files import read_bytes

_LIMIT = 32 * 2**20  # of one entry
_MOST_ENTRIES = 2_000
_FLAGS = os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK


class CacheFolder:
    """``read`` and ``write`` never raise: without a folder that is safe, and for an empty ``path``, nothing is kept."""

    def __init__(self, path: str | None = None) -> None:
        self._path = _prepared(default_path() if path is None else path)

    def read(self, key: str) -> bytes | None:
        """Return what was written under ``key``; ``None`` for nothing, or for what is damaged or not ours."""
        if self._path is None:
            return None
        try:
            descriptor = os.open(os.path.join(self._path, key), _FLAGS)
        except OSError:
            return None
        with os.fdopen(descriptor, "rb") as stream:
            status = os.fstat(descriptor)
            if not stat.S_ISREG(status.st_mode) or not _is_ours(status) or status.st_size > _LIMIT:
                return None
            checksum, _, content = stream.read().partition(b"\n")
        return content if checksum == digest_of_content(content).encode() else None

    def write(self, key: str, content: bytes) -> None:
        """Keep ``content``; several writers of one key do no harm."""
        if self._path is None or len(content) > _LIMIT:
            return
        try:
            descriptor, temporary = tempfile.mkstemp(dir=self._path, prefix="tmp-")
            with os.fdopen(descriptor, "wb") as stream:
                stream.write(digest_of_content(content).encode() + b"\n" + content)
            os.replace(temporary, os.path.join(self._path, key))
            _make_room(self._path)
        except OSError:
            return


def default_path() -> str | None:
    """Return the folder; ``None`` if there is no home directory."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return os.path.join(base, "enclave-launch", "inferred") if os.path.isabs(base) else None


def _prepared(path: str | None) -> str | None:
    if not path:
        return None
    try:
        os.makedirs(path, mode=0o700, exist_ok=True)
        safe = all(_is_safe_folder(each) for each in (path, os.path.dirname(path)))
    except OSError:
        return None
    return path if safe else None


def _is_safe_folder(path: str) -> bool:
    status = os.lstat(path)
    return stat.S_ISDIR(status.st_mode) and _is_ours(status)


def _is_ours(status: os.stat_result) -> bool:
    return status.st_uid == os.geteuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _make_room(path: str) -> None:
    """Delete the oldest half if there are too many."""
    if len(os.listdir(path)) <= _MOST_ENTRIES:
        return
    with os.scandir(path) as listed:
        entries = [(each.stat(follow_symlinks=False).st_mtime, each.path) for each in listed]
    for _, old in sorted(entries)[: len(entries) // 2]:
        os.unlink(old)


def digest(*parts: object) -> str:
    """Return a digest of anything whose ``repr`` says all of it."""
    return digest_of_content(repr(parts).encode("utf-8", "surrogatepass"))


def digest_of(path: str) -> str:
    """Return a digest of a file's content; of one that cannot be read, that it cannot."""
    try:
        return digest_of_content(read_bytes(path))
    except OSError as error:
        return f"unreadable: {error.errno}"


def digest_of_content(content: bytes) -> str:
    """Return the SHA-256 of bytes, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()
