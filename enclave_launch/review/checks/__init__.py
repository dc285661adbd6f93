"""Checks of a plan beyond what planning itself reports; each is one function from a plan to findings.

rules.py       what each code means, and what to do about it
meetings.py    names, types and QoS of which two ends should meet and do not
enclaves.py    what an enclave holds: wildcards, sharing, permissions that nobody asks for, one name for two nodes
launched.py    what the launch file gives to its processes: remap rules, parameters, secrets, security variables
keystore.py    a plan held against what a keystore has signed

A finding has a stable code, a place where there is one, and what to do next.
"""

from __future__ import annotations

from enclave_launch.dry_run import DryRun
from enclave_launch.review.checks import enclaves, launched, meetings
from enclave_launch.review.checks.rules import MEANINGS, RULES
from enclave_launch.review.document import PlanFinding, plan_from_document

__all__ = ["MEANINGS", "RULES", "check_plan"]


def check_plan(document: DryRun) -> list[PlanFinding]:
    """Return all findings of a dry run: those of planning first, then those of each check, sorted."""
    plan = plan_from_document(document)
    own = (
        diagnostic
        for room in (meetings, enclaves, launched)
        for check in room.CHECKS
        for diagnostic in check(plan, document)
    )
    return [
        *plan.diagnostics,
        *sorted(own, key=lambda diagnostic: diagnostic._replace(file=diagnostic.file or "")[:5]),
    ]
