"""Keystores made by the library under test."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import keystore
from keystore import Domains, EnclavePolicy, Operation, Profile, Qualifier, Rule
from tests.dds.sros2_style import Grant

PARAMETER_SERVICES = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)


def allow(operation: Operation, *names: str) -> tuple[Rule, ...]:
    return tuple(Rule(operation, Qualifier.ALLOW, name) for name in names)


def node(namespace: str, name: str, *rules: Rule) -> Profile:
    """``rules`` and what every node needs."""
    every_node = (
        *allow(Operation.PUBLISH, "/rosout", "/parameter_events"),
        *allow(Operation.REPLY, *(f"~/{service}" for service in PARAMETER_SERVICES)),
    )
    return Profile(namespace, name, (*every_node, *rules))


def provision(root: Path, domain: int, policies: Iterable[EnclavePolicy]) -> None:
    options = keystore.ProvisionOptions(domains=Domains.single(domain), durable=False)
    keystore.provision(root, policies, options=options)


def create(root: Path, domain: int, grants: Mapping[str, Grant]) -> None:
    """The keystore that ``sros2_style.create`` would make of the same grants."""
    provision(root, domain, policies(grants))


def policies(grants: Mapping[str, Grant]) -> list[EnclavePolicy]:
    return [_policy(path, grant) for path, grant in grants.items()]


def _policy(path: str, grant: Grant) -> EnclavePolicy:
    rules = (*allow(Operation.PUBLISH, *grant.publish), *allow(Operation.SUBSCRIBE, *grant.subscribe))
    return EnclavePolicy(path, (Profile("/", "node", rules),))
