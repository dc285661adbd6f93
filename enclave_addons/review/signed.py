"""The signed permissions of a keystore as a review sees them, and those of a plan as if they were signed.

DDS knows topics only: a service is two of them, an action eight. Read back, a topic that belongs to an action may count
to it or stand alone, so both sides of a comparison go the same way through ``permissions_names``. Performs no I/O.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from enclave_addons.review.document import GrantedName, PlanDocument
from enclave_launch.policy.derivation import LIST_NAMES
from keystore.formats.permissions_names import add_dds_topics, ros_rules
from keystore.formats.policy import Rule

_RULES = {listed: operation for operation, listed in LIST_NAMES.items()}


def as_signed(grants: Iterable[GrantedName]) -> frozenset[GrantedName]:
    """Convert ``grants`` to DDS topics and back."""
    publish: set[str] = set()
    subscribe: set[str] = set()
    for grant in grants:
        add_dds_topics(_RULES[grant.operation], grant.name, publish, subscribe)
    return grants_of_rules(ros_rules(publish, subscribe)[0])


def grants_of_rules(rules: Iterable[Rule]) -> frozenset[GrantedName]:
    """Read rules of a policy back from signed permissions, as the plan names them."""
    return frozenset(GrantedName(LIST_NAMES[rule.operation], rule.expression) for rule in rules)


def plan_as_signed(plan: PlanDocument) -> PlanDocument:
    """Return ``plan`` with the permissions that would be read back from its keystore."""
    return plan._replace(enclaves={path: as_signed(grants) for path, grants in plan.enclaves.items()})


def keystore_as_plan(
    signed: Mapping[str, frozenset[GrantedName]], plan: PlanDocument, on_zenoh: frozenset[str]
) -> PlanDocument:
    """Return the keystore's enclaves with the nodes that ``plan`` has in them: a keystore knows no nodes."""
    return PlanDocument(signed, tuple(node for node in plan.nodes if node.enclave in signed), (), on_zenoh)
