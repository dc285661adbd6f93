"""The access control matrix: one row for each permission of each enclave and each node that asks for it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from enclave_common.terminal import printable
from enclave_launch.report.graph import EnclaveGraph, evidence_text


class Row(NamedTuple):
    """``node`` is empty where only a policy file says so. ``built_in``: every node has it. ``enforced_by``: ``DDS`` by
    each participant, ``Zenoh`` by the router."""

    enclave: str
    node: str
    operation: str
    name: str
    types: str
    built_in: bool
    evidence: str
    enforced_by: str


def rows(graph: EnclaveGraph) -> Iterator[Row]:
    """Yield the rows in the graph's order."""
    for use in graph.uses:
        channel = graph.channels[use.channel]
        yield Row(
            use.enclave,
            "" if use.member is None else graph.members[use.member].name,
            use.operation,
            channel.name,
            " ".join(channel.types),
            use.built_in,
            " | ".join(dict.fromkeys(evidence_text(reason) for reason in use.reasons)) or "a policy file",
            graph.middlewares[use.enclave],
        )


def csv_text(found: Iterable[Row]) -> str:
    """Render with a heading; no cell begins like a formula (OWASP, "CSV Injection")."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(Row._fields)
    writer.writerows([_cell(value) for value in row] for row in found)
    return stream.getvalue()


def _cell(value: object) -> str:
    text = ("yes" if value else "no") if isinstance(value, bool) else printable(str(value))
    return f"'{text}" if text.startswith(("=", "+", "-", "@")) else text
