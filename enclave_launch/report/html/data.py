"""What the page's script draws, searches and shows on a click, as plain values.

Names are made printable here, once, so that the script shows what the tables show.
"""

from __future__ import annotations

from typing import Any

from enclave_launch.boundary.terminal import printable
from enclave_launch.report.graph import OUTWARD, ChannelUse, EnclaveGraph, evidence_text


def graph_data(graph: EnclaveGraph) -> dict[str, Any]:
    """Lists of the graph's elements; they refer to each other by number."""
    return {
        "enclaves": [printable(path) for path in graph.enclaves],
        "members": [
            {
                "name": printable(member.name),
                "enclave": printable(member.enclave),
                "namespace": printable(member.namespace),
                "program": printable(member.program),
                "place": printable(member.launched_at),
                "known": member.known,
            }
            for member in graph.members
        ],
        "channels": [
            {
                "kind": channel.kind,
                "name": printable(channel.name),
                "types": [printable(one) for one in channel.types],
                "pattern": channel.is_pattern,
            }
            for channel in graph.channels
        ],
        "uses": [_use(use) for use in graph.uses],
    }


def _use(use: ChannelUse) -> dict[str, Any]:
    return {
        "member": use.member,
        "enclave": printable(use.enclave),
        "channel": use.channel,
        "operation": use.operation.replace("_", " "),
        "out": use.operation in OUTWARD,
        "builtIn": use.built_in,
        "why": list(dict.fromkeys(printable(evidence_text(reason)) for reason in use.reasons)),
    }
