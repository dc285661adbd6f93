"""The only writer. Every file appears whole, private ones are born private, and a crash is completable.

    batch.file / batch.directory      written aside, in <keystore>/.staging (mode 0700)
    batch.record                      the register; always takes its place first
    batch.commit                      made durable, then renamed into place in the order they were added

A rename is all that ever changes what others see. The holder of the lock first clears what a dead run left in
the staging area; nothing of it was visible.

Durability: a few files are fsynced one by one. For many, one ``syncfs`` before the renames and one after do
the same for all of them at once: no name ever points at content that is not on disk.
"""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path

from keystore.disk import layout, lock, safe_files
from keystore.disk.register_file import read_register
from keystore.disk.view import KeystoreView
from keystore.errors import StorageError, storage_errors
from keystore.formats.register import Register, register_json

PUBLIC_MODE, PRIVATE_MODE = 0o644, 0o600
_SYNC_EACH = 12
_NO_LINKS = {errno.EPERM, errno.ENOTSUP, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL}


@dataclass(frozen=True, slots=True)
class Content:
    """A file to write: its bytes and its mode."""

    data: bytes = field(repr=False)
    mode: int = PUBLIC_MODE


@dataclass(frozen=True, slots=True)
class Link:
    """A relative link, or a copy of ``source`` (relative to the keystore) on a file system without links."""

    target: str
    source: str


def enclave_links(enclave: str, *, crl: bool) -> dict[str, Link]:
    """Return ``layout.enclave_links``, ready to be written."""
    links = layout.enclave_links(enclave, crl=crl)
    return {name: Link(target, layout.link_source(name)) for name, target in links.items()}


class Store:
    """A keystore directory that this process may change; obtained from ``opened`` only, under the lock."""

    def __init__(self, root: Path, durable: bool):
        self.root = root
        self._durable = durable
        self._checked: set[str] = set()
        present = read_register(root)
        self.has_register = present is not None
        """False on a host that issues nothing, and before the first thing is issued."""
        self.register = present or Register()
        """The certificates and documents issued so far; each ``Batch.record`` replaces it."""
        self._adopted = False
        self.clock: datetime | None = None
        """The time of the machine's clock at the opening, or None if the caller gave the time."""
        self.notes: list[str] = []
        """Changes made to the keystore while opening it, for the report."""

    @contextmanager
    def batch(self) -> Iterator[Batch]:
        """Collect changes that become visible together at the end of the block, or not at all if it raises."""
        batch = Batch(self)
        try:
            yield batch
            if self._adopted and batch.recorded is None:
                batch.record(self.register)
            batch.commit()
            if batch.recorded is not None:
                self.register, self.has_register, self._adopted = batch.recorded, True, False
        except OSError as error:
            raise StorageError.of(error, "writing the keystore") from None
        finally:
            batch.discard()

    def adopt(self, register: Register) -> None:
        """Go on with a register made of the keystore's files; it is written with the first change."""
        self.register, self.has_register, self._adopted = register, True, True

    def keep_adopted(self) -> None:
        """Write what was adopted if nothing changed since."""
        if self._adopted:
            with self.batch():
                pass

    def ensure_directory(self, relative: str) -> None:
        """Create the directory and those above it if missing; refuse links and foreign directories."""
        if relative in self._checked:
            return
        parent = relative.rpartition("/")[0]
        if relative:
            self.ensure_directory(parent)
        path = self.root / relative
        mode = _directory_mode(relative)
        try:
            os.mkdir(path, mode)
            os.chmod(path, mode)
        except FileExistsError:
            safe_files.refuse_unsafe_directory(path)
        self._checked.add(relative)

    def is_directory(self, relative: str) -> bool:
        try:
            return stat.S_ISDIR(os.lstat(f"{self.root}/{relative}").st_mode)
        except FileNotFoundError:
            return False

    def set_mode(self, relative: str, mode: int) -> None:
        """Repair the mode of an existing file or directory, never through a link."""
        with storage_errors("changing the mode of"):
            descriptor = os.open(self.root / relative, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
            try:
                os.fchmod(descriptor, mode)
            finally:
                os.close(descriptor)

    def remove(self, relative: str) -> None:
        """Remove a file or link if it is there."""
        try:
            os.unlink(self.root / relative)
        except FileNotFoundError:
            return
        except OSError as error:
            raise StorageError.of(error, "removing") from None

    def remove_empty_directory(self, relative: str) -> bool:
        try:
            os.rmdir(self.root / relative)
        except OSError as error:
            if error.errno in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOENT):
                return False
            raise StorageError.of(error, "removing") from None
        self._checked.discard(relative)
        return True

    def sync_directories(self, directories: set[str]) -> None:
        """Make new names durable after renames and removals."""
        if not self._durable:
            return
        if len(directories) > _SYNC_EACH and _sync_file_system(self.root):
            return
        for directory in sorted(directories):
            sync_path(self.root / directory)


class Batch:
    """The additions of one ``Store.batch`` block. Targets are paths relative to the keystore."""

    def __init__(self, store: Store):
        self._store = store
        self._staging = f"{store.root}/{layout.STAGING}"
        self._moves: list[tuple[str, str]] = []
        self._written: list[str] = []
        self._staged_directories: list[str] = []
        self.recorded: Register | None = None

    def record(self, register: Register) -> None:
        """Write the register, before everything else of this batch: what is issued is on record before it is seen."""
        place = self._place()
        if self._store.clock is not None:
            register = replace(register, written=self._store.clock)
        self._write(place, Content(register_json(register), PRIVATE_MODE))
        self._moves.insert(0, (place, layout.REGISTER))
        self.recorded = register

    def file(self, target: str, data: bytes, mode: int = PUBLIC_MODE) -> None:
        """Replace or create one file."""
        self._add(target, Content(data, mode))

    def link(self, target: str, link: Link) -> None:
        self._add(target, link)

    def directory(self, target: str, entries: Mapping[str, Content | Link]) -> None:
        """Write a directory's files. A new directory appears at once; in an old one each is replaced."""
        if self._store.is_directory(target):
            for name, entry in entries.items():
                self._add(f"{target}/{name}", entry)
            return
        place = self._place()
        mode = _directory_mode(target)
        os.mkdir(place, mode)
        os.chmod(place, mode)
        for name, entry in entries.items():
            self._write(f"{place}/{name}", entry)
        self._staged_directories.append(place)
        self._moves.append((place, target))

    def _add(self, target: str, entry: Content | Link) -> None:
        place = self._place()
        self._write(place, entry)
        self._moves.append((place, target))

    def _place(self) -> str:
        # Text, not ``Path``: there are thousands.
        if not self._moves:
            os.mkdir(self._staging, 0o700)
        return f"{self._staging}/{len(self._moves)}"

    def _write(self, place: str, entry: Content | Link) -> None:
        if isinstance(entry, Link):
            if _try_link(entry.target, place):
                return
            entry = Content(safe_files.read(self._store.root, entry.source))
        write_new(place, entry.data, entry.mode)
        self._written.append(place)

    def commit(self) -> None:
        if not self._moves:
            return
        self._make_durable()
        changed = set()
        for place, target in self._moves:
            parent = target.rpartition("/")[0]
            self._store.ensure_directory(parent)
            os.rename(place, f"{self._store.root}/{target}")
            changed.add(parent)
        self._store.sync_directories(changed)

    def _make_durable(self) -> None:
        if not self._store._durable:
            return
        if len(self._written) > _SYNC_EACH and _sync_file_system(Path(self._staging)):
            return
        for path in (*self._written, *self._staged_directories):
            sync_path(path)

    def discard(self) -> None:
        """Remove what was not renamed away."""
        if self._moves:
            shutil.rmtree(self._staging, ignore_errors=True)


@contextmanager
def opened(root: Path, *, timeout: float = lock.DEFAULT_TIMEOUT, durable: bool = True) -> Iterator[Store]:
    """Lock an existing keystore directory for writing.

    Raises KeystoreBusyError, UnsafeKeystoreError (its directory or the one above is open to others) or StorageError.
    ``durable`` False skips every fsync: for tests and for keystores that can be thrown away.
    """
    with storage_errors("opening the keystore"):
        safe_files.refuse_unsafe_parent(root)
        safe_files.refuse_unsafe_directory(root)
    with lock.exclusive(root, timeout):
        store = Store(root, durable)
        _clear_staging(root)
        for directory in (layout.PUBLIC, layout.PRIVATE, layout.ENCLAVES):
            if os.path.lexists(root / directory):
                safe_files.refuse_unsafe_directory(root / directory)
        safe_files.refuse_unsafe_private_directories(root)
        yield store


def create_root(root: Path) -> None:
    """Make the keystore's own directory (its parents too); a no-op when it exists."""
    try:
        root.parent.mkdir(parents=True, exist_ok=True)
        safe_files.refuse_unsafe_parent(root)
        os.mkdir(root, 0o755)
        os.chmod(root, 0o755)
    except FileExistsError:
        return
    except OSError as error:
        raise StorageError.of(error, "creating the keystore") from None


def _directory_mode(relative: str) -> int:
    return 0o700 if relative.split("/")[0] == layout.PRIVATE else 0o755


def _clear_staging(root: Path) -> None:
    staging = root / layout.STAGING
    with storage_errors("clearing what an interrupted run left in"):
        if os.path.islink(staging):
            os.unlink(staging)
        elif staging.exists():
            shutil.rmtree(staging)


def _try_link(target: str, place: str) -> bool:
    """Make a link; False if the file system has no symbolic links (FAT, some network shares)."""
    try:
        os.symlink(target, place)
    except OSError as error:
        if error.errno in _NO_LINKS:
            return False
        raise
    return True


def write_new(path: Path | str, data: bytes, mode: int, *, durable: bool = False) -> None:
    """Write a new file, private from its first byte, with exactly this mode; synced to disk if ``durable``."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, mode)
    with os.fdopen(descriptor, "wb") as stream:
        os.fchmod(descriptor, mode)
        stream.write(data)
        if durable:
            stream.flush()
            os.fsync(descriptor)


def sync_path(path: Path | str) -> None:
    """Make a file, or the names in a directory, durable."""
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    try:
        os.fsync(descriptor)
    except OSError as error:
        # Some network file systems cannot sync a directory; its content is as safe as they make it.
        if error.errno != errno.EINVAL:
            raise
    finally:
        os.close(descriptor)


def _sync_file_system(path: Path) -> bool:
    """Call syncfs(2) for the file system that holds ``path``; False if there is none, so that fsync must do."""
    syncfs = getattr(ctypes.CDLL(None, use_errno=True), "syncfs", None)
    if syncfs is None:
        return False
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        if syncfs(descriptor) != 0:
            code = ctypes.get_errno()
            raise OSError(code, os.strerror(code), str(path))
    finally:
        os.close(descriptor)
    return True


def refresh_copies(opened: Store) -> None:
    """Copy trust anchors and the governance again after a change, on a file system without links."""
    view = KeystoreView(opened.root)
    stale = [
        (layout.enclave_file(enclave, name), target, layout.link_source(name))
        for enclave in view.enclaves()
        for name, target in layout.enclave_links(enclave).items()
    ]
    with opened.batch() as batch:
        for relative, target, source in stale:
            if safe_files.link_target(opened.root, relative) is not None:
                continue
            if safe_files.read_if_there(opened.root, relative) != safe_files.read(opened.root, source):
                batch.link(relative, Link(target, source))
