"""One record file for each process of a launch, so that a process can write about itself only.

A process and what it starts are given one file; its name is random, and others cannot list the folder. A line about a
process that belongs to another file, and a line that only the launcher writes, is refused and reported: a program could
otherwise add permissions to another program's manifest. A program of the same user that looks for the files of others
in ``/proc`` is not stopped by this, but its lines have to name processes that write into that file. Reads files.
"""

from __future__ import annotations

import json
import secrets
from pathlib import Path

_OF_THE_LAUNCHER = frozenset({"run", "process", "component"})


class _RecordFile:
    def __init__(self, path: Path) -> None:
        self.path = path
        self._read = 0
        self.rest = b""

    def new_lines(self) -> list[bytes]:
        """Return the whole lines that were added. Raises ``OSError``."""
        with self.path.open("rb") as file:
            file.seek(self._read)
            new = file.read()
        self._read += len(new)
        *lines, self.rest = (self.rest + new).split(b"\n")
        return [line + b"\n" for line in lines if line.strip()]


class RecordFiles:
    """The files of a launch, by the name of the process. ``reports`` are those not yet handed out."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: dict[str, _RecordFile] = {}
        self._writer: dict[int, str] = {}  # pid -> the process in whose file it is written
        self._named: dict[int, set[str]] = {}  # pid -> processes that gave it as a parent or session
        self._reported: set[tuple[str, int]] = set()
        self.reports: list[str] = []

    def path_of(self, process: str) -> Path:
        """Return the file of ``process``, created on the first call. Raises ``OSError``."""
        if process not in self._files:
            path = self._folder / f"record-{secrets.token_hex(16)}"
            path.touch()
            path.chmod(0o622)  # processes of other users append to it
            self._files[process] = _RecordFile(path)
        return self._files[process].path

    def started(self, process: str, pid: int) -> None:
        """Bind ``pid`` to ``process``: the launcher started it."""
        for earlier in {self._writer.get(pid, process), *self._named.get(pid, ())} - {process}:
            self._refuse(earlier, pid, process)
        self._writer[pid] = process

    def new_lines(self) -> bytes:
        """Return what processes wrote about themselves since the last call, oldest first."""
        accepted: list[tuple[int, int, bytes]] = []
        for process, file in self._files.items():
            try:
                lines = file.new_lines()
            except OSError as error:
                self._report((process, -1), f"the record of {process} cannot be read any more: {error}")
                continue
            for line in lines:
                when = self._accept(process, line)
                if when is not None:
                    accepted.append((when, len(accepted), line))
        return b"".join(line for _, _, line in sorted(accepted))

    def unfinished(self) -> bytes:
        """Return the ends of files that are not whole lines."""
        return b"".join(file.rest + b"\n" for file in self._files.values() if file.rest.strip())

    def _accept(self, process: str, line: bytes) -> int | None:
        """Return when the line was written (nanoseconds), 0 if it does not say so; None if it is refused."""
        try:
            fields = json.loads(line)
        except (ValueError, RecursionError):
            return 0  # whoever reads the lines reports it
        if not isinstance(fields, dict):
            return 0
        pid, when = fields.get("pid"), fields.get("at")
        if fields.get("what") in _OF_THE_LAUNCHER:
            self._refuse(process, 0, "the launcher")
            return None
        # A pid stays with the file that names it first, also after its end: whoever gets it again is reported. By its
        # parent and session a program is attributed to what the launcher started.
        for named in (pid, fields.get("parent"), fields.get("session")):
            if not isinstance(named, int):
                continue
            owner = self._writer.get(named, process)
            if owner != process:
                self._refuse(process, named, owner)
                return None
            self._named.setdefault(named, set()).add(process)
        if isinstance(pid, int):
            self._writer[pid] = process
        return when if isinstance(when, int) else 0

    def _refuse(self, process: str, pid: int, owner: str) -> None:
        about = f"process {pid} of {owner}" if pid else owner
        self._report(
            (process, pid), f"{process} wrote lines about {about} into its record; they are not used"
        )

    def _report(self, about: tuple[str, int], text: str) -> None:
        if about not in self._reported:
            self._reported.add(about)
            self.reports.append(text)
