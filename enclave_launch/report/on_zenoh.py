"""What a plan's permissions are on Zenoh: the key expressions that the router's rules will name. Only reads."""

from __future__ import annotations

from collections.abc import Iterator

from enclave_launch.admission.middleware import ZENOH
from enclave_launch.plan import LaunchPlan, enclave_domains
from enclave_launch.policy.zenoh_types import enclave_types
from keystore.formats.domains import Domains
from keystore.formats.zenoh.grants import grants_of_policy
from keystore.formats.zenoh.key_expressions import data_keys, domain_chunks


def zenoh_lines(plan: LaunchPlan, subject: str) -> Iterator[str]:
    """Explain what ``subject`` means on Zenoh.

    Yields all lines of an enclave, those that name a topic, service or part of an action; nothing for processes on
    DDS."""
    domains = enclave_domains(item for item in plan.processes if item.middleware == ZENOH)
    for policy in plan.derived.policy.enclaves:
        if policy.path not in domains:
            continue
        grants = grants_of_policy(policy, enclave_types(plan.derived, policy.path))
        chunks = domain_chunks(Domains((number, number) for number in domains[policy.path]))
        for use, names in grants.names.items():
            for name in names:
                if subject in (policy.path, name) or name.startswith(f"{subject}/_action/"):
                    keys = " ".join(data_keys(chunks, name, grants.types_of(use, name)))
                    yield f"  on Zenoh enclave {policy.path} may {use.value} {keys}"
        yield from (f"  not granted on Zenoh: {gap}" for gap in grants.gaps if subject == policy.path)
