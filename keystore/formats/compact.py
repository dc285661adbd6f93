"""Compact permissions: the six parameter services of a node by one expression. Performs no I/O.

Fast DDS carries 63,736 bytes of a signed document, and of a large enclave most are names of parameter services. The
expression ``/NODE/*_parameter*`` also covers nodes below ``/NODE``, since ``*`` matches ``/``. So it stands only where
nothing else that the keystore knows matches it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from keystore.formats.permissions import DdsRules, TopicSets, dds_rules
from keystore.formats.permissions_names import add_dds_topics, dds_topics, full_name
from keystore.formats.permissions_patterns import Expressions, has_wildcard
from keystore.formats.policy import EnclavePolicy, Operation, Profile, Qualifier, Rule

PARAMETER_SERVICES = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)
PATTERN = "*_parameter*"
_REPLY_PREFIX, _REPLY_SUFFIX = "rr", f"/{PATTERN}Reply"


def topics_of(policy: EnclavePolicy) -> set[str]:
    """Return the DDS topics that permissions of this policy allow, as they would stand in the document."""
    allow = dds_rules(policy).allow
    return {*allow.publish, *allow.subscribe}


def compact_nodes(topics: Iterable[str]) -> tuple[str, ...]:
    """Return the nodes whose parameter services these topics of permissions name by one expression."""
    return tuple(
        sorted(
            topic[len(_REPLY_PREFIX) : -len(_REPLY_SUFFIX)]
            for topic in topics
            if topic.startswith(f"{_REPLY_PREFIX}/") and topic.endswith(_REPLY_SUFFIX)
        )
    )


def written_out(topics: Iterable[str]) -> set[str]:
    """Return topics of permissions with the names that their expressions for parameter services stand for."""
    found = set(topics)
    for fqn in compact_nodes(found):
        services = _Services(fqn)
        found.difference_update(*services.pattern)
        found.update(*services.names)
    return found


def compacted(policy: EnclavePolicy, known: Expressions) -> EnclavePolicy:
    """Return the policy with one expression for each node, unless something else matches it.

    Args:
        policy: With every name written out.
        known: The DDS topics of all enclaves that the keystore knows, this one included, each name written out.
    """
    denied = _denied(policy)
    return policy._replace(profiles=tuple(_compacted(profile, known, denied) for profile in policy.profiles))


def _denied(policy: EnclavePolicy) -> Expressions:
    publish, subscribe = set[str](), set[str]()
    for profile in policy.profiles:
        for rule in profile.rules:
            if rule.qualifier is Qualifier.DENY:
                add_dds_topics(rule.operation, full_name(rule.expression, profile), publish, subscribe)
    return Expressions(publish | subscribe)


def compacted_like(policy: EnclavePolicy, present: Collection[str]) -> EnclavePolicy:
    """Return the policy as the CA's machine signed it: compact for the nodes for which ``present`` topics are so."""
    nodes = frozenset(compact_nodes(present))
    return policy._replace(
        profiles=tuple(
            _compacted(profile) if _fqn(profile) in nodes else profile for profile in policy.profiles
        )
    )


def expanded(rules: DdsRules, known: Expressions | None = None) -> DdsRules:
    """Return the rules of permissions with names written out: of all nodes, or of those whose expression covers
    another topic that is ``known``."""
    publish, subscribe = set(rules.allow.publish), set(rules.allow.subscribe)
    for fqn in compact_nodes(publish):
        services = _Services(fqn)
        if known is None or services.meets(known):
            publish = (publish - services.pattern[0]) | services.names[0]
            subscribe = (subscribe - services.pattern[1]) | services.names[1]
    return rules._replace(allow=TopicSets(tuple(sorted(publish)), tuple(sorted(subscribe))))


def is_overtaken(topics: Collection[str], known: Expressions) -> bool:
    """Return whether one of the expressions in ``topics`` now covers another topic that is known."""
    return any(_Services(fqn).meets(known) for fqn in compact_nodes(topics))


@dataclass(frozen=True)
class _Services:
    """The parameter services of one node as DDS topics: what it publishes and what it subscribes."""

    fqn: str

    @property
    def pattern(self) -> tuple[set[str], set[str]]:
        return dds_topics(Operation.REPLY, f"{self.fqn}/{PATTERN}")

    @property
    def names(self) -> tuple[set[str], set[str]]:
        publish, subscribe = set[str](), set[str]()
        for service in PARAMETER_SERVICES:
            add_dds_topics(Operation.REPLY, f"{self.fqn}/{service}", publish, subscribe)
        return publish, subscribe

    def meets(self, known: Expressions) -> bool:
        """Return whether the expression matches anything of ``known`` but the node's own services."""
        own = set().union(*self.names)
        return any(not own.issuperset(known.meeting(topic)) for side in self.pattern for topic in side)


def _fqn(profile: Profile) -> str:
    return f"{profile.ns.rstrip('/')}/{profile.node}"


def _compacted(profile: Profile, *others: Expressions) -> Profile:
    fqn = _fqn(profile)
    if has_wildcard(fqn):
        return profile
    services = {f"{fqn}/{service}" for service in PARAMETER_SERVICES}
    served = {
        rule: name
        for rule in profile.rules
        if rule.operation is Operation.REPLY
        and rule.qualifier is Qualifier.ALLOW
        and (name := full_name(rule.expression, profile)) in services
    }
    if set(served.values()) != services or any(map(_Services(fqn).meets, others)):
        return profile
    one = Rule(Operation.REPLY, Qualifier.ALLOW, f"{fqn}/{PATTERN}")
    return profile._replace(rules=tuple(sorted({*profile.rules} - served.keys() | {one})))
