"""The recorder as a shared library: built by the system's C compiler on first use, kept in the user's cache.

Touches the world: runs ``cc`` (or ``$CC``), writes one file. The name of the file holds the hash of the source, so
that another version of this project builds its own.

It gets into a process by the environment. A launch file may set ``LD_PRELOAD`` itself, and what it sets replaces what
was inherited: so the recorder is added last, behind what is there. A program built with the dynamic runtime of
AddressSanitizer ends at once unless that runtime is the first library of all.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

from enclave_launch.errors import RuntimeFailure

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
    """Return True if nobody else can have written it: every process of a launch loads it."""
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
