"""An observed graph → an SROS2 policy (version 0.2.0) of exactly what was seen, under final names. Performs no I/O.

All nodes of a participant share an enclave: the one that it announces, else one named after its first node."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.sax.saxutils import escape, quoteattr

from nodl.graph.model import Graph, GraphNode, GraphProcess
from nodl.names import split_fqn
from nodl.node_interface import EndpointKind

Names = Mapping[EndpointKind, Iterable[str]]

# group, child, attribute, kind: in the order of the schema
_GROUPS = (
    ("topics", "topic", "publish", EndpointKind.PUBLISHER),
    ("topics", "topic", "subscribe", EndpointKind.SUBSCRIPTION),
    ("services", "service", "reply", EndpointKind.SERVICE_SERVER),
    ("services", "service", "request", EndpointKind.SERVICE_CLIENT),
    ("actions", "action", "execute", EndpointKind.ACTION_SERVER),
    ("actions", "action", "call", EndpointKind.ACTION_CLIENT),
)
Enclaves = dict[str, dict[str, dict[EndpointKind, set[str]]]]


def observed_policy(graphs: Iterable[Graph]) -> str:
    """Return the union of all ``graphs``; hidden nodes and half open interfaces are left out."""
    enclaves: Enclaves = {}
    for graph in graphs:
        for process in graph.processes:
            nodes = [node for node in process.nodes if not _hidden(node)]
            if nodes:
                profiles = enclaves.setdefault(_enclave(process, nodes), {})
                for node in nodes:
                    _add(profiles.setdefault(node.fqn, {}), node)
    return _policy_text({path: _profiles(found) for path, found in sorted(enclaves.items())})


def _enclave(process: GraphProcess, nodes: list[GraphNode]) -> str:
    announced = process.participant.enclave
    return announced if announced not in ("", "/") else min(node.fqn for node in nodes)


def _hidden(node: GraphNode) -> bool:
    return node.fqn.rpartition("/")[2].startswith("_")


def _add(names: dict[EndpointKind, set[str]], node: GraphNode) -> None:
    for interface in node.interfaces:
        if interface.complete:
            names.setdefault(interface.kind, set()).add(interface.name)


def _profiles(found: dict[str, dict[EndpointKind, set[str]]]) -> list[str]:
    lines: list[str] = []
    for fqn, names in sorted(found.items()):
        namespace, name = split_fqn(fqn)
        kinds: Names = names
        lines += _profile_lines(namespace, name, kinds)
    return lines


def _policy_text(enclaves: Mapping[str, Iterable[str]]) -> str:
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<policy version="0.2.0">', "  <enclaves>"]
    for path, profiles in enclaves.items():
        lines += [f"    <enclave path={quoteattr(path)}>", "      <profiles>", *profiles]
        lines += ["      </profiles>", "    </enclave>"]
    return "\n".join([*lines, "  </enclaves>", "</policy>", ""])


def _profile_lines(namespace: str, node: str, names: Names) -> list[str]:
    lines = [f"        <profile ns={quoteattr(namespace)} node={quoteattr(node)}>"]
    for group, child, attribute, kind in _GROUPS:
        of_kind = sorted(set(names.get(kind, ())))
        if of_kind:
            lines.append(f'          <{group} {attribute}="ALLOW">')
            lines += [f"            <{child}>{escape(name)}</{child}>" for name in of_kind]
            lines.append(f"          </{group}>")
    return [*lines, "        </profile>"]
