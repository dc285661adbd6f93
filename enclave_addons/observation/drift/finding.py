"""One difference between a plan and what runs, and how it is reported to people and to monitoring."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import Enum
from typing import Any, NamedTuple

from enclave_addons.observation.graph.model import Graph
from enclave_common.words import counted


class Kind(str, Enum):
    """The kind of difference; the value is stable, for programs."""

    UNPLANNED_PROCESS = "unplanned-process"
    UNPLANNED_NODE = "unplanned-node"
    UNPLANNED_ENDPOINT = "unplanned-endpoint"
    MISSING_NODE = "missing-node"
    MISSING_ENDPOINT = "missing-endpoint"
    REPEATED_NODE = "repeated-node"
    TYPE_DIFFERS = "type-differs"
    QOS_DIFFERS = "qos-differs"
    TYPES_DO_NOT_MEET = "types-do-not-meet"
    QOS_DOES_NOT_MEET = "qos-does-not-meet"
    NOT_SECURED = "not-secured"
    OTHER_CA = "other-ca"
    NOT_AUTHENTICATED = "not-authenticated"
    ENCLAVE_OF_ANOTHER = "enclave-of-another"
    STRANGER = "stranger"
    FORGED_LIST = "forged-list"
    OUT_OF_SIGHT = "out-of-sight"

    def __str__(self) -> str:
        return self.value


class Level(str, Enum):
    """The weight of a finding. ``CANNOT_TELL``: the observer does not see enough to compare. ``NOTE``: descriptions
    leave it open, so it may be as planned."""

    ALARM = "alarm"
    CANNOT_TELL = "cannot-tell"
    NOTE = "note"

    def __str__(self) -> str:
        return self.value


class FindingCertainty(Enum):
    """The time at which a finding may be reported: discovery comes in pieces."""

    FACT = "what was announced says so"
    WHEN_SETTLED = "unless more is discovered"
    ABSENCE = "unless it comes later"


class DriftFinding(NamedTuple):
    """One difference between plan and running system. ``subject``: the node or participant it is about, ``name`` the
    topic, service or action; ``who``: where it was seen, for a person (a pid, a host). Two findings with one
    ``key`` are the same at two times."""

    kind: Kind
    subject: str
    name: str
    text: str
    certainty: FindingCertainty = FindingCertainty.FACT
    level: Level = Level.ALARM
    enclave: str = ""
    who: str = ""
    remedy: str = ""

    @property
    def key(self) -> tuple[str, str, str, str]:
        return (self.kind.value, self.subject, self.name, self.text)


_CERTAINTY = {
    Kind.UNPLANNED_PROCESS: FindingCertainty.WHEN_SETTLED,
    Kind.NOT_AUTHENTICATED: FindingCertainty.ABSENCE,
    Kind.REPEATED_NODE: FindingCertainty.WHEN_SETTLED,
    Kind.MISSING_NODE: FindingCertainty.ABSENCE,
    Kind.MISSING_ENDPOINT: FindingCertainty.ABSENCE,
    Kind.OUT_OF_SIGHT: FindingCertainty.ABSENCE,
}
"""Of the kinds that discovery could still take back: nodes are named after participants, and who was killed is there
until its lease ends (10 s on Cyclone DDS, 20 s on Fast DDS), so that a respawned process overlaps with it."""


def finding(
    kind: Kind, subject: str, text: str, *, name: str = "", enclave: str = "", who: str = "", remedy: str = ""
) -> DriftFinding:
    """Make an alarm, with the certainty that its kind has."""
    certainty = _CERTAINTY.get(kind, FindingCertainty.FACT)
    return DriftFinding(kind, subject, name, text, certainty, Level.ALARM, enclave, who, remedy)


def finding_text(finding: DriftFinding) -> str:
    """Return the finding in one line."""
    who = f" ({finding.who})" if finding.who and finding.who != finding.subject else ""
    subject = f"{finding.subject}: " if finding.subject == finding.who else ""
    remedy = f"; {finding.remedy}" if finding.remedy else ""
    return f"{finding.level}: {finding.kind}: {subject}{finding.text}{who}{remedy}"


def drift_text(findings: Sequence[DriftFinding], graph: Graph) -> str:
    """Return a report: what is different, alarms first, and what was compared."""
    levels = list(Level)
    ordered = sorted(findings, key=lambda each: (levels.index(each.level), each.kind.value, each.subject))
    seen = f"{len(graph.processes)} participants, {sum(1 for _ in graph.nodes)} nodes"
    alarms = sum(each.level is Level.ALARM for each in findings)
    if alarms:
        summary = counted(alarms, "alarm")
    elif any(each.level is Level.CANNOT_TELL for each in findings):
        summary = "cannot tell whether it is as planned"
    else:
        summary = "as planned"
    return "\n".join([*map(finding_text, ordered), f"{summary}; seen: {seen}"]) + "\n"


def drift_document(findings: Iterable[DriftFinding], graph: Graph) -> dict[str, Any]:
    """Build the JSON document. ``drift``: there is an alarm; ``complete``: nothing was out of the observer's sight."""
    rows = [finding_document(each) for each in findings]
    return {
        "version": 1,
        "drift": any(row["level"] == Level.ALARM.value for row in rows),
        "complete": all(row["level"] != Level.CANNOT_TELL.value for row in rows),
        "participants": len(graph.processes),
        "nodes": sorted(node.fqn for node in graph.nodes),
        "findings": rows,
    }


def finding_document(finding: DriftFinding) -> dict[str, Any]:
    """Return the finding as plain values."""
    fields = finding._asdict()
    del fields["certainty"]
    return {**fields, "kind": finding.kind.value, "level": finding.level.value}
