"""A graph ⇄ JSON, by the announcements and lists that it is made of. Performs no I/O."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from enclave_addons.observation.graph.model import (
    Attribution,
    Graph,
    GraphNode,
    GraphProcess,
    SeenEndpoint,
    SeenInterface,
    SeenParticipant,
)
from enclave_addons.review.quality import Quality
from nodl.node_interface import EndpointKind

VERSION = 1


class NotAGraph(ValueError):
    """A document that is not what ``graph_document`` gives."""


def graph_document(graph: Graph) -> dict[str, Any]:
    """Return the graph as plain values."""
    return {"version": VERSION, "processes": [_process(each) for each in graph.processes]}


def graph_from_document(document: Any) -> Graph:
    """Return the graph of a document. Raises ``NotAGraph``."""
    try:
        if document["version"] != VERSION:
            raise NotAGraph(f"its version is {document['version']!r}, not {VERSION}")
        return Graph(tuple(_read_process(each) for each in document["processes"]))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, NotAGraph):
            raise
        raise NotAGraph(f"it is not a graph that was observed: {error!r}") from error


def _process(process: GraphProcess) -> dict[str, Any]:
    return {
        **process.participant._asdict(),
        "listed": process.listed,
        "gid_size": process.gid_size,
        "announced": process.announced,
        "nodes": [
            {"fqn": node.fqn, "ordinal": node.ordinal, "interfaces": [_interface(i) for i in node.interfaces]}
            for node in process.nodes
        ],
        "unowned": [_interface(each) for each in process.unowned],
        "foreign": [_endpoint(each) for each in process.foreign],
    }


def _interface(interface: SeenInterface) -> dict[str, Any]:
    return {
        "kind": interface.kind.value,
        "name": interface.name,
        "type": interface.type,
        "missing": list(interface.missing),
        "by": interface.by.value,
        "endpoints": [_endpoint(each) for each in interface.endpoints],
    }


def _endpoint(endpoint: SeenEndpoint) -> dict[str, Any]:
    return {**endpoint._asdict(), "quality": endpoint.quality._asdict()}


def _read_process(fields: Mapping[str, Any]) -> GraphProcess:
    participant = SeenParticipant(**{name: fields[name] for name in SeenParticipant._fields})
    int(participant.guid, 16)
    return GraphProcess(
        participant,
        tuple(
            GraphNode(str(node["fqn"]), tuple(map(_read_interface, node["interfaces"])), int(node["ordinal"]))
            for node in fields["nodes"]
        ),
        tuple(map(_read_interface, fields["unowned"])),
        tuple(map(_read_endpoint, fields["foreign"])),
        bool(fields["listed"]),
        int(fields["gid_size"]),
        bool(fields["announced"]),
    )


def _read_interface(fields: Mapping[str, Any]) -> SeenInterface:
    return SeenInterface(
        EndpointKind(fields["kind"]),
        str(fields["name"]),
        str(fields["type"]),
        tuple(map(_read_endpoint, fields["endpoints"])),
        tuple(map(str, fields["missing"])),
        Attribution(fields["by"]),
    )


def _read_endpoint(fields: Mapping[str, Any]) -> SeenEndpoint:
    return SeenEndpoint(**{**fields, "quality": Quality(**fields["quality"])})
