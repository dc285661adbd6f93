"""A plan as a review sees it: enclaves with their permissions, nodes with theirs, and the diagnostics of planning."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, NamedTuple

from enclave_launch.admission.middleware import ZENOH
from enclave_launch.dry_run import Component, Diagnostic, DryRun, Interface, Node, Operation, Process
from enclave_launch.policy.derivation import LIST_NAMES
from enclave_launch.process import UNSPECIFIED_NODE_NAMESPACE

OPERATIONS = tuple(LIST_NAMES.values())
Kind = Literal["topic", "service", "action"]
KIND_OF: Mapping[str, Kind] = {
    "publish": "topic",
    "subscribe": "topic",
    "call_services": "service",
    "serve_services": "service",
    "call_actions": "action",
    "serve_actions": "action",
}
"""The kind of name of each operation."""


class GrantedName(NamedTuple):
    """One permission: an operation on a final name, which may hold wildcards."""

    operation: Operation
    name: str

    def __str__(self) -> str:
        return f"{self.operation.replace('_', ' ')} {self.name}"


class NodeView(NamedTuple):
    """One node under its final name. ``own``: what it requests itself; ``built_in``: what every node has.

    ``unit``: the node that the launch file starts and of whose process this one is a helper; mostly the node itself.
    """

    fqn: str
    enclave: str
    program: str
    own: frozenset[GrantedName]
    built_in: frozenset[GrantedName]
    unit: str

    @property
    def grants(self) -> frozenset[GrantedName]:
        return self.own | self.built_in


_GAPS = frozenset({
    "no-manifest", "interface-unknown", "node-name-unknown", "parameters-unknown", "parameter-file-missing",
    "include-left-out", "not-foreseeable", "container-elsewhere",
})  # fmt: skip


class PlanDocument(NamedTuple):
    """A plan as a review reads it. ``enclaves``: path -> all that its middleware lets it do, the union of its nodes;
    ``on_zenoh``: those of which a process is on Zenoh."""

    enclaves: Mapping[str, frozenset[GrantedName]]
    nodes: tuple[NodeView, ...]
    diagnostics: tuple[Diagnostic, ...]
    on_zenoh: frozenset[str] = frozenset()

    @property
    def gaps(self) -> frozenset[str]:
        """Return the programs, nodes and files of which something is not known: any name may be missing there."""
        return frozenset(each.subject for each in self.diagnostics if each.code in _GAPS)

    def nodes_of(self, enclave: str) -> tuple[NodeView, ...]:
        return tuple(node for node in self.nodes if node.enclave == enclave)

    def own(self, enclave: str) -> frozenset[GrantedName]:
        """Return what the nodes of the enclave request themselves."""
        return frozenset[GrantedName]().union(*(node.own for node in self.nodes_of(enclave)))

    def built_in(self, enclave: str) -> frozenset[GrantedName]:
        """Return what the nodes of the enclave have as every node, and none of them requests."""
        everywhere = (node.built_in for node in self.nodes_of(enclave))
        return frozenset[GrantedName]().union(*everywhere) - self.own(enclave)

    def units_of(self, enclave: str) -> dict[str, frozenset[GrantedName]]:
        """Return the requests of each node that the launch file starts, with those of the helpers in its process:
        the parts that could have an enclave of their own."""
        units: dict[str, frozenset[GrantedName]] = {}
        for node in self.nodes_of(enclave):
            units[node.unit] = units.get(node.unit, frozenset()) | node.own
        return units


def plan_from_document(document: DryRun) -> PlanDocument:
    """Return what a review sees of a dry run."""
    return PlanDocument(
        {
            path: frozenset(GrantedName(each, name) for each in OPERATIONS for name in getattr(enclave, each))
            for path, enclave in document.enclaves.items()
        },
        tuple(_nodes(document)),
        tuple(document.diagnostics),
        frozenset(
            process.enclave
            for process in document.processes
            if process.enclave and process.middleware == ZENOH
        ),
    )


def _nodes(document: DryRun) -> Iterator[NodeView]:
    launched = {fqn_of(item) for item in document.launched}
    mains: dict[tuple[str, str], list[str]] = {}
    for node in document.nodes:
        if node.fqn in launched:
            mains.setdefault((node.enclave, node.program), []).append(node.fqn)
    for node in document.nodes:
        started_with = mains.get((node.enclave, node.program), [])
        is_helper = node.fqn not in launched and bool(started_with)
        yield NodeView(
            node.fqn,
            node.enclave,
            node.program,
            _grants(node, built_in=False),
            _grants(node, built_in=True),
            started_with[0] if is_helper else node.fqn,
        )


def fqn_of(item: Process | Component) -> str:
    """Return the final name of a process or component; empty if it has none."""
    return (item.fqn or "").replace(UNSPECIFIED_NODE_NAMESPACE, "")


def program_of(item: Process | Component) -> str:
    """Return ``package/executable`` of a process, ``package/plugin`` of a component."""
    return f"{item.package}/{item.executable if isinstance(item, Process) else item.plugin}"


def grant_of(interface: Interface) -> GrantedName:
    """Return the permission that an interface of a node needs."""
    return GrantedName(interface.operation, interface.name)


def _grants(node: Node, *, built_in: bool) -> frozenset[GrantedName]:
    return frozenset(grant_of(each) for each in node.interfaces if each.built_in is built_in)
