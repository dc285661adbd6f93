"""The smallest policy that lets every node of a launch work, with a reason for each permission.

Takes the running nodes, gives a ``DerivedPolicy``; next are the plan, the reports and the keystore. Performs no I/O.
All nodes of one enclave are united (that is what DDS enforces), each keeps its own profile (that is what
a person reviews). Sorted and free of repetitions: the same launch gives the same bytes, and taking a node
away takes exactly its permissions away. Time is linear in nodes and interfaces.

``--policy FILE`` is merged over what was derived (``merge_policy_file``): more permissions, wildcards, denials. Only
the enclaves of this launch are taken. Names become absolute: ``chatter`` and a derived ``/chatter`` are one rule.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal, NamedTuple

from enclave_common.source_location import SourceLocation
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.diagnostics.permissions import (
    permissions_large,
    policy_answers,
    policy_denies_need,
    policy_enclave_unused,
    policy_file,
)
from enclave_launch.policy.node_permissions import NodePermissions, PolicyOptions, Reason, node_permissions
from enclave_launch.policy.running_node import RunningNode
from enclave_launch.ros_rules.distro import Version
from keystore.formats.permissions import dds_rules
from keystore.formats.permissions_names import full_name
from keystore.formats.permissions_patterns import can_meet
from keystore.formats.permissions_size import size_concern
from keystore.formats.policy import EnclavePolicy, Operation, Policy, Profile, Qualifier, Rule
from keystore.formats.policy_xml import PolicyDocument

Reasons = dict[Rule, list[Reason]]

ListName = Literal["publish", "subscribe", "call_services", "serve_services", "call_actions", "serve_actions"]
LIST_NAMES: dict[Operation, ListName] = {
    Operation.PUBLISH: "publish",
    Operation.SUBSCRIBE: "subscribe",
    Operation.REQUEST: "call_services",
    Operation.REPLY: "serve_services",
    Operation.CALL: "call_actions",
    Operation.EXECUTE: "serve_actions",
}
"""The names of the operations in lists for people and programs."""


def allowed_names(enclave: EnclavePolicy) -> dict[str, list[str]]:
    """Return what an enclave may do, sorted, by the contract's list names."""
    lists: dict[str, set[str]] = {name: set() for name in LIST_NAMES.values()}
    for profile in enclave.profiles:
        for rule in profile.rules:
            if rule.qualifier is Qualifier.ALLOW:
                lists[LIST_NAMES[rule.operation]].add(rule.expression)
    return {name: sorted(names) for name, names in lists.items()}


# Below that, even actions with names of the greatest length stay under the sizes that matter.
_MANY_RULES = 20

ProfileKey = tuple[str, str]  # namespace and node name


class DerivedPolicy(NamedTuple):
    """The least policy of a launch, with reasons. ``reasons``: enclave path -> rule (name absolute) -> why, sorted by
    node.

    ``problems`` are what ``--secure`` must refuse: a name that is not known or cannot exist.
    """

    policy: Policy
    reasons: Mapping[str, Mapping[Rule, tuple[Reason, ...]]]
    nodes: Mapping[str, tuple[RunningNode, ...]]  # by enclave path
    problems: tuple[Diagnostic, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    def built_in_names(self, enclave: str) -> frozenset[tuple[str, str]]:
        """Return the pairs (list name, name) that every node has and no manifest or policy file requests."""
        return frozenset(
            (LIST_NAMES[rule.operation], rule.expression)
            for rule, reasons in self.reasons.get(enclave, {}).items()
            if all(reason.origin == "built-in" for reason in reasons)
        )


def derive_policy(
    nodes: Iterable[RunningNode],
    *,
    distro: str,
    options: PolicyOptions | None = None,
    also: Iterable[str] = (),
    rcl: Version | None = None,
) -> DerivedPolicy:
    """Derive the policy of all ``nodes``; ``also``: enclaves that must exist though no node in them is known.

    ``rcl``: the version whose rules hold, by default the newest of ``distro``.

    Raises ``ValueError`` for an unknown distribution.
    """
    chosen = options or PolicyOptions()
    collection = _Collection({path: {} for path in also}, {}, [], [])
    for node in nodes:
        collection.add(node_permissions(node, distro=distro, options=chosen, rcl=rcl), chosen.policy_file)
    derived = collection.result()
    if chosen.policy_file is not None:
        derived = merge_policy_file(derived, chosen.policy_file)
    concerns = _size_warnings(derived.policy.enclaves)
    return derived._replace(warnings=_unique((*derived.warnings, *concerns)))


class _Collection(NamedTuple):
    profiles: dict[str, dict[ProfileKey, Reasons]]
    nodes: dict[str, list[RunningNode]]
    problems: list[list[Diagnostic]]  # of each node
    warnings: list[Diagnostic]

    def add(self, found: NodePermissions, policy_file: PolicyDocument | None) -> None:
        node = found.node
        self.nodes.setdefault(node.enclave, []).append(node)
        reasons = self.profiles.setdefault(node.enclave, {}).setdefault((node.namespace, node.fixed_name), {})
        for operation, name, reason in found.permissions:
            reasons.setdefault(Rule(operation, Qualifier.ALLOW, name), []).append(reason)
        self.warnings.extend(found.warnings)
        problems: list[Diagnostic] = []
        for unresolved in found.unresolved:
            if unresolved.operation and _answered(policy_file, node, unresolved.operation):
                self.warnings.append(policy_answers(unresolved.diagnostic))
            else:
                problems.append(unresolved.diagnostic)
        self.problems.append(sorted(problems, key=lambda each: len(each.text)))

    def result(self) -> DerivedPolicy:
        """Return the policy; what is easiest to close comes first: nodes with few gaps, of these the short ones."""
        enclaves = tuple(
            EnclavePolicy(
                path,
                tuple(Profile(ns, name, tuple(sorted(profiles[ns, name]))) for ns, name in sorted(profiles)),
            )
            for path, profiles in sorted(self.profiles.items())
        )
        reasons = {
            enclave.path: _merged_reasons(enclave, self.profiles[enclave.path]) for enclave in enclaves
        }
        nodes = {path: tuple(each) for path, each in self.nodes.items()}
        problems = [each for of_node in sorted(self.problems, key=len) for each in of_node]
        return DerivedPolicy(Policy(enclaves), reasons, nodes, _unique(problems), _unique(self.warnings))


def _size_warnings(enclaves: Iterable[EnclavePolicy]) -> list[Diagnostic]:
    # Only those with many rules are estimated: the others need not load the code that knows DDS.
    large = [enclave for enclave in enclaves if sum(len(p.rules) for p in enclave.profiles) > _MANY_RULES]
    if not large:
        return []

    concerns = ((enclave.path, size_concern(enclave)) for enclave in large)
    return [permissions_large(path, concern) for path, concern in concerns if concern]


def _merged_reasons(
    enclave: EnclavePolicy, profiles: Mapping[ProfileKey, Reasons]
) -> dict[Rule, tuple[Reason, ...]]:
    if len(enclave.profiles) == 1:
        (by_rule,) = profiles.values()
        return {rule: _in_order(by_rule[rule]) for rule in enclave.profiles[0].rules}
    merged: Reasons = {}
    for by_rule in profiles.values():
        for rule, reasons in by_rule.items():
            merged.setdefault(rule, []).extend(reasons)
    return {rule: _in_order(merged[rule]) for rule in sorted(merged)}


def _in_order(reasons: list[Reason]) -> tuple[Reason, ...]:
    if len(reasons) == 1:
        return (reasons[0],)
    by_place = sorted(reasons, key=lambda reason: (reason.node, reason.origin, reason.place, reason.written))
    return tuple(dict.fromkeys(by_place))


def _answered(document: PolicyDocument | None, node: RunningNode, operation: Operation) -> bool:
    return document is not None and any(
        rule.operation is operation
        for enclave in document.policy.enclaves
        if enclave.path == node.enclave
        for profile in enclave.profiles
        if (profile.ns, profile.node) == (node.namespace, node.name)
        for rule in profile.rules
    )


def _unique(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    return tuple(dict.fromkeys(diagnostics))


Added = Mapping[tuple[str, str], Mapping[Rule, Reason]]  # (namespace, node) -> rule with its full name ->


def merge_policy_file(derived: DerivedPolicy, document: PolicyDocument) -> DerivedPolicy:
    """Unite by enclave and profile, with the reasons of both; warn of unused enclaves and denials of needs."""
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
