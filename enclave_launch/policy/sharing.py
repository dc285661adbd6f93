"""Rights that nodes gain by sharing an enclave, whose union DDS enforces. Only reads."""

from __future__ import annotations

from typing import NamedTuple

from enclave_launch.policy.derivation import DerivedPolicy
from keystore.formats.policy import Qualifier, Rule


class Gain(NamedTuple):
    """Permissions that a node has only because it shares an enclave. ``gained``: rules of its enclave that ``node``
    does not need itself. ``composed``: in a container."""

    enclave: str
    node: str
    composed: bool
    gained: tuple[Rule, ...]

    def __str__(self) -> str:
        how = "shares a container" if self.composed else f"shares enclave {self.enclave}"
        names = ", ".join(f"{rule.operation.verb} {rule.expression}" for rule in self.gained)
        return f"node {self.node} {how} and may thereby also {names}"


def gains_by_sharing(derived: DerivedPolicy, *, composed_only: bool = False) -> tuple[Gain, ...]:
    """Return each node that gains permissions by sharing its enclave, beyond what every node has."""
    found: list[Gain] = []
    for enclave, nodes in sorted(derived.nodes.items()):
        if len(nodes) < 2:
            continue
        reasons = derived.reasons.get(enclave, {})
        needed = {
            rule: {reason.node for reason in why}
            for rule, why in reasons.items()
            if rule.qualifier is Qualifier.ALLOW and not all(reason.origin == "built-in" for reason in why)
        }
        for node in sorted({(node.fqn, node.role in ("container", "component")) for node in nodes}):
            fqn, composed = node
            gained = tuple(rule for rule, who in needed.items() if fqn not in who)
            if gained and (composed or not composed_only):
                found.append(Gain(enclave, fqn, composed, gained))
    return tuple(found)
