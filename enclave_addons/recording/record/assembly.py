"""Lines of a record → processes, their nodes and endpoints, and what the launch started there. Performs no I/O.

A process of the record belongs to the process that the supervisor started if it is in its session, or if one of its
parents is: a shell or ``nice`` has another pid than the node behind it. Nodes of a container belong to the components
that the launch loads into it, by final name and, where names are equal, in the order of the requests. A node that
no request names is another one of a plugin that gave the same name of its own before (loaded by others), or was
made by the component before it, in its constructor (loads of one container run one after another), else by no
component.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from enclave_addons.recording.record.lines import (
    Complaint,
    Ended,
    EndpointMade,
    Initialised,
    Line,
    Loaded,
    LoadedComponent,
    NodeEnded,
    NodeMade,
    ParametersDeclared,
    RecordedRun,
    StartedProcess,
    StateEntered,
    read_lines,
)
from nodl.names import join, split_fqn


@dataclass(slots=True)
class RecordedNode:
    """One node of a process, under its number. ``made`` is ``None`` when the record has lost its line."""

    number: int
    made: NodeMade | None = None
    endpoints: list[EndpointMade] = field(default_factory=list)
    states: list[str] = field(default_factory=list)
    declared: dict[str, object] = field(default_factory=dict)
    ended: bool = False
    component: LoadedComponent | None = None

    @property
    def fqn(self) -> str:
        """Return the final name; empty for a node that could not be made."""
        if self.made is not None and self.made.fqn:
            return self.made.fqn
        return next((endpoint.fqn for endpoint in self.endpoints if endpoint.fqn), "")


@dataclass(slots=True)
class RecordedProcess:
    """One program in one process; ``started`` is ``None`` if no line says who started it."""

    loaded: Loaded | None
    pid: int
    nodes: dict[int, RecordedNode] = field(default_factory=dict)
    initialised: Initialised | None = None
    ended: bool = False
    started: StartedProcess | None = None

    def node(self, number: int) -> RecordedNode:
        return self.nodes.setdefault(number, RecordedNode(number))


class Record:
    """Takes lines one by one, as they come, and answers at any time."""

    def __init__(self, lines: Iterable[Line] = (), complaints: Sequence[Complaint] = ()) -> None:
        self.run = RecordedRun("")
        self.components: list[LoadedComponent] = []
        self.complaints = list(complaints)
        self.processes: list[RecordedProcess] = []
        self._current: dict[int, RecordedProcess] = {}
        self._loaded: dict[int, Loaded] = {}
        self._started: dict[int, StartedProcess] = {}
        for line in lines:
            self.add(line)

    @property
    def started(self) -> tuple[StartedProcess, ...]:
        """Return all processes of the launch that the supervisor named."""
        return tuple(self._started.values())

    def add(self, line: Line) -> None:
        if isinstance(line, Loaded):
            self._loaded[line.pid] = line
            self._begin(line.pid, line)
        elif isinstance(line, RecordedRun):
            self.run = line
        elif isinstance(line, StartedProcess):
            self._started[line.pid] = line
        elif isinstance(line, LoadedComponent):
            self.components.append(line)
        else:
            self._add_to_process(line)

    def process_of(self, pid: int) -> RecordedProcess | None:
        """Return the program that runs in process ``pid`` now, with what the launch started there."""
        process = self._current.get(pid)
        if process is not None and process.started is None:
            process.started = self._origin(pid)
        return process

    def node_of(self, line: EndpointMade | NodeMade) -> tuple[RecordedProcess, RecordedNode]:
        """Return where a line that was added belongs."""
        process = self.process_of(line.pid)
        assert process is not None, "the line was added"
        node = process.node(line.node)
        self._match_components(process)
        return process, node

    def attributed(self) -> list[RecordedProcess]:
        """Return all processes that use ROS, each with what started it."""
        for process in self.processes:
            process.started = process.started or self._origin(process.pid)
            self._match_components(process)
        return [process for process in self.processes if process.initialised or process.nodes]

    def silent(self) -> list[StartedProcess]:
        """Return processes of the launch from which nothing was heard: the recorder is in none of their programs."""
        heard = {origin.pid for pid in self._loaded if (origin := self._origin(pid))}
        return [started for pid, started in self._started.items() if pid not in heard]

    def mute(self) -> list[StartedProcess]:
        """Return recorded processes that never called rcl: no ROS, or a copy of librcl of their own."""
        speaking = {p.started.pid for p in self.attributed() if p.started is not None}
        unheard = {started.pid for started in self.silent()}
        return [s for pid, s in self._started.items() if pid not in speaking and pid not in unheard]

    def _begin(self, pid: int, loaded: Loaded | None) -> RecordedProcess:
        process = RecordedProcess(loaded, pid)
        self._current[pid] = process
        self.processes.append(process)
        return process

    def _add_to_process(
        self,
        line: Initialised | NodeMade | NodeEnded | StateEntered | ParametersDeclared | EndpointMade | Ended,
    ) -> None:
        process = self._current.get(line.pid) or self._begin(line.pid, None)
        if isinstance(line, Initialised):
            process.initialised = line
        elif isinstance(line, Ended):
            process.ended = True
        elif isinstance(line, NodeMade):
            process.node(line.node).made = line
        elif isinstance(line, NodeEnded):
            process.node(line.node).ended = True
        elif isinstance(line, StateEntered):
            process.node(line.node).states.append(line.state)
        elif isinstance(line, ParametersDeclared):
            process.node(line.node).declared.update(line.values)
        else:
            process.node(line.node).endpoints.append(line)

    def _origin(self, pid: int) -> StartedProcess | None:
        seen: set[int] = set()
        while pid not in seen:
            seen.add(pid)
            if pid in self._started:
                return self._started[pid]
            loaded = self._loaded.get(pid)
            if loaded is None:
                return None
            if loaded.session in self._started:
                return self._started[loaded.session]
            pid = loaded.parent
        return None

    def _match_components(self, process: RecordedProcess) -> None:
        container = process.started.fqn if process.started else ""
        if process.started is None or process.started.kind != "container":
            return
        taken = {id(node.component) for node in process.nodes.values() if node.component}
        before: RecordedNode | None = None
        for node in process.nodes.values():
            if node.component is None and node.fqn and node.fqn != container:
                node.component = self._component(node, container, taken) or _maker(node, before, process)
                taken.add(id(node.component))
            before = node if node.component is not None else before

    def _component(self, node: RecordedNode, container: str, taken: set[int]) -> LoadedComponent | None:
        """Return the first request with this name; a plugin may have been loaded twice under one."""
        requested = [item for item in self.components if _is(item.container, container) and _made(item, node)]
        named = [item for item in requested if item.name]
        return next((item for item in requested if id(item) not in taken), named[-1] if named else None)


_CONSTRUCTION = 2_000_000_000
"""Nanoseconds from a component's own node to the last one that its constructor makes."""


def _maker(
    node: RecordedNode, before: RecordedNode | None, process: RecordedProcess
) -> LoadedComponent | None:
    if node.made is None:
        return None
    for other in process.nodes.values():
        if other.component is not None and other.made is not None and other.made.name == node.made.name:
            return other.component
    if before is None or before.made is None:
        return None
    in_time = 0 <= node.made.at - before.made.at <= _CONSTRUCTION
    return before.component if in_time and node.made.thread == before.made.thread else None


def read_record(text: bytes) -> Record:
    """Read the whole of a record; what was lost is in ``complaints``."""
    lines, complaints = read_lines(text)
    return Record(lines, complaints)


def _is(container: str, fqn: str) -> bool:
    """Return True if both are one name; a target is taken as it is written, and its leading slash may be left out."""
    return "/" + container.lstrip("/") == fqn


def _made(component: LoadedComponent, node: RecordedNode) -> bool:
    namespace, name = split_fqn(node.fqn)
    own_name = node.made.name if node.made else name
    own_namespace = node.made.namespace if node.made else ""
    expected_namespace = component.namespace or "/" + own_namespace.lstrip("/")
    return join(_absolute(expected_namespace), component.name or own_name) == join(namespace, name)


def _absolute(namespace: str) -> str:
    return "/" + namespace.strip("/")
