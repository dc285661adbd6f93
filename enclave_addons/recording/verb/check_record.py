"""Compare manifests, inference and the library with records of nodes that ran.

secure-launch --learn writes the records.

exit status: 0 nothing is missing or wrong, 1 something is, 2 a record cannot be used
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from enclave_addons.inference.executable import infer_executable
from enclave_addons.inference.reach import SourcesInReach
from enclave_addons.library import Library, LibraryDocuments
from enclave_addons.library.apply import applied, own_name
from enclave_addons.recording.record.assembly import read_record
from enclave_addons.recording.record.checking import Comparison, Verdict, compare
from enclave_addons.recording.record.requested import RequestedNode, all_requested
from enclave_common.command_line import PATH, PATHS, FromProject, Option, one_of
from nodl.ament_index import search_prefixes
from nodl.dependence import Situation
from nodl.lookup import ManifestLookup
from nodl.names import split_fqn
from nodl.node_interface import NodeInterface
from nodl.verb import PREFIX

_MOST_NODES = 32  # of one program: descriptions may refer to each other
JUDGED = ("manifest", "inference", "library")


OPTIONS: tuple[Option, ...] = (
    ("records RECORD", {**PATH, "nargs": "+"}, "files *.record, or folders"),
    ("--nodl FILE|DIR", {**PATHS, "configured": FromProject("nodl")}, "manifests to judge"),
    ("--judge", {"choices": (*JUDGED, "all"), "default": "all"},
     "what to compare: manifests, inference from source, the library, or all that describe the node"),
    ("--source DIR", {**PATHS, "configured": FromProject("source")},
     "sources of compiled nodes, for inference (repeatable; default: the workspaces of the prefixes)"),
    ("--format", one_of("text", "json"), "how to print (text)"),
    PREFIX,
)  # fmt: skip


class Judgement(NamedTuple):
    """The comparison of a node with one description. ``described_by``: one of ``JUDGED``; ``comparison`` ``None``: it
    says nothing of the node."""

    node: RequestedNode
    described_by: str
    comparison: Comparison | None
    why: str = ""


def run(arguments: argparse.Namespace) -> int:
    """Print how descriptions and record differ. Returns 1 when they do, 2 for wrong usage."""
    nodes, complaints = _recorded(_files(arguments.records))
    if not nodes:
        print(
            "secure-nodl check-record: error: no node of a known program is in these records", file=sys.stderr
        )
        return 2
    for text in complaints:
        print(f"the record is not complete: {text}", file=sys.stderr)
    prefixes = search_prefixes(arguments.prefix)
    known = _Known(ManifestLookup(prefixes, arguments.nodl), prefixes, tuple(map(str, arguments.source)))
    judges = JUDGED if arguments.judge == "all" else (arguments.judge,)
    judgements = [each for node in nodes for each in _judge(node, known, judges)]
    sys.stdout.write(_json(judgements) if arguments.format == "json" else _text(judgements))
    fits = all(each.comparison is not None and each.comparison.fits for each in _counted(judgements))
    return 0 if fits else 1


def never_seen(
    records: Iterable[Path], prefixes: Iterable[Path], sources: Iterable[Path]
) -> dict[str, tuple[str, ...]]:
    """Return, by node, the names that its source or the library has and no record shows; raises ``NoDLError``."""
    nodes, _ = _recorded(_files(records))
    known = _Known(ManifestLookup((), ()), search_prefixes(map(str, prefixes)), tuple(map(str, sources)))
    unseen: dict[str, dict[tuple[object, ...], str]] = {}
    for node in nodes:
        here: dict[tuple[object, ...], str] = {}
        for each in _judge(node, known, ("inference", "library")):
            who = "its source makes it" if each.described_by == "inference" else "the library has it"
            for difference in each.comparison.differences if each.comparison else ():
                if difference.verdict is Verdict.NEVER_SEEN and difference.kind:
                    kind = difference.kind.value.replace("_", " ")
                    said = f"{kind} {difference.name} ({who}: {difference.detail})"
                    here.setdefault((difference.kind, difference.detail), said)
        about = f"{node.start.program}, node {node.name}"
        before = unseen.get(about)  # what another run showed was seen
        unseen[about] = here if before is None else {key: before[key] for key in before if key in here}
    return {about: tuple(names.values()) for about, names in unseen.items() if names}


def _files(paths: Iterable[Path]) -> list[Path]:
    return [file for path in paths for file in (sorted(path.rglob("*.record")) if path.is_dir() else [path])]


def _recorded(files: Iterable[Path]) -> tuple[list[RequestedNode], list[str]]:
    nodes: list[RequestedNode] = []
    complaints: list[str] = []
    for file in files:
        record = read_record(file.read_bytes())
        nodes += [
            node._replace(distro=record.run.distro)
            for node in all_requested(record.attributed())
            if node.known_start and not node.container
        ]
        complaints += [f"{file}: {complaint.why}" for complaint in record.complaints]
    return nodes, complaints


class _Known(NamedTuple):
    lookup: ManifestLookup
    prefixes: tuple[str, ...]
    folders: tuple[str, ...]


def _judge(node: RequestedNode, known: _Known, judges: Iterable[str]) -> Iterable[Judgement]:
    for judge in judges:
        interfaces, why = _SAYS[judge](node, known)
        described = _at_this_start(node, interfaces)
        yield Judgement(node, judge, compare(node, described) if described else None, why)


def _described(node: RequestedNode, known: _Known) -> tuple[Sequence[NodeInterface], str]:
    found = known.lookup.find(
        node.start.package, executable=node.start.executable or None, plugin=node.start.plugin or None
    )
    return found.found, f"no manifest; looked at {', '.join(found.searched)}"


def _inferred(node: RequestedNode, known: _Known) -> tuple[Sequence[NodeInterface], str]:
    inferred = infer_executable(
        node.start.package,
        node.start.executable or None,
        node.start.plugin or None,
        prefixes=known.prefixes,
        sources=_sources(known.prefixes, known.folders),
        start_of=_RecordedStart(node),
    )
    return inferred.interfaces, inferred.why


class _RecordedStart(NamedTuple):
    node: RequestedNode

    def parameters(self, node: str | None) -> Mapping[str, object]:
        return self.node.start.parameters

    def final_name(self, node: str | None) -> tuple[str | None, str | None]:
        """Return the final name of the recorded node, or what the launch's rules make of another's."""
        namespace, name = split_fqn(self.node.fqn)
        if node is None or node == self.node.name:
            return name, namespace
        return self.node.start.rules.node_name(node).name, namespace

    def inputs(self, names: Iterable[str]) -> Mapping[str, str | None]:
        """Return nothing: a record does not say what the command line and the environment were."""
        return {}

    def words(self) -> tuple[str, ...] | None:
        """Return None, for the same reason."""
        return None


@lru_cache(maxsize=4)
def _sources(prefixes: tuple[str, ...], folders: tuple[str, ...]) -> SourcesInReach:
    return SourcesInReach(prefixes, folders)


def _of_library(node: RequestedNode, known: _Known) -> tuple[Sequence[NodeInterface], str]:
    hit = Library().find(node.start.package, node.start.plugin or node.start.executable, distro=node.distro)
    return ((), "the library has no document of it") if hit is None else ((hit.document.interface,), "")


def _at_this_start(node: RequestedNode, interfaces: Iterable[NodeInterface]) -> list[NodeInterface]:
    namespace, name = split_fqn(node.fqn)
    situation = Situation(node.distro, name, namespace, node.start.parameters, node.start.arguments)
    documents = LibraryDocuments(Library(), node.distro)
    found: list[NodeInterface] = []
    waiting = list(interfaces)
    while waiting and len(found) < _MOST_NODES:
        interface = waiting.pop(0)
        done = applied(interface._replace(name=own_name(interface, situation)), situation, documents)
        found.append(done.interface)
        waiting += done.further
    return found


_SAYS = {"manifest": _described, "inference": _inferred, "library": _of_library}


def _counted(judgements: Sequence[Judgement]) -> list[Judgement]:
    """Count a judge that says nothing of a node only if none of the others does."""
    speaks = {id(each.node) for each in judgements if each.comparison is not None}
    return [each for each in judgements if each.comparison is not None or id(each.node) not in speaks]


def _text(judgements: Sequence[Judgement]) -> str:
    lines: list[str] = []
    for node, judge, comparison, why in _counted(judgements):
        head = f"{node.fqn} ({node.start.program}), {judge}: "
        if comparison is None:
            lines.append(f"{head}{why}")
            continue
        lines.append(f"{head}{comparison.agreed} as recorded")
        lines += [f"  {difference}" for difference in comparison.differences]
    return "\n".join([*lines, ""])


def _json(judgements: Iterable[Judgement]) -> str:
    rows = [
        {
            "node": node.fqn,
            "program": node.start.program,
            "judged": judge,
            "says_something": comparison is not None,
            "agreed": comparison.agreed if comparison else 0,
            "differences": [
                {
                    "verdict": each.verdict.value,
                    "kind": each.kind.value if each.kind else None,
                    "name": each.name,
                    "detail": each.detail,
                }
                for each in (comparison.differences if comparison else ())
            ],
            "why": why if comparison is None else "",
        }
        for node, judge, comparison, why in judgements
    ]
    return json.dumps(rows, indent=2) + "\n"
