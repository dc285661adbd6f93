"""Report what follows from processes on Zenoh in a plan: nodes on DDS and Zenoh never meet, unless by a bridge."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from enclave_addons.zenoh.grants import Types, grants_of_policy
from enclave_addons.zenoh.key_expressions import data_keys, domain_chunks
from enclave_addons.zenoh.types import types_of_interface, united_types
from enclave_launch.add_ons import ZenohPlanning
from enclave_launch.admission.middleware import ZENOH, middleware_of
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.diagnostics.enclaves import (
    enclave_on_both,
    launcher_apart,
    names_apart,
    zenoh_cannot_grant,
    zenoh_router_trusted,
)
from enclave_launch.plan import LaunchPlan, PlannedProcess, enclave_domains
from enclave_launch.policy.derivation import DerivedPolicy
from enclave_launch.policy.node_permissions import Reason
from keystore.formats.domains import Domains
from keystore.formats.policy import Operation, Qualifier
from nodl.builtin_interfaces import TABLE

_BUILT_IN = {row.name: row.type for row in TABLE}

_ENDS = (
    ("topic", Operation.PUBLISH, Operation.SUBSCRIBE),
    ("service", Operation.REPLY, Operation.REQUEST),
    ("action", Operation.EXECUTE, Operation.CALL),
)


def report(plan: LaunchPlan, environment: Mapping[str, str]) -> LaunchPlan:
    """Return the plan with its problems and warnings about Zenoh, in the launcher's ``environment``."""
    return plan._replace(
        problems=(*plan.problems, *middleware_problems(plan, environment)),
        warnings=(*plan.warnings, *middleware_notes(plan)),
    )


def middleware_problems(plan: LaunchPlan, environment: Mapping[str, str]) -> Iterator[Diagnostic]:
    """Calls of the launcher that cannot arrive: its node would wait for ever."""
    own = middleware_of(environment)
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


def enclave_types(derived: DerivedPolicy, enclave: str) -> Types:
    """Return the types of each name, if every node that requests it knows them."""
    return united_types(
        one
        for rule, reasons in derived.reasons.get(enclave, {}).items()
        if rule.qualifier is Qualifier.ALLOW
        for reason in reasons
        for one in types_of_interface(rule.operation, rule.expression, _type(reason))
    )


def _type(reason: Reason) -> str:
    """Return the type of an interface; one that every node has carries it in the table, except for the topic of
    introspection."""
    if reason.origin == "built-in" and not reason.note:
        return reason.type or _BUILT_IN.get(reason.written, "")
    return reason.type


def explain(plan: LaunchPlan, subject: str) -> Iterator[str]:
    """Explain what ``subject`` means on Zenoh; nothing for processes on DDS."""
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


ADD_ON = ZenohPlanning(report, explain)
