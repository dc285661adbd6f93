"""Look up in the plan what was recorded: in DDS's own terms, as the signed permissions will say it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from enclave_addons.recording.record.assembly import RecordedNode, RecordedProcess
from enclave_addons.recording.record.lines import EndpointMade
from enclave_addons.recording.record.requested import RequestedEndpoint, parts_of, requested_endpoint
from enclave_launch.plan import (
    Described,
    InterfaceOrigin,
    LaunchPlan,
    Missing,
    PlannedComponent,
    PlannedProcess,
)
from enclave_launch.policy import RunningNode
from enclave_launch.policy.derivation import LIST_NAMES
from enclave_launch.policy.node_permissions import OPERATIONS
from keystore.formats.permissions import DdsRules, dds_rules
from keystore.formats.permissions_names import dds_topics, full_name
from keystore.formats.permissions_patterns import covers
from keystore.formats.policy import Operation, Qualifier, Rule

WORDS = {
    Operation.PUBLISH: "publish topic",
    Operation.SUBSCRIBE: "subscribe to topic",
    Operation.REPLY: "serve service",
    Operation.REQUEST: "call service",
    Operation.EXECUTE: "serve action",
    Operation.CALL: "call action",
}


NO_ENCLAVE_YET = "(unknown: the node has no description)"


class Need(NamedTuple):
    """One permission that a node needs."""

    enclave: str
    node: str
    operation: Operation
    name: str


class Description(NamedTuple):
    """The planned counterpart of a recorded node. ``node`` is ``None`` if the plan lacks it."""

    node: RunningNode | None
    origin: InterfaceOrigin | None = None
    missing: Missing | None = None
    descriptions: tuple[Described, ...] = ()

    @property
    def text(self) -> str:
        """Return where the interface of the node comes from, for a person."""
        if self.missing is not None:
            return f"nothing: {self.missing.why}"
        if self.node is None:
            return "none: the plan has no node of this name"
        origin = f"{self.origin}: " if self.origin else ""
        return f"{origin}{self.node.interface.source}"


class PlannedGrants:
    """Answers for one plan."""

    def __init__(self, plan: LaunchPlan) -> None:
        self._plan = plan
        self._processes = {item.process.process_name: item for item in plan.processes}
        self._rules = {enclave.path: dds_rules(enclave) for enclave in plan.derived.policy.enclaves}

    @property
    def enclaves(self) -> tuple[str, ...]:
        return tuple(self._rules)

    def enclave_of(self, process: RecordedProcess) -> str | None:
        """Return the enclave of a process, None if it runs without one or was not planned."""
        planned = self._processes.get(process.started.process) if process.started else None
        if planned is None:
            return None
        if planned.enclave is None:
            return NO_ENCLAVE_YET if planned.missing is not None else None
        return planned.enclave.path

    def need(
        self, process: RecordedProcess, node: RecordedNode, line: EndpointMade
    ) -> tuple[Need, RequestedEndpoint] | None:
        """Return the permission that ``line`` needs, None if nothing is enforced or no name is known."""
        enclave, endpoint = self.enclave_of(process), requested_endpoint(process, node, line)
        if enclave is None or endpoint is None or not endpoint.final:
            return None
        return Need(enclave, node.fqn, OPERATIONS[endpoint.kind], endpoint.final), endpoint

    def granted(self, node: RecordedNode, line: EndpointMade, need: Need) -> tuple[Need, ...]:
        """Return what the plan grants of ``need``: itself, or each part of an action moved apart, or nothing."""
        if self.permits(need):
            return (need,)
        parts = tuple(
            Need(need.enclave, need.node, OPERATIONS[part.kind], part.final) for part in parts_of(node, line)
        )
        return parts if all(map(self.permits, parts)) else ()

    def permits(self, need: Need) -> bool:
        """Return True if the plan grants ``need``."""
        rules = self._rules.get(need.enclave)
        return rules is not None and permits(rules, need)

    def denied(self, need: Need) -> bool:
        """Return True if a DENY of the policy file takes ``need`` away, whatever else grants it."""
        enclaves = (each for each in self._plan.derived.policy.enclaves if each.path == need.enclave)
        return any(
            rule.qualifier is Qualifier.DENY
            and rule.operation is need.operation
            and covers(full_name(rule.expression, profile), need.name)
            for enclave in enclaves
            for profile in enclave.profiles
            for rule in profile.rules
        )

    def described(self, process: RecordedProcess, node: RecordedNode) -> Description:
        """Return who describes this node in the plan."""
        planned = self._planned(process, node)
        if planned is None:
            return Description(None)
        found = [each for each in planned.nodes if each.fqn == node.fqn]
        own = node.made.name if node.made else ""
        named = [each for each in found if each.original_name == own] or found
        return Description(named[0] if named else None, planned.origin, planned.missing, planned.descriptions)

    def rules_of(self, enclave: str) -> Iterable[Rule]:
        """Yield what the plan allows in ``enclave``, without what every node has; the launcher is not recorded."""
        if self._plan.launcher is not None and enclave == self._plan.launcher.enclave:
            return
        built_in = self._plan.derived.built_in_names(enclave)
        for rule in self._plan.derived.reasons.get(enclave, {}):
            stated = (LIST_NAMES[rule.operation], rule.expression) not in built_in
            if stated and rule.qualifier is Qualifier.ALLOW:
                yield rule

    def _planned(
        self, process: RecordedProcess, node: RecordedNode
    ) -> PlannedProcess | PlannedComponent | None:
        if node.component is not None:
            for item in self._plan.components:
                same = (item.component.package, item.component.plugin) == node.component[1:3]
                if same and any(each.fqn == node.fqn for each in item.nodes):
                    return item
        return self._processes.get(process.started.process) if process.started else None


def permits(rules: DdsRules, need: Need) -> bool:
    """Return True if ``rules`` allow all DDS topics of ``need``."""
    return all(rules.permits(direction, topic) for topic, direction in _topics(need))


def _topics(need: Need) -> Iterator[tuple[str, str]]:
    published, subscribed = dds_topics(need.operation, need.name)
    yield from ((topic, "publish") for topic in published)
    yield from ((topic, "subscribe") for topic in subscribed)
