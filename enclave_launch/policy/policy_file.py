"""``--policy FILE`` merged over what was derived: more permissions, wildcards, denials. Pure.

Only the enclaves of this launch are taken; the others are named in a warning, since nothing would use
them. Names become absolute, so that a name written ``chatter`` and a derived ``/chatter`` are one rule.
"""

from __future__ import annotations

from collections.abc import Mapping

from enclave_launch.diagnostics import Diagnostic
from enclave_launch.diagnostics.permissions import policy_denies_need, policy_enclave_unused, policy_file
from enclave_launch.policy.derivation import DerivedPolicy
from enclave_launch.policy.node_permissions import Reason
from enclave_launch.source_location import SourceLocation
from keystore.formats.permissions import dds_rules
from keystore.formats.permissions_names import full_name
from keystore.formats.permissions_patterns import can_meet
from keystore.formats.policy import EnclavePolicy, Policy, Profile, Qualifier, Rule
from keystore.formats.policy_xml import PolicyDocument

Added = Mapping[tuple[str, str], Mapping[Rule, Reason]]  # (namespace, node) -> rule with its full name ->


def merge_policy_file(derived: DerivedPolicy, document: PolicyDocument) -> DerivedPolicy:
    """Union by enclave and profile, with the reasons of both. Warnings: the document's own, unused enclaves, denials of
    needs."""
    theirs = {enclave.path: enclave for enclave in document.policy.enclaves}
    ours = {enclave.path for enclave in derived.policy.enclaves}
    warnings = [policy_file("policy file", text) for text in (*document.warnings, *document.notes)]
    warnings += [policy_enclave_unused(path) for path in theirs if path not in ours]
    enclaves: list[EnclavePolicy] = []
    merged_reasons = {path: dict(by_rule) for path, by_rule in derived.reasons.items()}
    for enclave in derived.policy.enclaves:
        other = theirs.get(enclave.path)
        if other is None:
            enclaves.append(enclave)
            continue
        added = _absolute(other, document)
        merged = EnclavePolicy(enclave.path, _union(enclave, added))
        enclaves.append(merged)
        known = merged_reasons.setdefault(enclave.path, {})
        for rules in added.values():
            for rule, reason in rules.items():
                known[rule] = (*known.get(rule, ()), reason)
        warnings.extend(_denials(enclave.path, known))
        hazards = dds_rules(merged).hazards
        warnings.extend(policy_file(enclave.path, f"enclave {enclave.path}: {hazard}") for hazard in hazards)
    return derived._replace(
        policy=Policy(tuple(enclaves)), reasons=merged_reasons, warnings=(*derived.warnings, *warnings)
    )


def _absolute(enclave: EnclavePolicy, document: PolicyDocument) -> Added:
    return {
        (profile.ns, profile.node): {
            Rule(rule.operation, rule.qualifier, full_name(rule.expression, profile)): Reason(
                node=f"{profile.ns.rstrip('/')}/{profile.node}",
                origin="policy file",
                place=document.places[enclave.path, profile.ns, profile.node, rule],
                written=rule.expression,
            )
            for rule in profile.rules
        }
        for profile in enclave.profiles
    }


def _union(enclave: EnclavePolicy, added: Added) -> tuple[Profile, ...]:
    profiles = {(profile.ns, profile.node): set(profile.rules) for profile in enclave.profiles}
    for key, rules in added.items():
        profiles.setdefault(key, set()).update(rules)
    return tuple(Profile(ns, node, tuple(sorted(rules))) for (ns, node), rules in sorted(profiles.items()))


def _denials(path: str, reasons: Mapping[Rule, tuple[Reason, ...]]) -> list[Diagnostic]:
    """A warning for each derived permission that a denial takes away: the node will miss it."""
    denials = [(rule, why) for rule, why in reasons.items() if rule.qualifier is Qualifier.DENY]
    return [
        policy_denies_need(
            f"{denial.operation.verb} {denial.expression}",
            path,
            need.node,
            f"{rule.operation.verb} {rule.expression}",
            need.place,
            SourceLocation.read(why[0].place),
        )
        for denial, why in denials
        for rule, needs in reasons.items()
        if rule.qualifier is Qualifier.ALLOW and rule.operation is denial.operation
        for need in needs[:1]
        if need.origin != "policy file" and can_meet(denial.expression, rule.expression)
    ]
