"""What launch would only notice when it spawns: programs that are not there.

Looks at the file system; asked before anything starts.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable

from enclave_launch.process import ResolvedProcess


def missing_programs(processes: Iterable[ResolvedProcess]) -> list[str]:
    """One message, with its place, for each process whose program cannot be executed.

    The program is the first word of the command, a prefix such as ``gdb`` included. What a shell would run
    is the shell's business.
    """
    return [
        f"{process.location}: <{process.location.element}> program '{process.cmd[0]}' cannot be executed: "
        f"{_why(process)}"
        for process in processes
        if process.cmd and not process.shell and not _found(process)
    ]


def _found(process: ResolvedProcess) -> bool:
    program = process.cmd[0]
    if os.path.dirname(program):
        return shutil.which(os.path.join(process.cwd or "", program)) is not None
    return shutil.which(program, path=_path(process)) is not None


def _why(process: ResolvedProcess) -> str:
    if os.path.dirname(process.cmd[0]):
        return "no such file, or it is not executable"
    return f"not on the PATH ({_path(process)})"


def _path(process: ResolvedProcess) -> str:
    return process.environment.get("PATH", os.environ.get("PATH", os.defpath))
