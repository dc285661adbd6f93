"""``--explain SUBJECT``: everything a plan knows about an enclave, node, process, component, topic or service."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from enclave_launch.add_ons import zenoh_planning
from enclave_launch.admission.middleware import ZENOH
from enclave_launch.plan import LaunchPlan, PlannedComponent, PlannedProcess
from enclave_launch.policy.derivation import DerivedPolicy
from enclave_launch.policy.node_permissions import Reason
from enclave_launch.report.tree import origin_text
from enclave_launch.report.unknown import UNKNOWN, is_unknown, label, shown_fqn, unknown_by_enclave
from keystore.formats.policy import Qualifier, Rule


def explained(plan: LaunchPlan, subject: str) -> list[str]:
    """Explain the permissions of ``subject`` in lines; none if it is not part of this launch."""
    lines = explain(plan.derived, subject)
    path = subject if subject.startswith("/") else f"/{subject}"
    lines += [line for item in unknown_by_enclave(plan).get(path, ()) for line in _unknown(item)]
    planned: list[PlannedProcess | PlannedComponent] = [*plan.processes, *plan.components]
    for item in planned:
        of_node = path in {node.fqn for node in item.nodes}
        if of_node and item.origin:
            lines.append(f"  interfaces of {label(item)}: {origin_text(item)}")
        lines += _descriptions(item, None if of_node else path)
        if subject.strip("[]") == label(item) or (is_unknown(item) and path == shown_fqn(item)):
            lines += _of_process(plan, item)
    if lines and any(item.middleware == ZENOH for item in plan.processes) and (zenoh := zenoh_planning()):
        lines += zenoh.explain(plan, path)
    return lines


def _descriptions(item: PlannedProcess | PlannedComponent, name: str | None) -> Iterator[str]:
    shown = sorted(
        {each for described in item.descriptions for each in described.names if name in (None, each[1])}
    )
    if not shown:
        return
    yield f"  what describes {label(item)}:"
    for described in item.descriptions:
        doubt = f", {described.found.doubt}" if described.found.doubt else ""
        is_open = "" if described.complete else ", which leaves something open"
        use = "used" if described.used else "not used"
        yield f"    {described.found.origin} ({described.found.source}{is_open}{doubt}): {use}"
    for named in shown:
        having = [each for each in item.descriptions if named in each.names]
        granted = "" if any(each.used for each in having) else ", not granted"
        operation, final = named
        yield f"    {operation.verb} {final}: {', '.join(str(each.found.origin) for each in having)}{granted}"


def explainable(plan: LaunchPlan) -> set[str]:
    """Return every subject that ``explained`` has an answer to."""
    planned: list[PlannedProcess | PlannedComponent] = [*plan.processes, *plan.components]
    names = {enclave.path for enclave in plan.derived.policy.enclaves} | {label(item) for item in planned}
    names |= {node.fqn for item in planned for node in item.nodes}
    names |= {shown_fqn(item) for item in planned if is_unknown(item)} - {""}
    names |= {named[1] for item in planned for each in item.descriptions for named in each.names}
    return names | {rule.expression for reasons in plan.derived.reasons.values() for rule in reasons}


def _of_process(plan: LaunchPlan, item: PlannedProcess | PlannedComponent) -> Iterator[str]:
    if isinstance(item, PlannedProcess):
        enclave = item.enclave
        why = f"in enclave {enclave.path} ({enclave.reason.value})" if enclave else "without an enclave"
        yield f"process {label(item)} {why}"
    if is_unknown(item):
        yield from _unknown(item)
    for fqn in dict.fromkeys(node.fqn for node in item.nodes):
        if fqn != label(item):
            yield from explain(plan.derived, fqn)


def _unknown(item: PlannedProcess | PlannedComponent) -> Iterator[str]:
    why = (
        f"no NoDL manifest for {item.missing.subject}: {item.missing.why}"
        if item.missing
        else "it is not a node"
    )
    yield f"{label(item)}: {UNKNOWN}: {why}"


Wanted = Callable[[Rule, Reason], bool]


def explain(derived: DerivedPolicy, subject: str) -> list[str]:
    """Explain an enclave path, a node's full name, a topic, service or action; empty if it is none of these."""
    name = subject if subject.startswith("/") else f"/{subject}"
    lines: list[str] = []
    if name in derived.reasons:
        lines += [f"enclave {name}", *_section(derived, name, lambda rule, reason: True)]
    for enclave, nodes in sorted(derived.nodes.items()):
        if any(node.fqn == name for node in nodes):
            lines += [f"node {name} in enclave {enclave}"]
            lines += _section(derived, enclave, lambda rule, reason: reason.node == name)
    for enclave, reasons in sorted(derived.reasons.items()):
        if any(rule.expression == name for rule in reasons):
            lines += [f"name {name} in enclave {enclave}"]
            lines += _section(derived, enclave, lambda rule, reason: rule.expression == name)
    return lines


def _section(derived: DerivedPolicy, enclave: str, wanted: Wanted) -> Iterator[str]:
    for rule, reasons in sorted(derived.reasons[enclave].items()):
        chosen = [reason for reason in reasons if wanted(rule, reason)]
        if chosen:
            denied = "DENY " if rule.qualifier is Qualifier.DENY else ""
            yield f"  {denied}{rule.operation.verb} {rule.expression}"
            for reason in chosen:
                yield from _because(reason)


def _because(reason: Reason) -> Iterator[str]:
    written = f": '{reason.written}'" if reason.origin != "built-in" else ""
    place = reason.place if reason.origin != "policy file" else f"policy file {reason.place}"
    yield f"    node {reason.node}: {place}{written}"
    for rule in reason.rules:
        yield f"      remapped by {rule.text}" + (f" at {rule.origin}" if rule.origin else "")
    if reason.note:
        yield f"      {reason.note}"
