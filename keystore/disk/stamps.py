"""Whether files are still the ones that were looked at: inode, size and change time of each, as git's index does it."""

from __future__ import annotations

import os

from keystore.disk import layout
from keystore.formats.enclave_name import segments, validate_enclave_name

FileStamp = tuple[int, int, int]
Stamp = tuple[FileStamp | None, ...]
"""Of several files in a fixed order: what any change to one changes. Nobody can set the change time back."""

_OF_AN_ENCLAVE = sorted(layout.ENCLAVE_FILES)


def enclave_stamp(root: str, enclave: str) -> Stamp:
    """All that provisioning looks at in an enclave, links followed; None for what is not there. Of the directories
    on the way only which they are: others may come and go in them."""
    path = f"{root}/{layout.ENCLAVES}"
    stamps: list[FileStamp | None] = []
    for part in segments(validate_enclave_name(enclave)):
        path = f"{path}/{part}"
        stamps.append(_directory_stamp(path))
    stamps += [file_stamp(f"{path}/{name}") for name in _OF_AN_ENCLAVE]
    return tuple(stamps)


def _directory_stamp(path: str) -> FileStamp | None:
    """A link that leads to the same directory is something else."""
    try:
        return os.lstat(path).st_ino, 0, 0
    except OSError:
        return None


def file_stamp(path: str) -> FileStamp | None:
    try:
        status = os.stat(path)
    except OSError:
        return None
    return status.st_ino, status.st_size, status.st_ctime_ns
