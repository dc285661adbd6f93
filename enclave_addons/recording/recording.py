"""The record of one launch: every process gets the recorder, what it writes is read as it grows.

Goes along with a launch (``runtime.companion``). Each process has a file of its own in a folder that only who knows its
name can enter: processes of other users must be able to write there, strangers must not. Next are the listeners:
learning, audit, denials.
"""

from __future__ import annotations

import asyncio
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from enclave_addons.recording.programs import (
    RECORD_VARIABLE,
    inspect_command,
    recorder_library,
    with_recorder,
)
from enclave_addons.recording.record.assembly import Record, RecordedNode
from enclave_addons.recording.record.lines import (
    Complaint,
    EndpointMade,
    Line,
    LineReader,
    LoadedComponent,
    RecordedRun,
    StartedProcess,
    line_text,
)
from enclave_addons.recording.record.requested import RequestedEndpoint, requested_endpoint
from enclave_addons.recording.record_files import RecordFiles
from enclave_launch.errors import RuntimeFailure
from enclave_launch.policy.program_inputs import own_words
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from enclave_launch.runtime.companion import LaunchControl
from enclave_launch.runtime.process_tree import ProcessSpec
from enclave_launch.runtime.run_events import (
    EndpointCreated,
    EndpointRefused,
    EndpointRequested,
    LaunchOver,
    ProcessExited,
    ProcessStarted,
    RunEvent,
)
from enclave_launch.security_environment import LOG_FILE
from nodl.ros_arguments import parse_ros_arguments

INTERVAL = 0.1
"""Seconds between two reads of the record."""
_LONGEST_WAIT = 2.0
"""Seconds to wait for the report about the parent of a process."""


class Unrecorded(NamedTuple):
    """A process that cannot be recorded, or was not, and why."""

    process: str
    why: str


class Listener:
    """Called in the event loop, ``opened`` first; does nothing by itself: each overrides what it is interested in."""

    _launch: LaunchControl
    _recording: Recording

    def opened(self, launch: LaunchControl, recording: Recording) -> None:
        self._launch, self._recording = launch, recording

    def added(self, line: Line) -> None:
        """Receive ``line``, which is in the record already."""

    def happened(self, event: RunEvent) -> None:
        """Receive an event of the launch."""

    def record_read(self) -> None:
        """Receive notice that the record was read again."""

    def closed(self) -> None:
        """Receive notice that every process has ended and every line was added."""


class Recording:
    """Records one launch. ``record`` is complete when the launch is over; ``data`` is its text. ``optional``: the
    launch goes on where nothing can be recorded, which is said."""

    def __init__(
        self,
        run: RecordedRun,
        listeners: Sequence[Listener] = (),
        *,
        optional: bool = False,
    ) -> None:
        self.run = run
        self.record = Record([run])
        self.unrecorded: list[Unrecorded] = []
        self.running: dict[int, float] = {}  # pid -> when it was started
        self.unheard: set[int] = set()  # pids of which nothing is to be expected
        self.security_logs: dict[str, Path] = {}  # of the processes that write one
        self.data = b""
        self._listeners: tuple[Listener, ...] = (EndpointEvents(), *listeners)
        self._optional = optional
        self._processes: dict[str, ResolvedProcess] = {}
        self._reader = LineReader()
        self._lost: list[str] = []
        self._untold: list[tuple[float, Line]] = []
        self._folder: Path | None = None
        self._files: RecordFiles
        self._task: asyncio.Task[None] | None = None
        self._launch: LaunchControl

    # LaunchCompanion

    @property
    def records(self) -> bool:
        return self._folder is not None

    def opened(self, launch: LaunchControl) -> None:
        self._launch = launch
        for listener in self._listeners:
            listener.opened(launch, self)
        try:
            self._make_folder()
        except (RuntimeFailure, OSError) as error:
            self._remove_folder()
            if not self._optional:
                raise RuntimeFailure(f"nothing can be recorded: {error}") from error
            self.say_warning(f"a refusal of DDS will not be explained: {error}")
            return
        self._add(self.run)
        self._task = asyncio.get_running_loop().create_task(self._watch())

    def _make_folder(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="enclave_launch_record_"))
        self._folder.chmod(0o711)
        shutil.copyfile(recorder_library(), self._library)
        self._library.chmod(0o755)
        self._try_it()
        self._files = RecordFiles(self._folder)

    def _remove_folder(self) -> None:
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
        self._folder = None

    def prepared(self, process: ResolvedProcess, spec: ProcessSpec) -> ProcessSpec:
        self._processes[process.process_name] = process
        if log := spec.environment.get(LOG_FILE):
            self.security_logs[process.process_name] = Path(spec.cwd or ".") / log
        if self._folder is None:
            return spec
        program = inspect_command(spec.cmd, spec.environment.get("PATH", os.defpath))
        if program.obstacle:
            self._not_recorded(process.process_name, program.obstacle)
        try:
            record = self._files.path_of(process.process_name)
        except OSError as error:
            self._not_recorded(process.process_name, f"its record cannot be created: {error}")
            return spec
        worn = with_recorder(spec.environment, str(self._library), str(record), program.sanitizer)
        return spec._replace(environment=worn)

    def happened(self, event: RunEvent) -> None:
        if isinstance(event, ProcessStarted):
            self.running[event.pid] = time.monotonic()
            if any(each.process == event.name for each in self.unrecorded):
                self.unheard.add(event.pid)
            process = self._processes[event.name]
            if self._folder is not None:
                self._files.started(event.name, event.pid)
            self._add(_started(process, event.pid))
        elif isinstance(event, ProcessExited):
            self.running.pop(event.pid, None)
        elif isinstance(event, LaunchOver) and self._folder is not None:
            self._read_the_rest()  # what is reported now is printed before the end
            self._report(float("inf"))
        for listener in self._listeners:
            listener.happened(event)

    def loading(self, components: Sequence[ResolvedComponent]) -> None:
        for component in components:
            self._add(_component(component))

    async def closed(self) -> None:
        if self._folder is None:
            return
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        try:
            self._read_the_rest()
            self._report(float("inf"))
            self._take(self._files.unfinished())
            self._reader.close()
            self.record.complaints = [*self._reader.complaints, *(Complaint(0, why) for why in self._lost)]
            self._name_the_silent()
            for listener in self._listeners:
                listener.closed()
        finally:
            self._remove_folder()

    # what listeners ask for

    def say_warning(self, text: str) -> None:
        self._launch.say("WARNING", text)

    @property
    def _library(self) -> Path:
        assert self._folder is not None
        return self._folder / "recorder.so"

    def _try_it(self) -> None:
        """Run one program with the recorder first: a folder without execution, a libc of another kind."""
        trial = self._library.with_name("trial")
        trial.touch()
        environment = {**os.environ, "LD_PRELOAD": str(self._library), RECORD_VARIABLE: str(trial)}
        ran = subprocess.run(
            ["/bin/sh", "-c", ":"], env=environment, capture_output=True, text=True, check=False
        )
        heard = trial.read_bytes()
        trial.unlink()
        if b'"what":"loaded"' not in heard:
            said = ran.stderr.strip() or "the dynamic linker did not load it"
            raise RuntimeFailure(
                f"the recorder does not work here: {said}; set TMPDIR to a folder from which programs may be run"
            )

    def _add(self, line: RecordedRun | StartedProcess | LoadedComponent) -> None:
        if self._folder is not None:
            self._take(line_text(line))

    async def _watch(self) -> None:
        try:
            while True:
                await asyncio.sleep(INTERVAL)
                self._read_new_lines()
                for listener in self._listeners:
                    listener.record_read()
        except OSError as error:
            self._lose(f"the record of this launch cannot be read any more: {error}")

    def _read_new_lines(self) -> None:
        self._take(self._files.new_lines())
        for report in self._files.reports:
            self._lose(report)
        self._files.reports.clear()
        self._report(time.monotonic())

    def _take(self, lines: bytes) -> None:
        self.data += lines
        now = time.monotonic()
        for line in self._reader.feed(lines):
            if not isinstance(line, RecordedRun):
                self.record.add(line)
                self._untold.append((now, line))

    def _report(self, now: float) -> None:
        """Inform the listeners of a line once its process is known: it may speak before it counts as started."""
        untold, self._untold = self._untold, []
        for since, line in untold:
            if self._has_origin(line) or now - since > _LONGEST_WAIT:
                for listener in self._listeners:
                    listener.added(line)
            else:
                self._untold.append((since, line))

    def _has_origin(self, line: Line) -> bool:
        if isinstance(line, RecordedRun | StartedProcess | LoadedComponent):
            return True
        process = self.record.process_of(line.pid)
        return process is not None and process.started is not None

    def _read_the_rest(self) -> None:
        try:
            self._read_new_lines()
        except OSError as error:
            self._lose(f"the end of the record of this launch cannot be read: {error}")

    def _lose(self, why: str) -> None:
        if why not in self._lost:
            self._lost.append(why)
            self.say_warning(why)

    def _not_recorded(self, process: str, why: str) -> None:
        if Unrecorded(process, why) not in self.unrecorded:
            self.unrecorded.append(Unrecorded(process, why))
            self.say_warning(f"{process} is not recorded: {why}")

    def _name_the_silent(self) -> None:
        if self._optional:
            return  # no caller relies on a complete record
        known = {item.process for item in self.unrecorded}
        for started in self.record.silent():
            if started.process not in known:
                why = "it never reported: it or what started it does not pass LD_PRELOAD on"
                self._not_recorded(started.process, why)
        for started in self.record.mute():
            if started.process not in known and started.kind != "executable":
                why = "it never called librcl: it is no ROS node, or has an rcl of its own"
                self._not_recorded(started.process, why)


def _started(process: ResolvedProcess, pid: int) -> StartedProcess:
    return StartedProcess(
        pid=pid,
        process=process.process_name,
        package=process.package or "",
        executable=process.executable,
        kind=process.kind,
        fqn=process.fqn or "",
        location=str(process.location),
        arguments=tuple(own_words(process)),
        rules=tuple(parse_ros_arguments(process.cmd).remaps),
        parameters=_plain(process.parameters),
    )


def _component(component: ResolvedComponent) -> LoadedComponent:
    rules = [f"{rule.source}:={rule.target}" for rule in component.remaps]
    rules += [f"__node:={component.name}"] if component.name else []
    rules += [f"__ns:={component.namespace}"] if component.namespace else []
    return LoadedComponent(
        container=component.container,
        package=component.package,
        plugin=component.plugin,
        name=component.name,
        namespace=component.namespace,
        location=str(component.location),
        rules=tuple(rules),
        parameters=_plain(component.parameters),
    )


def _plain(parameters: Mapping[str, object]) -> dict[str, object]:
    """Return the values as JSON has them; byte strings, which are not names, are left out."""
    values = {name: value if isinstance(value, tuple) else (value,) for name, value in parameters.items()}
    return {name: parameters[name] for name in values if not any(isinstance(v, bytes) for v in values[name])}


class EndpointEvents(Listener):
    """Recorded endpoints as events of the launch, each with the process and component that requested it."""

    def added(self, line: Line) -> None:
        if not isinstance(line, EndpointMade):
            return
        process, node = self._recording.record.node_of(line)
        requested = requested_endpoint(process, node, line)
        if requested is None or process.started is None:
            return
        name, pid, endpoint = process.started.process, process.started.pid, _endpoint(requested, node, line)
        if requested.granted:
            self._launch.publish(EndpointCreated(name, pid, endpoint))
        else:
            self._launch.publish(EndpointRefused(name, pid, endpoint, requested.error))


def _endpoint(requested: RequestedEndpoint, node: RecordedNode, line: EndpointMade) -> EndpointRequested:
    component = f"{node.component.package}/{node.component.plugin}" if node.component else ""
    return EndpointRequested(
        node.fqn or line.fqn,
        requested.kind,
        requested.final or requested.written,
        requested.written,
        requested.type,
        component,
    )
