"""Read a file of unknown origin, in bounded time and memory; write one that a person requested: whole, or not at
all.

A path can name a pipe without a writer or an endless device. Both raise ``OSError``.
"""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import tempfile
from pathlib import Path

MEBIBYTE = 2**20
DEFAULT_LIMIT = 16 * MEBIBYTE

# To open a pipe must not wait for its writer.
_FLAGS = os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK | os.O_NOCTTY


def read_bytes(path: str | bytes | os.PathLike[str], limit: int = DEFAULT_LIMIT) -> bytes:
    """Read the regular file ``path``; raises ``OSError`` also for anything else and for more than ``limit`` bytes."""
    descriptor = os.open(path, _FLAGS)
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise _not_regular(path, status.st_mode)
        if status.st_size > limit:
            raise _too_large(path, limit)
        return _read_all(descriptor, path, status.st_size, limit)
    finally:
        os.close(descriptor)


def read_text(
    path: str | bytes | os.PathLike[str], limit: int = DEFAULT_LIMIT, *, errors: str = "strict"
) -> str:
    """Read a UTF-8 file, with line ends as ``open`` gives them; raises as ``read_bytes``, and UnicodeDecodeError."""
    text = read_bytes(path, limit).decode("utf-8", errors)
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def text_or_nothing(path: str | bytes | os.PathLike[str]) -> str:
    """Read the text of a file; empty for one that cannot be read."""
    try:
        return read_text(path, errors="replace")
    except OSError:
        return ""


def check_regular(path: str | bytes | os.PathLike[str]) -> os.stat_result:
    """Return the state of a file that is safe to open and read. Raises ``OSError`` for anything but a regular file."""
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        raise _not_regular(path, status.st_mode)
    return status


def _read_all(descriptor: int, path: str | bytes | os.PathLike[str], expected: int, limit: int) -> bytes:
    """Read to the end: some files, as those of /proc, have more content than their size says."""
    pieces: list[bytes] = []
    length = 0
    while piece := os.read(descriptor, max(expected - length, 0) + 1):
        pieces.append(piece)
        length += len(piece)
        if length > limit:
            raise _too_large(path, limit)
        expected = max(expected, 2 * length)
    return b"".join(pieces)


def _not_regular(path: str | bytes | os.PathLike[str], mode: int) -> OSError:
    number, what = next((number, what) for is_kind, number, what in _OTHER_KINDS if is_kind(mode))
    return OSError(number, what, os.fsdecode(path))


def _too_large(path: str | bytes | os.PathLike[str], limit: int) -> OSError:
    return OSError(errno.EFBIG, f"File is larger than the allowed {limit} bytes", os.fsdecode(path))


_OTHER_KINDS = (
    (stat.S_ISDIR, errno.EISDIR, "Is a directory"),
    (stat.S_ISFIFO, errno.EINVAL, "A pipe, not a file"),
    (stat.S_ISCHR, errno.EINVAL, "A device, not a file"),
    (stat.S_ISBLK, errno.EINVAL, "A device, not a file"),
    (lambda mode: True, errno.EINVAL, "Not a regular file"),
)


def write_text(path: Path, text: str) -> None:
    """Replace ``path`` by ``text`` as UTF-8; an existing file keeps its mode. Raises OSError."""
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write ``content`` as ``write_text`` does."""
    target = Path(os.path.realpath(path))
    if (
        target.exists() and not target.is_file()
    ):  # a terminal, a pipe: nothing to put a new file in the place of
        target.write_bytes(content)
        return
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        os.chmod(name, _mode(target))
        os.replace(name, target)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)
        raise


def _mode(target: Path) -> int:
    with contextlib.suppress(OSError):
        return target.stat().st_mode & 0o7777
    umask = os.umask(0)
    os.umask(umask)
    return 0o666 & ~umask
