"""An imported keystore: versions beside each other, and one link to the version in force.

    /etc/ros/keystore        -> keystore.d/1763774400      what ROS_SECURITY_KEYSTORE names
    /etc/ros/keystore.d/1763774400/                        a whole keystore without private/
    /etc/ros/keystore.d/pending/                           keys made here that wait for their certificates

A version is written aside, made durable, and put in force by one rename of the link: every reader sees
the old one or the new one, whole. What an interrupted run left is never seen, and the next run removes it.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from enclave_common.terminal import quoted
from keystore.disk import layout, lock, safe_files
from keystore.disk.archive import parents
from keystore.disk.store import Content, Link, create_root, sync_path, write_new
from keystore.errors import NotAKeystoreError, storage_errors

PENDING = "pending"
_STAGING = ".staging"
_VERSION = re.compile(r"[0-9]+(\.[0-9]+)?")


class Versions:
    """The imported keystore at ``root``, which is a link or not there yet. Raises NotAKeystoreError otherwise."""

    def __init__(self, root: Path | str):
        given = Path(os.path.abspath(root))
        self.root = Path(os.path.realpath(given.parent)) / given.name
        self.folder = self.root.with_name(f"{self.root.name}.d")
        if os.path.lexists(self.root) and not self._is_ours():
            raise NotAKeystoreError(
                f"{quoted(self.root)} exists and was not imported; choose another place, or move it away "
                "and import with --require-ca"
            )

    @property
    def current(self) -> Path | None:
        """Return the version in force, None before the first import."""
        return self.folder / os.readlink(self.root).rpartition("/")[2] if self.root.is_symlink() else None

    @property
    def pending(self) -> Path:
        """Return the directory of keys that wait for their certificates."""
        return self.folder / PENDING

    @contextmanager
    def opened(self, timeout: float = lock.DEFAULT_TIMEOUT) -> Iterator[None]:
        """Hold the lock of imports and requests; what an interrupted run left is removed first."""
        create_root(self.folder)
        safe_files.refuse_unsafe_directory(self.folder)
        with lock.exclusive(self.folder, timeout):
            self._clear()
            yield

    def stage(self, entries: Mapping[str, Content | Link]) -> Path:
        """Write a version aside and return its place, for ``switch``. Raises StorageError."""
        staging = self.folder / _STAGING
        with storage_errors("writing the bundle's files"):
            write_tree(staging, entries)
        return staging

    def switch(self, number: int) -> None:
        """Put what was staged in force, then delete what was before, unless containers may have mounted it.

        Beside a version with this number, which is being restored, the new one is ``NUMBER.1`` and so on.
        """
        link = self.folder / f"{_STAGING}.link"
        with storage_errors("putting the bundle in force"):
            _sync_tree(self.folder / _STAGING)
            name, repeat = str(number), 0
            while os.path.lexists(self.folder / name):
                repeat += 1
                name = f"{number}.{repeat}"
            os.rename(self.folder / _STAGING, self.folder / name)
            os.symlink(f"{self.folder.name}/{name}", link)
            sync_path(self.folder)
            os.rename(link, self.root)
            sync_path(self.root.parent)
            self._clear()

    def discard(self) -> None:
        """Delete what was staged."""
        shutil.rmtree(self.folder / _STAGING, ignore_errors=True)

    def _is_ours(self) -> bool:
        target = os.readlink(self.root) if self.root.is_symlink() else ""
        folder, _, version = target.partition("/")
        return folder == self.folder.name and _VERSION.fullmatch(version) is not None

    def _clear(self) -> None:
        kept = {PENDING, layout.LOCK, *([self.current.name] if self.current else []), *self._mounted()}
        for name in sorted(set(os.listdir(self.folder)) - kept):
            path = self.folder / name
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                os.unlink(path)

    def _mounted(self) -> list[str]:
        """Return the version before the one in force if it has copies for containers.

        podman mounts the folder that the link named when the container was made; without it a restart fails.
        """
        others = [
            name
            for name in os.listdir(self.folder)
            if _VERSION.fullmatch(name) and self.folder / name != self.current
            and (self.folder / name / layout.CONTAINERS).is_dir()
        ]  # fmt: skip
        return [max(others, key=lambda name: tuple(map(int, name.split("."))))] if others else []


def imported_at(version: Path) -> Path:
    """Return the place where ``version`` was imported, which a command is to be given; another keystore is its own."""
    folder = version.parent
    is_version = folder.name.endswith(".d") and _VERSION.fullmatch(version.name)
    return folder.with_name(folder.name.removesuffix(".d")) if is_version else version


def write_tree(root: Path, entries: Mapping[str, Content | Link], *, durable: bool = False) -> None:
    """Make a new directory with these files, by their paths below it."""
    os.mkdir(root, 0o700)
    os.chmod(root, 0o755)
    for relative, entry in entries.items():
        make_directories(root, relative)
        if isinstance(entry, Link):
            os.symlink(entry.target, root / relative)
        else:
            write_new(root / relative, entry.data, entry.mode, durable=durable)


@contextmanager
def written_aside(target: Path) -> Iterator[Path]:
    """Yield a name beside ``target``; what is made there takes its place at the end, whole or not at all."""
    aside = target.with_name(f".{target.name}.{os.getpid()}.partial")
    aside.unlink(missing_ok=True)
    try:
        yield aside
        os.replace(aside, target)
    finally:
        if aside.is_dir():
            shutil.rmtree(aside)
        aside.unlink(missing_ok=True)


def make_directories(root: Path, relative: str) -> None:
    """Make the missing directories above ``relative``, below ``root``.

    Their modes do not depend on the umask: who can write in a directory can replace the key in it.
    """
    for parent in reversed(list(parents(relative))):
        if not (root / parent).is_dir():
            os.mkdir(root / parent, 0o755)
            os.chmod(root / parent, 0o755)


def _sync_tree(root: Path) -> None:
    for folder, _, files in os.walk(root):
        for name in files:
            if not os.path.islink(os.path.join(folder, name)):
                sync_path(Path(folder, name))
        sync_path(Path(folder))
