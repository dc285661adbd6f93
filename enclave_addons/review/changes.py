"""Compare two plans: the differences, and whether anybody may do more than before. Performs no I/O.

Read as a review reads it: enclaves and nodes that came and went, nodes that moved to another enclave, permissions of
each enclave that were added and removed, and the flows between enclaves that this opens or closes.
"""

from __future__ import annotations

from typing import NamedTuple

from enclave_addons.review.document import GrantedName, PlanDocument
from enclave_addons.review.information_flow import FlowGraph, flow_graph


class EnclaveChange(NamedTuple):
    """The differences of one enclave. ``added`` and ``removed`` are sorted; ``built_in``: those among them that every
    node has and none requests.

    ``is_new`` and ``is_gone``: the enclave as a whole.
    """

    enclave: str
    added: tuple[GrantedName, ...]
    removed: tuple[GrantedName, ...]
    built_in: frozenset[GrantedName]
    is_new: bool = False
    is_gone: bool = False


class Move(NamedTuple):
    """A node that runs in another enclave than before, or an enclave on another middleware."""

    node: str
    before: str
    after: str


class Changes(NamedTuple):
    """Everything sorted. ``flows_*``: pairs of enclaves of which the first can influence the second directly;
    ``middlewares``: enclaves that moved from DDS to Zenoh or back;
    ``as_installed``: packages that were not compared, since both plans took them as they are installed;
    ``unknown``: programs and nodes whose interfaces one of the plans does not wholly know."""

    enclaves: tuple[EnclaveChange, ...]
    nodes_added: tuple[str, ...]
    nodes_removed: tuple[str, ...]
    moved: tuple[Move, ...]
    flows_added: tuple[tuple[str, str], ...]
    flows_removed: tuple[tuple[str, str], ...]
    middlewares: tuple[Move, ...] = ()
    as_installed: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()

    @property
    def rights_grew(self) -> bool:
        """Return True if some enclave may do something that it could not do before; a new enclave is all new rights."""
        return any(change.added for change in self.enclaves)

    @property
    def is_empty(self) -> bool:
        return not any(self._replace(as_installed=(), unknown=()))


def changes(before: PlanDocument, after: PlanDocument) -> Changes:
    """Compare two plans: rights of enclaves, nodes, their enclaves, direct flows."""
    homes_before = {node.fqn: node.enclave for node in before.nodes}
    homes_after = {node.fqn: node.enclave for node in after.nodes}
    edges_before, edges_after = _edges(flow_graph(before)), _edges(flow_graph(after))
    return Changes(
        tuple(_enclave_changes(before, after)),
        tuple(sorted(homes_after.keys() - homes_before.keys())),
        tuple(sorted(homes_before.keys() - homes_after.keys())),
        tuple(
            Move(node, homes_before[node], homes_after[node])
            for node in sorted(homes_before.keys() & homes_after.keys())
            if homes_before[node] != homes_after[node]
        ),
        tuple(sorted(edges_after - edges_before)),
        tuple(sorted(edges_before - edges_after)),
        tuple(
            Move(path, *(("Zenoh", "DDS") if path in before.on_zenoh else ("DDS", "Zenoh")))
            for path in sorted(before.on_zenoh ^ after.on_zenoh)
            if path in before.enclaves and path in after.enclaves
        ),
        unknown=tuple(sorted(before.gaps | after.gaps)),
    )


def _enclave_changes(before: PlanDocument, after: PlanDocument) -> list[EnclaveChange]:
    found = []
    for path in sorted(before.enclaves.keys() | after.enclaves.keys()):
        old, new = (plan.enclaves.get(path, frozenset()) for plan in (before, after))
        change = EnclaveChange(
            path,
            tuple(sorted(new - old)),
            tuple(sorted(old - new)),
            before.built_in(path) | after.built_in(path),
            is_new=path not in before.enclaves,
            is_gone=path not in after.enclaves,
        )
        if change.added or change.removed or change.is_new or change.is_gone:
            found.append(change)
    return found


def _edges(graph: FlowGraph) -> set[tuple[str, str]]:
    return {(source, target) for source, hops in graph.items() for target in hops}
