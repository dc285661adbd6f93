"""One run that was observed: the graph, and how its nodes were started. Saved as JSON, so that runs can be merged."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from enclave_addons.observation.graph.json_form import NotAGraph, graph_document, graph_from_document
from enclave_addons.observation.graph.model import Graph, GraphProcess
from enclave_addons.recording.record.lines import RecordedRun
from enclave_addons.recording.record.requested import StartedNode
from nodl.errors import NoDLError


class ObservationError(NoDLError):
    """A file that holds no observation; says which and why."""


class Observed(NamedTuple):
    """One observed run. ``commands``: command lines by participant, of processes on the observer's machine.
    ``starts``: those of a launch file, where one was given."""

    run: RecordedRun
    graph: Graph
    commands: Mapping[str, tuple[str, ...]] = MappingProxyType({})
    starts: tuple[StartedNode, ...] = ()


def observed_text(observed: Observed) -> str:
    """Return a file that ``read_observed`` reads."""
    document = {
        "run": observed.run._asdict(),
        "graph": graph_document(observed.graph),
        "commands": {guid: list(words) for guid, words in observed.commands.items()},
        "starts": [{**each._asdict(), "parameters": dict(each.parameters)} for each in observed.starts],
    }
    return json.dumps(document, indent=1, default=str) + "\n"


def read_observed(path: Path) -> Observed:
    """Read a saved run. Raises ``ObservationError``, and ``OSError`` for a file that cannot be read."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        return Observed(
            RecordedRun(**document["run"]),
            graph_from_document(document["graph"]),
            {str(guid): tuple(map(str, words)) for guid, words in document["commands"].items()},
            tuple(map(_start, document["starts"])),
        )
    except (NotAGraph, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ObservationError(f"{path} is not what secure-nodl observe --save wrote: {error}") from error


def _start(fields: Mapping[str, Any]) -> StartedNode:
    lists = {name: tuple(map(str, fields[name])) for name in ("command", "rule_texts", "arguments")}
    return StartedNode(**{**fields, **lists, "parameters": dict(fields["parameters"])})


def command_lines(graph: Graph, host: str) -> dict[str, tuple[str, ...]]:
    """Return the commands of the participants on this machine that say their pid, by their GUIDs."""
    found = {}
    for process in graph.processes:
        words = _command_line(process, host)
        if words:
            found[process.participant.guid] = words
    return found


def _command_line(process: GraphProcess, host: str) -> tuple[str, ...]:
    participant = process.participant
    if participant.pid is None or participant.host not in ("", host):
        return ()
    try:
        raw = Path(f"/proc/{participant.pid}/cmdline").read_bytes()
    except OSError:
        return ()
    return tuple(word.decode(errors="replace") for word in raw.split(b"\0")[:-1])
