"""``--explain ENCLAVE|NODE|TOPIC``: each permission with its reasons, as lines for a person. Only reads."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from enclave_launch.policy.derivation import DerivedPolicy
from enclave_launch.policy.node_permissions import Reason
from keystore.formats.policy import Qualifier, Rule

Wanted = Callable[[Rule, Reason], bool]


def explain(derived: DerivedPolicy, subject: str) -> list[str]:
    """Return everything that ``subject`` is: an enclave path, a node's full name, a topic, service or action.

    Empty if it is none of these. A subject without leading slash is taken as an absolute name.
    """
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
