"""Write files of a keystore as a tar archive: the same files give the same bytes. Archives are never read here."""

from __future__ import annotations

import gzip
import io
import os
import tarfile
from collections.abc import Iterator, Mapping

from keystore.disk.store import Content, Link


def archive_bytes(files: Mapping[str, Content | Link], *, compressed: bool = False) -> bytes:
    """Return ``files`` (path -> content) as a tar archive: sorted, without times and owners."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.GNU_FORMAT) as archive:
        for directory in sorted({parent for path in files for parent in parents(path)}):
            archive.addfile(_entry(directory, 0o755, tarfile.DIRTYPE))
        for path, file in sorted(files.items()):
            if isinstance(file, Link):
                entry = _entry(path, 0o777, tarfile.SYMTYPE)
                entry.linkname = file.target
                archive.addfile(entry)
            else:
                entry = _entry(path, file.mode, tarfile.REGTYPE)
                entry.size = len(file.data)
                archive.addfile(entry, io.BytesIO(file.data))
    return gzip.compress(buffer.getvalue(), mtime=0) if compressed else buffer.getvalue()


def parents(path: str) -> Iterator[str]:
    """Yield the directories above a relative path, the innermost first."""
    while path := os.path.dirname(path):
        yield path


def _entry(path: str, mode: int, kind: bytes) -> tarfile.TarInfo:
    entry = tarfile.TarInfo(path)
    entry.mode, entry.type = mode, kind
    return entry
