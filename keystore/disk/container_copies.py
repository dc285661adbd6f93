"""Enclaves of an imported keystore once more, each a directory that stands alone: what a container mounts.

The directory of an enclave also holds those below it, and links that end outside of a mount. The key belongs to the
container's user; everything else stays the importer's.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout, safe_files
from keystore.disk.store import Content
from keystore.errors import storage_errors
from keystore.formats.enclave_name import from_flat_name


class ContainerUser(NamedTuple):
    """The user of the containers."""

    uid: int
    gid: int


def container_entries(enclaves: Iterable[str], entries: Mapping[str, object]) -> dict[str, Content]:
    """Return the copies of ``enclaves`` among ``entries``, the files of a keystore."""
    found = {}
    for enclave in enclaves:
        for name in (*layout.RUNTIME_FILES, layout.KEY_URI, layout.ENCLAVE_CRL):
            source = entries.get(layout.source_of(enclave, name))
            if isinstance(source, Content):
                found[f"{layout.container_directory(enclave)}/{name}"] = source
    return found


def container_owner(root: Path) -> ContainerUser | None:
    """Return whom the copies in ``root`` belong to, None if there are none."""
    for key in sorted(root.glob(f"{layout.CONTAINERS}/*/{layout.KEY}")):
        info = os.lstat(key)
        return ContainerUser(info.st_uid, info.st_gid)
    return None


def give_to(root: Path, owner: ContainerUser) -> None:
    """Give the keys among the copies to ``owner``. Raises StorageError if this user may not."""
    for key in root.glob(f"{layout.CONTAINERS}/*/{layout.KEY}"):
        with storage_errors(f"giving keys to {owner.uid}:{owner.gid}"):
            os.chown(key, owner.uid, owner.gid, follow_symlinks=False)


def differing_copies(root: Path) -> Iterator[tuple[str, str]]:
    """Yield each copy that is not as the keystore has it, and what is wrong with it."""
    owner = container_owner(root)
    for path in sorted(root.glob(f"{layout.CONTAINERS}/*/*")):
        relative = path.relative_to(root).as_posix()
        enclave, info = from_flat_name(path.parent.name), os.lstat(path)
        content = safe_files.read_if_there(root, layout.source_of(enclave, path.name)) if enclave else None
        if content is None or not path.is_file() or path.is_symlink():
            yield relative, "is not a copy of a file of an enclave"
        elif not os.access(path, os.R_OK) or path.read_bytes() != content:
            yield relative, "is not the enclave's file"
        elif path.name == layout.KEY and (
            info.st_mode & 0o077 or ContainerUser(info.st_uid, info.st_gid) != owner
        ):
            yield relative, "can be read by others than the containers' user"
        elif path.name != layout.KEY and (info.st_mode & 0o022 or info.st_uid not in (0, os.geteuid())):
            yield relative, "can be written by others"
