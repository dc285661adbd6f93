"""Find missing programs before launch would notice them, when it spawns. Reads the file system."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable

from enclave_launch.errors import LaunchFileError
from enclave_launch.process import ResolvedProcess


def missing_programs(processes: Iterable[ResolvedProcess]) -> list[tuple[ResolvedProcess, LaunchFileError]]:
    """Return each process whose first word, a prefix such as ``gdb`` included, cannot be executed, and the error."""
    known: dict[tuple[str, str], bool] = {}
    errors = []
    for process in processes:
        if process.cmd and not process.shell:
            key = _program(process), _path(process)
            if key not in known:
                known[key] = shutil.which(key[0], path=key[1]) is not None
            if not known[key]:
                errors.append((process, LaunchFileError(_message(process), process.location)))
    return errors


def check_programs(processes: Iterable[ResolvedProcess]) -> None:
    """Raise ``LaunchFileError`` unless all that starts by itself, before any event, can be executed."""
    missing = missing_programs(process for process in processes if process.on_event is None)
    if missing:
        raise LaunchFileError("\n".join((*(str(error) for _, error in missing), "nothing was started")))


def _program(process: ResolvedProcess) -> str:
    program = process.cmd[0]
    return os.path.join(process.cwd or "", program) if os.path.dirname(program) else program


def _message(process: ResolvedProcess) -> str:
    program = process.cmd[0]
    is_path = os.path.dirname(program)
    why = "no such file, or it is not executable" if is_path else f"not on the PATH ({_path(process)})"
    return f"program '{program}' cannot be executed: {why}"


def _path(process: ResolvedProcess) -> str:
    return process.environment.get("PATH", os.environ.get("PATH", os.defpath))
