"""The attack surface: what other enclaves, others than the launch, and programs without an enclave can reach."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from enclave_launch.dry_run import DryRun
from enclave_launch.report.graph import NO_ENCLAVE, OUTWARD, ChannelUse, EnclaveGraph, plan_graph
from enclave_launch.review.document import plan_from_document
from enclave_launch.review.information_flow import flow_graph, opened_by_sharing, reached_from
from keystore.formats.permissions_patterns import can_meet


def surface_document(document: DryRun) -> dict[str, Any]:
    """Describe what each enclave exposes, from a dry run; interfaces that every node has are left out."""
    graph, plan = plan_graph(document), plan_from_document(document)
    flows = flow_graph(plan)
    return {
        "version": 1,
        "enclaves": {path: _enclave(graph, path) for path in graph.enclaves},
        "influences": {path: sorted(reached_from(flows, path)) for path in graph.enclaves},
        "only_by_sharing": [
            {"enclave": enclave, "from": one, "to": two} for enclave, one, two in opened_by_sharing(plan)
        ],
        "without_an_enclave": [
            {"program": member.name, "place": member.launched_at}
            for member in graph.members
            if member.enclave == NO_ENCLAVE
        ],
        "interfaces_unknown": [
            {"program": member.name, "enclave": member.enclave, "place": member.launched_at}
            for member in graph.members
            if not member.known and member.enclave != NO_ENCLAVE
        ],
        "domains": sorted({process.domain_id for process in document.processes}),
    }


def _enclave(graph: EnclaveGraph, enclave: str) -> dict[str, Any]:
    held = [use for use in graph.uses if use.enclave == enclave and not use.built_in]
    patterns = {graph.channels[use.channel].name for use in held if graph.channels[use.channel].is_pattern}
    return {"accepts": _accepted(graph, enclave, held), "wildcards": sorted(patterns)}


def _accepted(graph: EnclaveGraph, enclave: str, held: list[ChannelUse]) -> list[dict[str, Any]]:
    # ``sent_by``: enclaves of this launch that may send it; if empty, only processes outside of it could.
    coming_in = sorted({(use.operation, use.channel) for use in held if use.operation not in OUTWARD})
    return [
        {
            "operation": operation,
            "name": graph.channels[channel].name,
            "types": list(graph.channels[channel].types),
            "sent_by": sorted(_senders(graph, operation, graph.channels[channel].name) - {enclave}),
        }
        for operation, channel in coming_in
    ]


def _senders(graph: EnclaveGraph, operation: str, name: str) -> set[str]:
    return {
        use.enclave
        for use in graph.uses
        if use.operation == _SENT_BY[operation] and can_meet(graph.channels[use.channel].name, name)
    }


_SENT_BY: Mapping[str, str] = {
    "subscribe": "publish",
    "serve_services": "call_services",
    "serve_actions": "call_actions",
}
