"""Who of a plan is on DDS and who on Zenoh, and what follows from it. Pure; only reads the plan.

Nodes on the two never meet. What the launcher itself must call and cannot reach is refused; all else is told, since a
bridge may stand between them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from enclave_launch.admission.middleware import ZENOH, middleware_of
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.diagnostics.enclaves import (
    enclave_on_both,
    launcher_apart,
    names_apart,
    zenoh_cannot_grant,
    zenoh_router_trusted,
)
from enclave_launch.plan import LaunchPlan, PlannedProcess, on_zenoh
from enclave_launch.policy.zenoh_types import enclave_types
from keystore.formats.policy import Operation, Qualifier
from keystore.formats.zenoh.grants import Types, grants_of_policy

_ENDS = (
    ("topic", Operation.PUBLISH, Operation.SUBSCRIBE),
    ("service", Operation.REPLY, Operation.REQUEST),
    ("action", Operation.EXECUTE, Operation.CALL),
)


def zenoh_enclaves(plan: LaunchPlan, environment: Mapping[str, str]) -> dict[str, Types]:
    """Enclaves on Zenoh, and the types of what they talk about. ``environment``: the launcher's own."""
    return {path: enclave_types(plan.derived, path) for path in sorted(on_zenoh(plan, environment))}


def middleware_problems(plan: LaunchPlan, environment: Mapping[str, str]) -> Iterator[Diagnostic]:
    """Calls of the launcher that cannot arrive: its node would wait for ever."""
    own = middleware_of(environment, plan.distro)
    by_node = {node.fqn: item for item in plan.processes for node in item.nodes}
    for call in plan.evaluation.launcher_calls:
        item = _serving(call.service, by_node)
        if item is not None and (item.middleware == ZENOH) is not (own == ZENOH):
            name = item.process.process_name
            yield launcher_apart(call.service, own, name, item.middleware, call.location)


def _serving(service: str, by_node: Mapping[str, PlannedProcess]) -> PlannedProcess | None:
    """Return the process of the node that serves ``service``: ``/box/_container/load_node`` is one of ``/box``."""
    name = service if service.startswith("/") else f"/{service}"
    while name := name.rpartition("/")[0]:
        if name in by_node:
            return by_node[name]
    return None


def middleware_notes(plan: LaunchPlan) -> Iterator[Diagnostic]:
    """Report what matters about processes on Zenoh, and names split between the two; nothing if all are on DDS."""
    secured = [item for item in plan.processes if item.enclave is not None]
    zenoh = [item for item in secured if item.middleware == ZENOH]
    if not zenoh:
        return
    yield zenoh_router_trusted([item.process.process_name for item in zenoh])
    enclaves = {item.enclave.path for item in zenoh if item.enclave is not None}
    for policy in plan.derived.policy.enclaves:
        if policy.path in enclaves:
            yield from (zenoh_cannot_grant(policy.path, gap) for gap in grants_of_policy(policy).gaps)
    others = [item for item in secured if item.middleware != ZENOH]
    both = enclaves & {item.enclave.path for item in others if item.enclave is not None}
    yield from map(enclave_on_both, sorted(both))
    yield from _apart(plan, zenoh, others)


class _End(NamedTuple):
    operation: Operation
    name: str
    domain: int


def _apart(
    plan: LaunchPlan, zenoh: Iterable[PlannedProcess], others: Iterable[PlannedProcess]
) -> Iterator[Diagnostic]:
    """Report names with one end on DDS only and the other on Zenoh only, except those that every node has."""
    here, there = _ends(plan, zenoh), _ends(plan, others)
    for what, giving, taking in _ENDS:
        for operation, other in ((giving, taking), (taking, giving)):
            for end, node in sorted(here.items()):
                far = end._replace(operation=other)
                if end.operation is operation and far in there and far not in here:
                    yield names_apart(what, end.name, there[far], node)


def _ends(plan: LaunchPlan, processes: Iterable[PlannedProcess]) -> dict[_End, str]:
    domains = {node.fqn: item.domain for item in processes for node in item.nodes}
    for component in plan.components:
        container = component.container
        if container is not None and any(node.fqn in domains for node in container.nodes):
            domains |= {node.fqn: container.domain for node in component.nodes}
    found: dict[_End, str] = {}
    for reasons in plan.derived.reasons.values():
        for rule, why in reasons.items():
            for reason in why:
                if (
                    rule.qualifier is Qualifier.ALLOW
                    and reason.origin != "built-in"
                    and reason.node in domains
                ):
                    end = _End(rule.operation, rule.expression, domains[reason.node])
                    found.setdefault(end, reason.node)
    return found
