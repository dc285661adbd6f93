"""An observed graph → an SROS2 policy (version 0.2.0) of exactly what was seen, under final names. Performs no I/O.

DDS checks processes, so all nodes of a participant share an enclave: the one that the process announces, else (``/`` is
what rcl takes where nobody chose) one named after its first node. Names as the schema has them: ros2/sros2
``policy/schemas/policy.xsd``.
"""

from __future__ import annotations

from collections.abc import Iterable

from nodl.graph.model import Graph, GraphNode, GraphProcess
from nodl.names import split_fqn
from nodl.node_interface import EndpointKind
from nodl.policy_text import Names, policy_text, profile_lines

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
    return policy_text({path: _profiles(found) for path, found in sorted(enclaves.items())})


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
        lines += profile_lines(namespace, name, kinds)
    return lines
