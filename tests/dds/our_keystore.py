"""A keystore made by the library under test, from the same grants as ``sros2_style``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import keystore
from keystore.domains import Domains
from keystore.policy import EnclavePolicy, Operation, Profile, Qualifier, Rule
from tests.dds.sros2_style import Grant


def create(root: Path, domain: int, grants: Mapping[str, Grant]) -> None:
    options = keystore.ProvisionOptions(domains=Domains.single(domain), durable=False)
    keystore.provision(root, [_policy(path, grant) for path, grant in grants.items()], options=options)


def _policy(path: str, grant: Grant) -> EnclavePolicy:
    named = ((Operation.PUBLISH, grant.publish), (Operation.SUBSCRIBE, grant.subscribe))
    rules = tuple(Rule(operation, Qualifier.ALLOW, topic) for operation, topics in named for topic in topics)
    return EnclavePolicy(path, (Profile("/", "node", rules),))
