"""``--learn``: runs a launch and records what its nodes request. Writes DIR/records/RUN.record and manifests.

Manifests are made again from all records each time and united with what stands in them: nothing goes away because it
was not seen this time.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections import Counter
from collections.abc import Iterable
from datetime import datetime, timezone
from pathlib import Path
from typing import NamedTuple

import yaml

from enclave_addons.recording.record.assembly import Record, read_record
from enclave_addons.recording.record.learning import Learnt, LearntNode, learn
from enclave_addons.recording.record.lines import EndpointMade, Line, NodeMade, RecordedRun, StateEntered
from enclave_addons.recording.record.manifest import manifest_file_name, manifest_text
from enclave_addons.recording.recording import Listener, Recording
from enclave_common.files import write_bytes
from enclave_launch.errors import ManifestError, translated
from enclave_launch.runtime.companion import LaunchControl

RECORDS = "records"
_LONGEST_START = 60.0
"""Seconds that a process may take from its start to its first message from rcl before learning stops waiting for it."""


class QuietWatch(Listener):
    """Ends the launch when nothing new was requested during ``patience`` seconds; ``None``: never."""

    def __init__(self, patience: float | None) -> None:
        self._patience = patience
        self._known: set[tuple[object, ...]] = set()
        self._last = time.monotonic()
        self._over = False

    def opened(self, launch: LaunchControl, recording: Recording) -> None:
        super().opened(launch, recording)
        self._last = time.monotonic()

    def added(self, line: Line) -> None:
        what = self._news(line)
        if what is not None and what not in self._known:
            self._known.add(what)
            self._last = time.monotonic()

    def record_read(self) -> None:
        if self._patience is None or self._over:
            return
        now = time.monotonic()
        if self._recording.running and not self._starting(now) and now - self._last >= self._patience:
            self._over = True
            quiet = f"no new endpoint for {self._patience:g} s"
            self._launch.say("INFO", quiet)
            self._launch.shut_down("learnt")

    def _starting(self, now: float) -> bool:
        """Return True if a process that began a short while ago has said nothing to rcl yet."""
        record = self._recording.record
        speaking = {p.started.pid for p in record.attributed() if p.started is not None}
        return any(
            pid not in speaking and pid not in self._recording.unheard and now - since < _LONGEST_START
            for pid, since in self._recording.running.items()
        )

    def _news(self, line: Line) -> tuple[object, ...] | None:
        """Return what a line says that may be new; a process that is started again repeats itself."""
        if isinstance(line, EndpointMade):
            return (line.kind, line.fqn, line.written)
        if isinstance(line, NodeMade):
            return (line.fqn,)
        if isinstance(line, StateEntered):
            process = self._recording.record.process_of(line.pid)
            return (process.node(line.node).fqn, line.state) if process else None
        return None


class LearntFolder(NamedTuple):
    """The manifests that were written. ``files``: manifests by path; ``notes``: what a person should know of them."""

    files: dict[Path, LearntNode]
    notes: tuple[str, ...]


def new_run(launch_file: str, distro: str, isolation: str, *, secured: bool = False) -> RecordedRun:
    """Return a run that is named by the time, so that runs sort in the order in which they were made."""
    now = datetime.now(timezone.utc)
    identifier = f"{now:%Y%m%dT%H%M%S}-{os.getpid():x}{int(now.microsecond / 1000):03x}"
    return RecordedRun(identifier, launch_file, distro, isolation, now.isoformat(timespec="seconds"), secured)


def prepare_folder(folder: Path) -> None:
    """Make the folder before anything runs, so that no record is lost for want of a place. Raises ``ManifestError``."""
    records = folder / RECORDS
    try:
        records.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=records):
            pass
    except OSError as error:
        raise ManifestError(f"{records}: cannot be written: {error.strerror}; nothing was started") from error


def keep_record(folder: Path, run: RecordedRun, data: bytes) -> Path:
    """Write the record of ``run`` into the folder. Raises ``ManifestError`` if it cannot be written."""
    path = folder / RECORDS / f"{run.id}.record"
    _write(path, data)
    return path


def write_manifests(folder: Path) -> LearntFolder:
    """Write the manifests of all records in ``folder``; raises ``ManifestError``."""
    records = [_read(path) for path in sorted((folder / RECORDS).glob("*.record"))]
    learnt = learn(records)
    programs = Counter((node.key.package, node.key.executable, node.key.plugin) for node in learnt.nodes)
    files: dict[Path, LearntNode] = {}
    for node in learnt.nodes:
        alone = programs[node.key.package, node.key.executable, node.key.plugin] == 1
        path = folder / manifest_file_name(node, alone)
        _write(path, _manifest(node, path).encode())
        files[path] = node
    _drop_other_form(folder, files)
    return LearntFolder(files, tuple(_notes(learnt, records)))


def _drop_other_form(folder: Path, files: dict[Path, LearntNode]) -> None:
    """Remove the file for a whole program that showed a second node: it would contradict the files of its nodes."""
    for path, node in files.items():
        whole = folder / manifest_file_name(node, alone=True)
        if whole not in files and whole.exists() and whole != path:
            whole.unlink()


def _manifest(node: LearntNode, path: Path) -> str:
    try:
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        return manifest_text(node, before)
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ManifestError(f"{path}: it cannot be read: {error}; move it away") from error


def _read(path: Path) -> Record:
    with translated(OSError, ManifestError, f"{path}: cannot be read: "):
        return read_record(path.read_bytes())


def _notes(learnt: Learnt, records: Iterable[Record]) -> Iterable[str]:
    for node in learnt.nodes:
        yield from (
            f"{node.program}, node {node.key.node}: {text}" for text in (*node.incomplete, *node.notes)
        )
    for pattern in learnt.unforeseeable:
        yield f"node {pattern}: not learnt, as its name or its origin is not known beforehand"
    for record in records:
        yield from (f"run {record.run.id}: {complaint.why}" for complaint in record.complaints)


def _write(path: Path, data: bytes) -> None:
    with translated(OSError, ManifestError, f"{path}: cannot be written: "):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, data)
