"""Show what NoDL says about a document, a whole package, or some executables or plugins of it."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Iterator

from enclave_common.command_line import TEXT, Option, one_of
from enclave_common.terminal import json_text, printable
from nodl.ament_index import search_prefixes
from nodl.document import read_document
from nodl.lookup import ManifestLookup
from nodl.node_interface import EndpointKind, NodeInterface
from nodl.verb import PREFIX

_LABELS = {
    EndpointKind.PUBLISHER: "publishes",
    EndpointKind.SUBSCRIPTION: "subscribes",
    EndpointKind.SERVICE_SERVER: "serves",
    EndpointKind.SERVICE_CLIENT: "calls",
    EndpointKind.ACTION_SERVER: "serves action",
    EndpointKind.ACTION_CLIENT: "calls action",
}


OPTIONS: tuple[Option, ...] = (
    ("subject PACKAGE|FILE", TEXT, "an installed package or a document"),
    ("names EXECUTABLE|PLUGIN", {"nargs": "*"}, "only these of the package"),
    ("--format", one_of("text", "json"), "how to print (text)"),
    PREFIX,
)


def run(arguments: argparse.Namespace) -> int:
    """Print the interfaces. Returns 1 when one is missing."""
    prefixes = search_prefixes(arguments.prefix)
    missing: list[str] = []
    if os.path.isfile(arguments.subject):
        nodes = [node.interface for node in read_document(arguments.subject, prefixes=prefixes)]
    else:
        nodes, missing = _of_package(ManifestLookup(prefixes), arguments.subject, arguments.names)
    if arguments.format == "json":
        print(json_text([_plain(node) for node in nodes], indent=2))
    elif nodes:
        print("\n".join(printable(line) for node in nodes for line in description_lines(node)))
    for text in missing:
        print(text, file=sys.stderr)
    return 1 if missing or not nodes else 0


def _of_package(
    lookup: ManifestLookup, package: str, names: Iterable[str]
) -> tuple[list[NodeInterface], list[str]]:
    wanted = list(names)
    if not wanted:
        everything = lookup.all_of(package)
        missing = f"no NoDL of package {package}; looked at {', '.join(everything.searched)}"
        return list(everything.found), [] if everything else [missing]
    kinds = (("plugin" if "::" in name else "executable", name) for name in wanted)
    results = [(name, lookup.find(package, **{kind: name})) for kind, name in kinds]
    none = ((name, ", ".join(result.searched)) for name, result in results if not result)
    nodes = [node for _, result in results for node in result.found]
    return nodes, [f"no NoDL for {package}/{name}; looked at {searched}" for name, searched in none]


def description_lines(node: NodeInterface) -> Iterator[str]:
    """Render one node as text: its names, then a line for each endpoint, then its parameters."""
    program = node.executable or node.plugin or "?"
    where = f"{node.package}/{program}" if node.package else program
    namespace = f" in {node.namespace}" if node.namespace else ""
    yield f"node {node.name or '(name not given)'}{namespace}, run by {where}  ({node.source})"
    for endpoint in node.endpoints:
        name = endpoint.written or str(endpoint.name)
        yield f"  {_LABELS[endpoint.kind]:14} {name}  {endpoint.type}  ({endpoint.source})"
    if node.parameters:
        yield f"  {'parameters':14} {', '.join(node.parameters)}"
    for gap in node.gaps:
        yield f"  {'not known':14} {gap.why}  ({gap.source})"


def _plain(node: NodeInterface) -> dict[str, object]:
    return {
        "package": node.package,
        "executable": node.executable,
        "plugin": node.plugin,
        "name": node.name,
        "namespace": node.namespace,
        "library": node.library.value,
        "lifecycle": node.lifecycle,
        "source": str(node.source),
        "parameters": list(node.parameters),
        "endpoints": [
            {
                "kind": endpoint.kind.value,
                "name": endpoint.written or str(endpoint.name),
                "type": endpoint.type,
                "source": str(endpoint.source),
            }
            for endpoint in node.endpoints
        ],
    }
