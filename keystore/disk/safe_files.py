"""Reading a keystore without being led out of it, and refusing one that others could have changed."""

from __future__ import annotations

import errno
import os
import shlex
import stat
from collections.abc import Iterable
from pathlib import Path

from enclave_common.terminal import quoted
from keystore.disk import layout
from keystore.errors import DamagedKeystoreError, NotAKeystoreError, StorageError, UnsafeKeystoreError

_MAX_FILE = 8_000_000
_MAX_OF_ALL = 200_000_000  # of a file that speaks of every enclave
_WRITABLE_BY_OTHERS = 0o022


def resolve_root(keystore: Path | str) -> Path:
    """Resolve the path of a keystore; raises NotAKeystoreError for what cannot be a path."""
    try:
        return Path(os.path.realpath(keystore))
    except ValueError:
        raise NotAKeystoreError(f"{quoted(keystore)} is not a path") from None


def folders_of_links(keystore: Path | str) -> list[Path]:
    """Return the folder of each link that leads to the keystore: who can write there can redirect the link."""
    links: dict[Path, None] = {}
    waiting = [Path(os.path.abspath(keystore))]
    while waiting:
        path = waiting.pop()
        for place in (path, *path.parents):
            link = Path(os.path.realpath(place.parent), place.name)
            if link.is_symlink() and link not in links:
                links[link] = None
                waiting.append(link.parent / os.readlink(link))
    return list(dict.fromkeys(link.parent for link in links))


def read(root: Path, relative: str) -> bytes:
    """Read a file. Raises DamagedKeystoreError if it is missing, UnsafeKeystoreError for a link, StorageError."""
    try:
        return _read(root, relative)
    except FileNotFoundError:
        raise DamagedKeystoreError(f"{quoted(root / relative)} is missing") from None
    except OSError as error:
        raise StorageError.of(error, "reading the keystore") from None


def read_if_there(root: Path, relative: str) -> bytes | None:
    """Read as ``read``. Return None for a missing file or a dangling link."""
    try:
        return _read(root, relative)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise StorageError.of(error, "reading the keystore") from None


def read_private(root: Path, relative: str) -> bytes:
    """Read key material as ``read``; also refuse foreign owners and files that others can write."""
    refuse_unsafe_private(root, relative)
    return read(root, relative)


def _read(root: Path, relative: str) -> bytes:
    """Read by text paths, not ``Path``: this runs a few hundred times before a launch."""
    descriptor = _open(root, relative)
    try:
        info = os.fstat(descriptor)
        if not stat.S_ISREG(info.st_mode):
            raise UnsafeKeystoreError(f"{quoted(root / relative)} is not a regular file; remove it")
        limit = _MAX_OF_ALL if relative in (layout.REGISTER, layout.ZENOH_ROUTER) else _MAX_FILE
        if info.st_size > limit:
            raise DamagedKeystoreError(f"{quoted(root / relative)} is larger than {limit} bytes")
        content = os.read(descriptor, info.st_size + 1)
        if len(content) != info.st_size:
            raise DamagedKeystoreError(f"{quoted(root / relative)} changed while it was read; try again")
        return content
    finally:
        os.close(descriptor)


def _open(root: Path, relative: str) -> int:
    """Open a file; follow links only where SROS2 has them. O_NONBLOCK keeps a planted FIFO from hanging us."""
    flags = os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK
    try:
        return os.open(f"{root}/{relative}", flags | os.O_NOFOLLOW)
    except OSError as error:
        if error.errno != errno.ELOOP:
            raise
    target = link_target(root, relative) or ""
    if target not in allowed_targets(relative):
        raise strange_link(root, relative, target)
    return os.open(f"{root}/{relative}", flags)


def strange_link(root: Path, relative: str, target: str) -> UnsafeKeystoreError:
    """Return the error for a link that no keystore has, with the command that removes it."""
    path = root / relative
    return UnsafeKeystoreError(
        f"{quoted(path)} is a link to {quoted(target)}, which no keystore has there; "
        f"look at it and remove it: rm {shlex.quote(str(path))}"
    )


def link_target(root: Path, relative: str) -> str | None:
    """Return where the file points if it is a link, else None (also if it does not exist)."""
    try:
        return os.readlink(f"{root}/{relative}")
    except OSError:
        return None


def allowed_targets(relative: str) -> tuple[str, ...]:
    """Return every link target that may stand at this place of a keystore."""
    if relative in layout.CA_LINKS:
        return (layout.CA_LINKS[relative],)
    directory, _, name = relative.rpartition("/")
    if not relative.startswith(layout.ENCLAVES + "/"):
        return ()
    enclave = "/" + directory.removeprefix(layout.ENCLAVES).lstrip("/")
    target = layout.enclave_links(enclave, crl=True).get(name)
    return (target,) if target else ()


def refuse_unsafe_private(root: Path, relative: str) -> None:
    """Refuse a key file if it or its directory is not ours, or others can write it."""
    path = root / relative
    try:
        found = (path.parent, os.lstat(path.parent)), (path, os.stat(path))
    except OSError:
        return  # missing: the read that follows says so
    for place, info in found:
        if problem := private_problem(place, info):
            raise UnsafeKeystoreError(problem)


def refuse_unsafe_private_directories(root: Path) -> None:
    """Refuse ``private/`` if another user can write to it: a key placed there would become a CA."""
    for relative in (layout.PRIVATE, *layout.PRIVATE_FOLDERS):
        path = root / relative
        if not os.path.lexists(path):
            continue
        refuse_unsafe_directory(path)
        info = os.lstat(path)
        if info.st_mode & _WRITABLE_BY_OTHERS:
            raise UnsafeKeystoreError(
                f"{quoted(path)} can be written by others (mode {mode_text(info)}); for the whole keystore: "
                f"{close_to_others(root)}"
            )


def private_problem(path: Path | str, info: os.stat_result) -> str | None:
    """Return what is wrong with the owner or mode of a private file or directory, with the command that repairs it."""
    if info.st_uid == os.geteuid() and not info.st_mode & _WRITABLE_BY_OTHERS:
        return None
    if info.st_uid != os.geteuid():
        return (
            f"{quoted(path)} belongs to user {info.st_uid}, not to you ({os.geteuid()}): run as that "
            f"user, or take it over: {private_repair(path, info)}"
        )
    return f"{quoted(path)} can be written by others (mode {mode_text(info)}): {private_repair(path, info)}"


def is_trusted_owner(info: os.stat_result) -> bool:
    """Return True for what belongs to us or to the administrator."""
    return info.st_uid in (0, os.geteuid())


def refuse_foreign_owner(root: Path, enclaves: Iterable[str]) -> None:
    """Refuse to start from files of another user, who can change them at any time.

    Args:
        root: The resolved path of the keystore.
        enclaves: The enclaves that processes are about to use.

    Raises:
        UnsafeKeystoreError: A folder or file that these processes read belongs to another user.
    """
    for relative in layout.read_by_processes(enclaves):
        try:
            info = os.lstat(f"{root}/{relative}")
        except OSError:
            continue  # the checks of content report what is missing
        if not is_trusted_owner(info):
            place = root / relative
            raise UnsafeKeystoreError(
                f"{quoted(place)} belongs to user {info.st_uid}, who can change it at any time: run as that user, "
                f"or take the keystore over: chown -R {os.geteuid()} {shlex.quote(str(root))}"
            )


def close_to_others(root: Path) -> str:
    """Return one command for all that SROS2 leaves under the usual umask 002."""
    return f"chmod -R go-w {shlex.quote(str(root))}"


def private_repair(path: Path | str, info: os.stat_result) -> str:
    """Return the command that makes ``path`` ours (if someone else owns it) or closes it to others."""
    word = shlex.quote(str(path))
    if info.st_uid != os.geteuid():
        return f"chown -R {os.geteuid()} {word}"
    return f"chmod go-rwx {word}"


def refuse_unsafe_directory(path: Path) -> None:
    """Refuse to write in a directory that is a link, not ours, or open to everybody."""
    try:
        info = os.lstat(path)
    except OSError as error:
        raise StorageError.of(error, "looking at the directory") from None
    word = shlex.quote(str(path))
    if stat.S_ISLNK(info.st_mode) or not stat.S_ISDIR(info.st_mode):
        raise UnsafeKeystoreError(f"{quoted(path)} is not a directory (a link?); remove it: rm {word}")
    if info.st_uid != os.geteuid():
        raise UnsafeKeystoreError(private_problem(path, info) or "")
    if info.st_mode & stat.S_IWOTH:
        raise UnsafeKeystoreError(
            f"everybody can write in {quoted(path)} (mode {mode_text(info)}): chmod o-w {word}"
        )


def refuse_unsafe_parent(root: Path) -> None:
    """Refuse a parent that is open without the sticky bit: who can rename the keystore can replace it."""
    info = os.stat(root.parent)
    if info.st_mode & stat.S_IWOTH and not info.st_mode & stat.S_ISVTX:
        raise UnsafeKeystoreError(
            f"everybody can rename what is in {quoted(root.parent)}: "
            f"chmod o-w {shlex.quote(str(root.parent))}, or put the keystore elsewhere"
        )


def mode_text(info: os.stat_result) -> str:
    """Render the permission bits as ``chmod`` takes them: ``0600``."""
    return f"{stat.S_IMODE(info.st_mode):04o}"
