"""Observe a running ROS system: its graph, or manifests or a policy of what runs.

Looks at the DDS domain until nothing has changed for a while, and prints what was seen. With -o it writes manifests:
names are traced back through namespace, remap rules and parameters to what the source writes. How each node was
started is taken from a launch file (or the JSON of its dry run), else from the command lines of this machine's
processes.

exit status: 0 something was seen, 1 nothing was, or the domain cannot be observed, 2 wrong usage
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterable, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from enclave_addons.observation.graph.json_form import graph_document
from enclave_addons.observation.graph.model import Graph, GraphNode, GraphProcess
from enclave_addons.observation.graph.observation import Observed, command_lines, observed_text, read_observed
from enclave_addons.observation.graph.observing import Quiet, Where, in_own_process, observe_until, observer
from enclave_addons.observation.graph.sources import learn_observed
from enclave_addons.observation.graph.starts import starts_of_plan
from enclave_addons.observation.graph.text import graph_text
from enclave_addons.recording.record.lines import RecordedRun
from enclave_addons.recording.record.manifest import OBSERVED_HEAD, manifest_file_name, manifest_text
from enclave_addons.recording.record.requested import StartedNode
from enclave_common.command_line import FLAG, PATH, TEXT, TIME, Option, one_of
from enclave_common.environment import domain_id
from enclave_common.files import write_text
from enclave_common.terminal import json_text, printable
from enclave_common.words import counted
from nodl.errors import NoDLError
from nodl.names import split_fqn
from nodl.node_interface import EndpointKind
from nodl.verb import write_documents

_HIGHEST_DOMAIN = 232  # beyond, there are no ports (DDS-RTPS 9.6.1)


def domain(text: str) -> int:
    """Parse a DDS domain of the command line, 0 to 232; raises ``ValueError``."""
    number = int(text)
    if not 0 <= number <= _HIGHEST_DOMAIN:
        raise ValueError
    return number


OPTIONS: tuple[Option, ...] = (
    ("runs RUN.json", {**PATH, "nargs": "*"}, "earlier observations, merged with this one"),
)
LOOKING: tuple[Option, ...] = (
    ("--domain-id N", {"type": domain}, "default: ROS_DOMAIN_ID, else 0"),
    ("--for TIME", {**TIME, "dest": "longest", "default": 60.0}, "at the longest (60s)"),
    ("--settle TIME", {**TIME, "default": 5.0}, "end when nothing changed for this long (5s)"),
    ("--with", {**one_of("auto", "cyclonedds", "rclpy"), "dest": "source"},
     "what to look with: Cyclone DDS's Python binding (sees processes and more) or rclpy"),
    ("--merge-only", FLAG, "look at nothing; merge the observations that are named"),
)  # fmt: skip
SECURITY: tuple[Option, ...] = (
    ("--keystore DIR", PATH, "default: ROS_SECURITY_KEYSTORE"),
    ("--enclave NAME", TEXT,
     "the observer's own (secure-keystore tool-enclave KEYSTORE --for observe makes one); "
     "default: ROS_SECURITY_ENCLAVE_OVERRIDE"),
)  # fmt: skip
WRITING: tuple[Option, ...] = (
    ("--launch WORD", {"nargs": "+", "default": []},
     "how the nodes were started: PLAN.json, or PACKAGE LAUNCH_FILE | PATH [name:=value ...]"),
    ("--save RUN.json", PATH, "save this observation, to merge it later"),
    ("--format", {"choices": ("text", "json", "policy", "v2")}, "text (default); with -o: v2, NoDL manifests"),
    ("-o --output DIR", PATH, "write files into DIR"),
)  # fmt: skip
SECTIONS = {"what to observe": LOOKING, "a secured system": SECURITY, "what to write": WRITING}


def run(arguments: argparse.Namespace) -> int:
    """Print what was seen. Returns 1 when nothing was, 2 for wrong usage."""
    if arguments.merge_only and not arguments.runs:
        print("secure-nodl observe: --merge-only needs observations to merge", file=sys.stderr)
        return 2
    runs = [read_observed(path) for path in arguments.runs]
    if not arguments.merge_only:
        starts = _starts(arguments.launch)
        now = in_own_process(lambda: _observe(arguments, starts))
        if arguments.save is not None:
            write_text(arguments.save, observed_text(now))
        runs.append(now)
    chosen = arguments.format or ("v2" if arguments.output else "text")
    documents = _documents(chosen, runs, arguments.output)
    if arguments.output:
        write_documents(arguments.output, documents)
    else:
        sys.stdout.write("".join(documents.values()))
    seen = any(True for each in runs for _ in each.graph.nodes)
    if not seen:
        print(f"secure-nodl observe: no node was seen; {_nothing_seen(runs)}", file=sys.stderr)
    return 0 if seen else 1


def _observe(arguments: argparse.Namespace, starts: tuple[StartedNode, ...]) -> Observed:
    directory = _enclave_directory(arguments)
    where = Where(_domain_id(arguments), arguments.source, directory)
    commands: dict[str, tuple[str, ...]] = {}
    with observer(where, os.environ) as up:
        quiet = Quiet(up, arguments.settle, arguments.longest)

        def done() -> bool:
            commands.update(command_lines(up.graph(), socket.gethostname()))
            return quiet()

        observe_until(up, done)
        graph = up.graph(past=True)
    date = datetime.now(timezone.utc)
    run = RecordedRun(
        f"{date:%Y%m%dT%H%M%S}-{os.urandom(3).hex()}",
        launch_file=" ".join(arguments.launch),
        distro=os.environ.get("ROS_DISTRO", ""),
        date=f"{date:%Y-%m-%d}",
        secured=directory is not None,
    )
    return Observed(run, graph, commands, starts)


def _documents(chosen: str, runs: Sequence[Observed], folder: Path | None) -> dict[str, str]:
    if chosen == "v2":
        return _manifests(runs, folder)
    if chosen == "policy":
        return {"policy.xml": observed_policy(each.graph for each in runs)}
    last: Graph = runs[-1].graph
    if chosen == "json":
        return {"graph.json": json_text(graph_document(last), indent=2) + "\n"}
    return {"graph.txt": graph_text(last)}


def _manifests(runs: Sequence[Observed], folder: Path | None) -> dict[str, str]:
    found = learn_observed(runs)
    documents: dict[str, str] = {}
    for node in found.learnt.nodes:
        alone = sum(each.program == node.program for each in found.learnt.nodes) == 1
        name = manifest_file_name(node, alone)
        path = folder / name if folder else None
        before = path.read_text(encoding="utf-8") if path is not None and path.exists() else ""
        documents[name] = manifest_text(node, before, OBSERVED_HEAD)
    for text in (*found.left_out, *found.learnt.unforeseeable):
        print(printable(f"secure-nodl observe: left out: {text}"), file=sys.stderr)
    for node in found.learnt.nodes:
        for note in (*node.incomplete, *node.notes):
            which = f"{node.program}, {node.key.node or 'a node that the launch renames'}"
            print(printable(f"secure-nodl observe: {which}: {note}"), file=sys.stderr)
    return documents


def _starts(words: Sequence[str]) -> tuple[StartedNode, ...]:
    """Return what a plan or launch file starts; raises ``NoDLError`` for anything else, in the dry run's words."""
    if not words:
        return ()
    try:
        if len(words) == 1 and words[0].endswith(".json"):
            return starts_of_plan(json.loads(Path(words[0]).read_text(encoding="utf-8")))
        return starts_of_plan(_dry_run(words))
    except (KeyError, TypeError, ValueError) as error:
        what = " ".join(words)
        raise NoDLError(f"--launch {what}: not the JSON of secure-launch --dry-run: {error}") from error


def _dry_run(words: Sequence[str]) -> Any:
    """Run the dry run in a process of its own: this package knows no launch files."""
    command = [sys.executable, "-m", "enclave_launch", "--dry-run", "--format", "json", *words]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    if ran.returncode != 0:
        raise NoDLError(f"--launch {' '.join(words)}: {ran.stderr.strip()}")
    return json.loads(ran.stdout)


def _enclave_directory(arguments: argparse.Namespace) -> Path | None:
    secured = os.environ.get("ROS_SECURITY_ENABLE") == "true"
    keystore = arguments.keystore or (secured and os.environ.get("ROS_SECURITY_KEYSTORE"))
    enclave = arguments.enclave or (secured and os.environ.get("ROS_SECURITY_ENCLAVE_OVERRIDE"))
    if not keystore and not enclave:
        return None
    if not keystore or not enclave:
        raise NoDLError("a secured system needs both --keystore and --enclave")
    return Path(keystore).absolute() / "enclaves" / str(enclave).lstrip("/")


def _domain_id(arguments: argparse.Namespace) -> int:
    if arguments.domain_id is not None:
        return int(arguments.domain_id)
    text = os.environ.get("ROS_DOMAIN_ID", "")
    found = domain_id(text)
    if found is None or found > _HIGHEST_DOMAIN:
        raise NoDLError(f"ROS_DOMAIN_ID is {text!r}, not a number from 0 to {_HIGHEST_DOMAIN}")
    return found


def _nothing_seen(runs: Sequence[Observed]) -> str:
    others = sum(len(each.graph.processes) for each in runs)
    if others:
        return (
            f"{counted(others, 'participant')} discovered, but nothing of what they have: set "
            "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST if they use the loopback interface only; if the system is "
            "secured, give --keystore and --enclave, of an enclave of the same keystore"
        )
    return (
        "if nodes run in this domain (--domain-id), set ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST if they use the "
        "loopback interface only (as the demo does), else ROS_STATIC_PEERS or CYCLONEDDS_URI as they have it"
    )


# group, child, attribute, kind: in the order of the schema
_GROUPS = (
    ("topics", "topic", "publish", EndpointKind.PUBLISHER),
    ("topics", "topic", "subscribe", EndpointKind.SUBSCRIPTION),
    ("services", "service", "reply", EndpointKind.SERVICE_SERVER),
    ("services", "service", "request", EndpointKind.SERVICE_CLIENT),
    ("actions", "action", "execute", EndpointKind.ACTION_SERVER),
    ("actions", "action", "call", EndpointKind.ACTION_CLIENT),
)


def observed_policy(graphs: Iterable[Graph]) -> str:
    """Return an SROS2 policy (version 0.2.0) of what ``graphs`` show.

    Hidden nodes and half open interfaces are left out. All nodes of a participant share an enclave: the one that it
    announces, else one named after its first node.
    """
    enclaves: dict[str, dict[str, set[tuple[EndpointKind, str]]]] = {}
    for process in (process for graph in graphs for process in graph.processes):
        nodes = [node for node in process.nodes if not node.fqn.rpartition("/")[2].startswith("_")]
        for node in nodes:
            names = enclaves.setdefault(_enclave(process, nodes), {}).setdefault(node.fqn, set())
            names.update((each.kind, each.name) for each in node.interfaces if each.complete)
    policy = ElementTree.Element("policy", version="0.2.0")
    listed = ElementTree.SubElement(policy, "enclaves")
    for path, found in sorted(enclaves.items()):
        enclave = ElementTree.SubElement(listed, "enclave", path=path)
        profiles = ElementTree.SubElement(enclave, "profiles")
        for fqn, names in sorted(found.items()):
            _add_profile(profiles, *split_fqn(fqn), names)
    ElementTree.indent(policy)
    text = ElementTree.tostring(policy, encoding="unicode", short_empty_elements=False)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _enclave(process: GraphProcess, nodes: list[GraphNode]) -> str:
    announced = process.participant.enclave
    return announced if announced not in ("", "/") else min(node.fqn for node in nodes)


def _add_profile(
    profiles: ElementTree.Element, namespace: str, name: str, names: Iterable[tuple[EndpointKind, str]]
) -> None:
    profile = ElementTree.SubElement(profiles, "profile", ns=namespace, node=name)
    for group, child, attribute, kind in _GROUPS:
        of_kind = sorted(each for its_kind, each in names if its_kind is kind)
        if of_kind:
            listed = ElementTree.SubElement(profile, group, {attribute: "ALLOW"})
            for each in of_kind:
                ElementTree.SubElement(listed, child).text = each
