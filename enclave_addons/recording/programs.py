"""The recorder as a shared library, and the programs that it cannot get into, known by their heads.

It is built by the system's C compiler on first use and kept in the user's cache, under the hash of its source. It gets
into a process by the environment, behind what a launch file puts into ``LD_PRELOAD`` itself; a program built with the
dynamic runtime of AddressSanitizer ends at once unless that runtime is the first library of all.

``ld.so`` ignores LD_PRELOAD without a word for programs that gain privileges; a static program has no ``ld.so``; some
programs start others with a cleaned environment (man 8 ld.so, ELF specification).
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import stat
import struct
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO, NamedTuple

from enclave_launch.errors import RuntimeFailure

_LOAD, _DYNAMIC, _INTERPRETER = 1, 2, 3  # p_type
_NEEDED, _STRING_TABLE = 1, 5  # d_tag
_CLEANERS = frozenset({"sudo", "doas", "pkexec"})
_LARGEST_TABLE = 1 << 20


class ProgramToRecord(NamedTuple):
    """A program about to be recorded. ``obstacle``: why it cannot be recorded, empty if it can; ``sanitizer``: a
    runtime that must be loaded first."""

    path: str
    obstacle: str = ""
    sanitizer: str | None = None


def inspect_command(words: Sequence[str], search_path: str = os.defpath) -> ProgramToRecord:
    """Return the first program of a command line that cannot be recorded, else the last one that is run."""
    programs = list(_programs(words, search_path))
    hindered = next((program for program in programs if program.obstacle), None)
    if hindered is not None:
        return hindered
    sanitized = next((program for program in programs if program.sanitizer), None)
    return sanitized or (programs[-1] if programs else ProgramToRecord(""))


def _programs(words: Sequence[str], search_path: str) -> Iterator[ProgramToRecord]:
    for place, word in enumerate(words):
        name = os.path.basename(word)
        if name in _CLEANERS and place == 0:
            yield ProgramToRecord(word, f"{name} starts programs with an environment of its own")
        elif name == "env" and set(words[place + 1 : place + 2]) & {"-i", "-", "--ignore-environment"}:
            yield ProgramToRecord(word, "env -i starts programs with an empty environment")
        elif place == 0 or os.path.isabs(word):
            path = shutil.which(word, path=search_path)
            if path is not None:
                yield _inspected(path, _state(path))


def _state(path: str) -> tuple[int, int]:
    try:
        status = os.stat(path)
    except OSError:
        return (0, 0)
    return (status.st_ino, status.st_ctime_ns)


@lru_cache(maxsize=1024)
def _inspected(path: str, state: tuple[int, int]) -> ProgramToRecord:
    return inspect_program(path)


def inspect_program(path: str, depth: int = 0) -> ProgramToRecord:
    """Return what the head of the file says; a script is what its interpreter is."""
    try:
        with open(path, "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                return ProgramToRecord(path)
            head = file.read(256)
            if head[:2] == b"#!":
                interpreter = head[2:].split(b"\n")[0].split()[:1]
                if depth < 4 and interpreter:
                    return inspect_program(os.fsdecode(interpreter[0]), depth + 1)
                return ProgramToRecord(path)
            gains = _gains_privileges(path, status)
            return ProgramToRecord(path, gains) if gains else _elf(path, head, file)
    except OSError:
        return ProgramToRecord(path)  # its start will say so


def _gains_privileges(path: str, status: os.stat_result) -> str:
    if status.st_mode & stat.S_ISUID and status.st_uid != os.geteuid():
        return f"{path} is set-uid: the dynamic linker ignores LD_PRELOAD for it"
    if status.st_mode & stat.S_ISGID and status.st_mode & stat.S_IXGRP and status.st_gid != os.getegid():
        return f"{path} is set-gid: the dynamic linker ignores LD_PRELOAD for it"
    try:
        os.getxattr(path, "security.capability")
    except (OSError, AttributeError):
        return ""
    if os.geteuid() == 0:
        return ""  # root has them already, so nothing is gained
    return f"{path} has file capabilities: the dynamic linker ignores LD_PRELOAD for it"


def _elf(path: str, head: bytes, file: BinaryIO) -> ProgramToRecord:
    if head[:4] != b"\x7fELF":
        return ProgramToRecord(path)
    wide, order = head[4] == 2, "<" if head[5] == 1 else ">"
    if wide != (struct.calcsize("P") == 8):
        return ProgramToRecord(path, f"{path} is a program of another word size than the recorder")
    try:
        segments = _segments(head, file, wide, order)
        if not any(kind == _INTERPRETER for kind, *_ in segments):
            return ProgramToRecord(path, f"{path} is linked statically: nothing can be loaded into it")
        needed = _needed(file, segments, wide, order)
    except (struct.error, ValueError):
        return ProgramToRecord(path)
    sanitizer = next((name for name in needed if name.startswith("libasan.so")), None)
    return ProgramToRecord(path, sanitizer=sanitizer)


_Segment = tuple[int, int, int, int]  # type, offset in the file, address, size in the file


def _segments(head: bytes, file: BinaryIO, wide: bool, order: str) -> list[_Segment]:
    if wide:
        (start,) = struct.unpack_from(f"{order}Q", head, 32)
        size, count = struct.unpack_from(f"{order}HH", head, 54)
        form, fields = f"{order}IIQQQQQQ", (0, 2, 3, 5)
    else:
        (start,) = struct.unpack_from(f"{order}I", head, 28)
        size, count = struct.unpack_from(f"{order}HH", head, 42)
        form, fields = f"{order}IIIIIIII", (0, 1, 2, 4)
    file.seek(start)
    table = file.read(min(size * count, _LARGEST_TABLE))
    rows = [struct.unpack_from(form, table, place * size) for place in range(count)]
    return [(row[fields[0]], row[fields[1]], row[fields[2]], row[fields[3]]) for row in rows]


def _needed(file: BinaryIO, segments: Sequence[_Segment], wide: bool, order: str) -> list[str]:
    dynamic = next((segment for segment in segments if segment[0] == _DYNAMIC), None)
    if dynamic is None:
        return []
    file.seek(dynamic[1])
    form = f"{order}{'QQ' if wide else 'II'}"
    table = file.read(min(dynamic[3], _LARGEST_TABLE))
    usable = len(table) - len(table) % struct.calcsize(form)
    rows = list(struct.iter_unpack(form, table[:usable]))
    strings = next((value for tag, value in rows if tag == _STRING_TABLE), 0)
    offset = next(
        (o + strings - a for kind, o, a, s in segments if kind == _LOAD and a <= strings < a + s), None
    )
    if offset is None:
        return []
    names = []
    for tag, value in rows:
        if tag == _NEEDED:
            file.seek(offset + value)
            names.append(os.fsdecode(file.read(256).split(b"\0")[0]))
    return names


RECORD_VARIABLE = "ENCLAVE_LAUNCH_RECORD"
PRELOAD = "LD_PRELOAD"
SOURCE = Path(__file__).with_name("recorder.c")
_FLAGS = ("-std=gnu11", "-shared", "-fPIC", "-O2", "-Wl,-z,now")


def recorder_library() -> Path:
    """Return the path of the library, built if needed; raises ``RuntimeFailure`` if that is not possible."""
    text = SOURCE.read_bytes() + " ".join(_FLAGS).encode()
    wanted = _cache() / f"recorder-{hashlib.sha256(text).hexdigest()[:16]}-{platform.machine()}.so"
    if not _is_ours(wanted):
        _build(wanted)
    return wanted


def _cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    if not os.path.isabs(base):
        raise RuntimeFailure("there is no folder for the recorder: no home directory; set XDG_CACHE_HOME")
    return Path(base, "enclave-launch")


def _is_ours(path: Path) -> bool:
    """Return True if only this user can write the file: every process of a launch loads it."""
    try:
        status = path.stat()
    except OSError:
        return False
    others_may_write = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return status.st_uid == os.geteuid() and not others_may_write


def _build(wanted: Path) -> None:
    compiler = os.environ.get("CC") or "cc"
    if shutil.which(compiler) is None:
        raise RuntimeFailure(
            f"recording needs a C compiler ('{compiler}' is not there): install one (apt install gcc libc6-dev); or "
            f"take {wanted.name} from ~/.cache/enclave-launch on a machine of this kind that has recorded once, with "
            f"this version of enclave-launch, and put it into {wanted.parent}; or launch without recording"
        )
    try:
        wanted.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.TemporaryDirectory(dir=wanted.parent) as folder:
            built = Path(folder, wanted.name)
            command = [compiler, *_FLAGS, "-o", str(built), str(SOURCE), "-ldl"]
            run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
            if run.returncode != 0:
                raise RuntimeFailure(
                    f"the recorder cannot be built: {' '.join(command)}: {run.stderr.strip()}"
                )
            built.chmod(0o755)
            built.rename(wanted)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RuntimeFailure(f"the recorder cannot be built in {wanted.parent}: {error}") from error


def with_recorder(
    environment: Mapping[str, str], library: str, record: str, sanitizer: str | None = None
) -> dict[str, str]:
    """Return ``environment`` with the recorder, behind the ``sanitizer`` that must come first."""
    present = [name for name in re.split(r"[ :]+", environment.get(PRELOAD, "")) if name]
    first = [sanitizer] if sanitizer and not any("libasan" in name for name in present) else []
    others = [name for name in present if name != library]
    return {**environment, PRELOAD: ":".join([*first, *others, library]), RECORD_VARIABLE: record}
