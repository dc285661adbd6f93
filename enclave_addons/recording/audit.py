"""``--audit``: a launch runs as usual, and what its nodes ask for is held against the plan.

Reported live and at the end, for each enclave: what the plan would refuse, and what it grants and no node requests.
DDS-Security has no such mode: a team records what enforcement would do before it enforces. Listens to a recording.
"""

from __future__ import annotations

import json
from typing import NamedTuple

from enclave_addons.recording.grants import WORDS, Need, PlannedGrants
from enclave_addons.recording.record.lines import EndpointMade, Line
from enclave_addons.recording.record.requested import EndpointRole, role_of
from enclave_addons.recording.recording import Listener, Unrecorded
from enclave_common.terminal import printable
from enclave_launch.plan import LaunchPlan
from keystore.formats.permissions_patterns import covers, has_wildcard
from keystore.formats.policy import Operation, Rule


class Refusal(NamedTuple):
    """Something recorded that the plan does not grant. ``by``: ``described_by`` without where was searched."""

    need: Need
    written: str
    type: str
    described_by: str
    by: str

    @property
    def text(self) -> str:
        need = self.need
        return printable(
            f"node {need.node} in enclave {need.enclave} would {WORDS[need.operation]} {need.name} (written "
            f"{self.written!r}), which is not granted; its interfaces come from {self.by}"
        )


class AuditReport(NamedTuple):
    """The result of an audit. ``never_requested``: rules by enclave that no recorded endpoint needed. ``complete``:
    all could be seen."""

    refusals: tuple[Refusal, ...]
    never_requested: dict[str, tuple[Rule, ...]]
    checked: int
    unrecorded: tuple[Unrecorded, ...]
    complaints: tuple[str, ...]

    @property
    def exit_status(self) -> int:
        """Return 0 if the plan grants all that was requested, and all was seen."""
        return 1 if self.refusals or self.unrecorded or self.complaints else 0


class Audit(Listener):
    """Follows one recording."""

    def __init__(self, plan: LaunchPlan) -> None:
        self._grants = PlannedGrants(plan)
        self._requested: set[Need] = set()
        self._refusals: dict[Need, Refusal] = {}
        self._checked = 0

    def added(self, line: Line) -> None:
        if not isinstance(line, EndpointMade) or line.rc not in (0, 1):
            return
        process, node = self._recording.record.node_of(line)
        found = self._grants.need(process, node, line)
        if found is None:
            return
        need, endpoint = found
        self._checked += 1
        if need not in self._requested:
            granted = self._grants.granted(node, line, need)
            self._requested.update((need, *granted))
            if not granted:
                described = self._grants.described(process, node)
                short = described.text if described.missing is None else "nobody"
                who, by = _by(described.text, line), _by(short, line)
                self._refusals[need] = refusal = Refusal(need, endpoint.written, endpoint.type, who, by)
                self._launch.say("WARNING", f"audit: {refusal.text}")

    def report(self) -> AuditReport:
        used = {(need.enclave, need.operation, need.name) for need in self._requested}
        never = {
            enclave: tuple(
                sorted(rule for rule in self._grants.rules_of(enclave) if not _used(rule, enclave, used))
            )
            for enclave in self._grants.enclaves
        }
        return AuditReport(
            tuple(sorted(self._refusals.values())),
            {enclave: rules for enclave, rules in never.items() if rules},
            self._checked,
            tuple(self._recording.unrecorded),
            tuple(complaint.why for complaint in self._recording.record.complaints),
        )


def _by(who: str, line: EndpointMade) -> str:
    role = role_of(line)
    return who if role is EndpointRole.OWN else f"the library ({role.value}); the node: {who}"


def _used(rule: Rule, enclave: str, used: set[tuple[str, Operation, str]]) -> bool:
    if has_wildcard(rule.expression):
        return any(
            e == enclave and operation is rule.operation and covers(rule.expression, name)
            for e, operation, name in used
        )
    return (enclave, rule.operation, rule.expression) in used or _parts_used(rule, enclave, used)


def _parts_used(rule: Rule, enclave: str, used: set[tuple[str, Operation, str]]) -> bool:
    action, part, _ = rule.expression.partition("/_action/")
    actions = (Operation.EXECUTE, Operation.CALL)
    return bool(part) and any((enclave, operation, action) in used for operation in actions)


def audit_text(report: AuditReport) -> str:
    """Return the report for a person, by enclave."""
    lines = [f"audit: {report.checked} endpoints were requested; {len(report.refusals)} would be refused"]
    enclaves = sorted({refusal.need.enclave for refusal in report.refusals} | set(report.never_requested))
    for enclave in enclaves:
        lines.append(f"enclave {enclave}")
        refused = [each for each in report.refusals if each.need.enclave == enclave]
        lines += [f"  would be refused: {refusal.text}" for refusal in refused]
        rules = report.never_requested.get(enclave, ())
        granted = (f"{WORDS[rule.operation]} {printable(rule.expression)}" for rule in rules)
        lines += [f"  granted, never requested: {each}" for each in granted]
    lines += [f"not recorded: {item.process}: {printable(item.why)}" for item in report.unrecorded]
    lines += [f"the record is not complete: {printable(why)}" for why in report.complaints]
    return "\n".join([*lines, ""])


def audit_json(report: AuditReport) -> str:
    """Return the report for programs, sorted."""
    content = {
        "version": 1,
        "exit_status": report.exit_status,
        "checked": report.checked,
        "would_be_refused": [
            {
                **refusal.need._asdict(),
                "operation": refusal.need.operation.value,
                "written": refusal.written,
                "type": refusal.type,
                "described_by": refusal.described_by,
            }
            for refusal in report.refusals
        ],
        "never_asked_for": [
            {"enclave": enclave, "operation": rule.operation.value, "name": rule.expression}
            for enclave, rules in sorted(report.never_requested.items())
            for rule in rules
        ],
        "not_recorded": [item._asdict() for item in report.unrecorded],
        "incomplete": list(report.complaints),
    }
    return json.dumps(content, indent=2) + "\n"
