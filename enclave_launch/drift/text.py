"""Findings for people and for monitoring. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from enclave_launch.boundary.words import counted
from enclave_launch.drift.finding import DriftFinding, Level
from nodl.graph.model import Graph

VERSION = 1


def finding_text(finding: DriftFinding) -> str:
    """One line."""
    who = f" ({finding.who})" if finding.who and finding.who != finding.subject else ""
    subject = f"{finding.subject}: " if finding.subject == finding.who else ""
    remedy = f"; {finding.remedy}" if finding.remedy else ""
    return f"{finding.level}: {finding.kind}: {subject}{finding.text}{who}{remedy}"


def drift_text(findings: Sequence[DriftFinding], graph: Graph) -> str:
    """A report: what is different, alarms first, and what was looked at."""
    ordered = sorted(findings, key=lambda each: (each.level is Level.NOTE, each.kind.value, each.subject))
    seen = f"{len(graph.processes)} participants, {sum(1 for _ in graph.nodes)} nodes"
    alarms = sum(each.level is Level.ALARM for each in findings)
    summary = counted(alarms, "alarm") if alarms else "as planned"
    return "\n".join([*map(finding_text, ordered), f"{summary}; seen: {seen}"]) + "\n"


def drift_document(findings: Iterable[DriftFinding], graph: Graph) -> dict[str, Any]:
    """``drift`` is what the exit status says: whether there is an alarm."""
    rows = [finding_document(each) for each in findings]
    return {
        "version": VERSION,
        "drift": any(row["level"] == Level.ALARM.value for row in rows),
        "participants": len(graph.processes),
        "nodes": sorted(node.fqn for node in graph.nodes),
        "findings": rows,
    }


def finding_document(finding: DriftFinding) -> dict[str, Any]:
    """As plain values."""
    fields = finding._asdict()
    del fields["certainty"]
    return {**fields, "kind": finding.kind.value, "level": finding.level.value}
