"""Write and read files of a keystore as a tar archive: the same files give the same bytes.

An archive from elsewhere may name paths outside, links, devices, one file twice, or never end: only its regular files
are taken, by name, into memory.
"""

from __future__ import annotations

import gzip
import io
import os
import tarfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from enclave_common.files import read_bytes
from keystore.disk.store import Content, Link
from keystore.errors import DamagedKeystoreError, printable, storage_errors

MAX_ARCHIVE = 256_000_000
"""Bytes; some 20 000 enclaves."""
MAX_ENTRY = 8_000_000
"""Bytes of one file, as large as a file of a keystore may be."""


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


def read_bundle(bundle: Path) -> dict[str, bytes]:
    """Return what ``read_archive`` returns, from a file. Raises StorageError, too."""
    with storage_errors("reading the bundle"):
        content = read_bytes(bundle, MAX_ARCHIVE)
    return read_archive(content, printable(bundle))


def read_archive(content: bytes, place: str) -> dict[str, bytes]:
    """Return name -> bytes of each regular file; names and sizes are checked first. Raises DamagedKeystoreError."""
    try:
        with tarfile.open(fileobj=io.BytesIO(content), mode="r:") as archive:
            entries = _plain_files(archive, len(content), place)
    except (tarfile.TarError, EOFError, OSError, ValueError, OverflowError) as error:
        raise DamagedKeystoreError(
            f"{place} is not a bundle, or is cut off ({error}); copy it again"
        ) from None
    return {name: content[one.offset_data : one.offset_data + one.size] for name, one in entries.items()}


def _plain_files(archive: tarfile.TarFile, available: int, place: str) -> dict[str, tarfile.TarInfo]:
    """Return every entry but directories, by name. A sparse file is not plain: a few bytes can stand for any size."""
    found: dict[str, tarfile.TarInfo] = {}
    for entry in archive:
        if entry.isdir():
            continue
        if entry.type not in (tarfile.REGTYPE, tarfile.AREGTYPE) or entry.issparse() or entry.name in found:
            raise DamagedKeystoreError(f"{place}: {entry.name!r} is not a plain file of its own")
        if not 0 <= entry.size <= MAX_ENTRY:
            raise DamagedKeystoreError(f"{place}: {entry.name!r} is larger than {MAX_ENTRY} bytes")
        if entry.offset_data + entry.size > available:
            raise DamagedKeystoreError(f"{place} is cut off within {entry.name!r}; copy it again")
        found[entry.name] = entry
    return found


def parents(path: str) -> Iterator[str]:
    """Yield the directories above a relative path, the innermost first."""
    while path := os.path.dirname(path):
        yield path


def _entry(path: str, mode: int, kind: bytes) -> tarfile.TarInfo:
    entry = tarfile.TarInfo(path)
    entry.mode, entry.type = mode, kind
    return entry
