"""The permissions of one running node: each of its final names, with the reason. Performs no I/O.

As in rcl: parameters are filled in, the name is expanded, then the first matching remap rule replaces it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Literal, NamedTuple

from enclave_common.source_location import SourceLocation
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.diagnostics.permissions import (
    action_remap_idle,
    interface_unknown,
    name_unremappable,
    node_name_impossible,
    pattern_accepted,
    record_undecided,
)
from enclave_launch.policy.running_node import RunningNode
from enclave_launch.ros_rules.distro import Version, moves_whole_actions
from keystore.formats.policy import Operation
from keystore.formats.policy_xml import PolicyDocument
from nodl.builtin_interfaces import BuiltinCondition, built_in_interfaces
from nodl.name_template import NameTemplate, ParameterPart, UnknownPart
from nodl.names import (
    MAX_NAME_LENGTH,
    InvalidNameError,
    is_name,
    join,
    validate_namespace,
    validate_node_name,
)
from nodl.node_interface import Certainty, ClientLibrary, Endpoint, EndpointKind, NodeInterface
from nodl.remap import ACTION_SERVICES, NodeNames, ParsedRule, Resolved

Origin = Literal["declared", "built-in", "policy file"]

OPERATIONS: dict[EndpointKind, Operation] = {
    EndpointKind.PUBLISHER: Operation.PUBLISH,
    EndpointKind.SUBSCRIPTION: Operation.SUBSCRIBE,
    EndpointKind.SERVICE_SERVER: Operation.REPLY,
    EndpointKind.SERVICE_CLIENT: Operation.REQUEST,
    EndpointKind.ACTION_SERVER: Operation.EXECUTE,
    EndpointKind.ACTION_CLIENT: Operation.CALL,
}
_TOPICS = (Operation.PUBLISH, Operation.SUBSCRIBE)
_SERVICES = (Operation.REPLY, Operation.REQUEST)
# What serving or calling an action means for its services and its topics.
_PARTS = {
    Operation.EXECUTE: (Operation.REPLY, Operation.PUBLISH),
    Operation.CALL: (Operation.REQUEST, Operation.SUBSCRIBE),
}


UNSEEN = "unseen"

ALSO: dict[str, frozenset[BuiltinCondition]] = {
    "clock": frozenset({BuiltinCondition.SIM_TIME}),
    "logger-services": frozenset({BuiltinCondition.LOGGER_SERVICES}),
    "service-events": frozenset(),
    UNSEEN: frozenset(),
}
"""Grants of ``--also`` to every node beyond its own: ``/clock``, which a node needs once a launch sets
``use_sim_time`` while it runs; the logger services; ``<service>/_service_event`` of service introspection; of a
recorded node the names that only its other descriptions have (``interfaces.descriptions``)."""


class PolicyOptions(NamedTuple):
    """Options of deriving permissions. ``accept_patterns``: partly known names become wildcards, each with a warning.

    ``also``: what every node gets beyond what it has by itself (``ALSO``).
    ``policy_file``: merged over the derived policy.
    """

    accept_patterns: bool = False
    policy_file: PolicyDocument | None = None
    also: frozenset[str] = frozenset()


class Reason(NamedTuple):
    """The reason for a permission. ``place``: file:line of the manifest, source or policy, or a table row.

    ``written`` is the name as found there; ``rules`` the remap rules that changed it; ``note`` what else
    a reader should know; ``type`` the interface's, empty where it is not known; ``qos`` what is known of it.
    """

    node: str
    origin: Origin
    place: str
    written: str
    rules: tuple[ParsedRule, ...] = ()
    note: str = ""
    type: str = ""
    qos: tuple[tuple[str, str | int], ...] = ()


class Permission(NamedTuple):
    """One operation on a fully qualified name, and why it is granted."""

    operation: Operation
    name: str
    reason: Reason


class Unresolved(NamedTuple):
    """An interface whose name is not (wholly) known: no permission follows from it."""

    operation: Operation | None
    diagnostic: Diagnostic


class NodePermissions(NamedTuple):
    """The permissions of one node. ``permissions`` in the order found, with repetitions; ``unresolved`` must not be
    passed over."""

    node: RunningNode
    permissions: list[Permission]
    unresolved: list[Unresolved]
    warnings: list[Diagnostic]


def node_permissions(
    node: RunningNode, *, distro: str, options: PolicyOptions, rcl: Version | None = None
) -> NodePermissions:
    """Return everything that ``node`` needs under its final name, with what ``options`` add.

    ``rcl`` is the version whose rules hold, by default the newest of ``distro``.
    Raises ``ValueError`` for an unknown distribution.
    """
    return _Collector(node, distro, options, rcl).collect()


class _Collector:
    def __init__(self, node: RunningNode, distro: str, options: PolicyOptions, rcl: Version | None):
        self._options = options
        self._node = node
        self._fqn = node.fqn
        self._distro = distro
        self._whole = moves_whole_actions(distro, rcl)
        self._names = NodeNames(node.name, node.namespace, node.rules)
        self._result = NodePermissions(node, [], [], [])

    def collect(self) -> NodePermissions:
        try:
            validate_node_name(self._node.fixed_name)
            validate_namespace(self._node.namespace)
        except InvalidNameError as error:
            self._impossible(error)
            return self._result
        for endpoint in self._node.interface.endpoints:
            if endpoint.readings:
                self._recorded(endpoint)
            else:
                self._endpoint(endpoint)
        if "service-events" in self._options.also:
            self._service_events()
        conditions = conditions_of(self._node, self._options.also)
        self._built_in(_built_in_rows(self._distro, self._node.interface.library, conditions))
        for gap in self._node.interface.gaps:
            self._unresolved(None, str(gap.source), gap.why)
        return self._result

    def _endpoint(self, endpoint: Endpoint) -> None:
        template = endpoint.name
        if template.is_literal:
            note = endpoint.note
            if endpoint.written:
                note = f"{endpoint.written} is taken as the private name {template}"
            if endpoint.certainty is Certainty.FROM_DEFAULT:
                note = note or "from a default value in the source"
            self._name(endpoint, template, note)
            return
        note = "; ".join(filter(None, (_parameter_note(template, self._node), endpoint.note)))
        for filled in self._filled(template):
            if filled.is_literal:
                self._name(endpoint, filled, note)
            else:
                self._pattern(endpoint, filled)

    def _recorded(self, endpoint: Endpoint) -> None:
        # Each reading that can be a name, with a warning if they are different names in this launch.
        granted: dict[str, str] = {}
        sets: set[frozenset[str]] = set()
        for reading in (endpoint.name, *endpoint.readings):
            filled = self._filled(reading)
            if reading is endpoint.name:
                for unknown in (each for each in filled if not each.is_literal):
                    self._pattern(endpoint, unknown)
            names = frozenset(each.text for each in filled if each.is_literal and is_name(each.text))
            note = "; ".join(filter(None, (_parameter_note(reading, self._node), endpoint.note)))
            granted = {**dict.fromkeys(sorted(names), note), **granted}
            if not reading.is_literal:
                sets.add(names)
        sets.add(frozenset(each.text for each in (endpoint.name, *endpoint.readings) if each.is_literal))
        for name, note in granted.items():
            self._name(endpoint, NameTemplate.literal(name), note)
        if len(sets) > 1:
            parameters = {each for each in (endpoint.name, *endpoint.readings) if not each.is_literal}
            where = self._where(str(endpoint.source))
            warning = record_undecided(self._fqn, sorted(granted), sorted(map(str, parameters)), where)
            self._result.warnings.append(warning)

    def _filled(self, template: NameTemplate) -> tuple[NameTemplate, ...]:
        inputs = self._node.inputs
        return inputs.doubtful(template).fill_each({**inputs.values, **self._node.parameters})

    def _name(self, endpoint: Endpoint, template: NameTemplate, note: str) -> None:
        operation, place = OPERATIONS[endpoint.kind], str(endpoint.source)
        written = endpoint.written or str(endpoint.name)
        if "__" in template.text:
            where = self._where(place)
            self._result.warnings.append(name_unremappable(self._fqn, template.text, where))
        try:
            for final_operation, resolved in self._resolve(operation, template.text, place):
                qos = self._quality(endpoint, resolved.name)
                reason = Reason(
                    self._fqn, "declared", place, written, resolved.rules, note, endpoint.type, qos
                )
                self._result.permissions.append(Permission(final_operation, resolved.name, reason))
                if endpoint.introspected:
                    self._introspection(final_operation, resolved.name, reason)
        except InvalidNameError as error:
            self._unresolved(operation, place, str(error))

    def _quality(self, endpoint: Endpoint, name: str) -> tuple[tuple[str, str | int], ...]:
        """Return the quality without the policies that parameters of the launch may set.

        Source: rclcpp ``qos_overriding_options.hpp``: ``qos_overrides.<topic>.<kind>[_<id>].<policy>``; the program
        says whether it lets them.
        """
        start = f"qos_overrides.{name}.{endpoint.kind.value}"
        set_here = {each.rpartition(".")[2] for each in self._node.parameters if each.startswith(start)}
        return tuple(
            (policy, value) for policy, value in endpoint.qos if policy.removesuffix("_ns") not in set_here
        )

    def _introspection(self, operation: Operation, name: str, reason: Reason) -> None:
        """Grant servers and clients to publish requests and responses (rcl service_event_publisher.c)."""
        types = {name: reason.type}
        if operation not in _SERVICES:
            send, cancel, result = (f"{name}/_action/{part}" for part in ACTION_SERVICES)
            own = reason.type
            types = {
                send: own and f"{own}_SendGoal",
                cancel: "action_msgs/srv/CancelGoal",
                result: own and f"{own}_GetResult",
            }
        note = "the service's calls are published (introspection)"
        for service, service_type in types.items():
            published = reason._replace(note=note, type=_event_of(service_type))
            self._result.permissions.append(
                Permission(Operation.PUBLISH, f"{service}/_service_event", published)
            )

    def _service_events(self) -> None:
        for operation, name, reason in tuple(self._result.permissions):
            if operation in _SERVICES:
                note = "service introspection, by --also service-events"
                events = reason._replace(note=note, type=_event_of(reason.type))
                event = Permission(Operation.PUBLISH, f"{name}/_service_event", events)
                self._result.permissions.append(event)

    def _helper(self, operation: Operation, name: str, place: str) -> Permission:
        """Return the permission of a node of this process whose name cannot be known in advance.

        The program gives the name among its own arguments, which no remap rule of a launch can override."""
        final = join(self._node.process_namespace, name)
        note = "a pattern, because the program makes up the name at each start"
        return Permission(operation, final, Reason(self._fqn, "built-in", place, name, (), note))

    def _built_in(self, rows: Iterable[tuple[Operation, str, str]]) -> None:
        """Add what every node has: dozens of names whose only check is their length."""
        node, permissions = self._fqn, self._result.permissions
        remapped = self._names.has_rules
        try:
            for operation, name, place in rows:
                if "*" in name:
                    permissions.append(self._helper(operation, name, place))
                    continue
                rules: tuple[ParsedRule, ...] = ()
                final = node + name[1:] if name[0] == "~" else name
                if remapped or len(final) > MAX_NAME_LENGTH:
                    final, rules = self._plain(operation, name)
                permissions.append(Permission(operation, final, Reason(node, "built-in", place, name, rules)))
        except InvalidNameError as error:
            self._impossible(error)

    def _resolve(self, operation: Operation, name: str, place: str) -> Iterator[tuple[Operation, Resolved]]:
        """Yield the final names: one, or five if the parts of an action were remapped separately."""
        if operation not in _PARTS:
            yield operation, self._plain(operation, name)
            return
        action = self._names.action(name, as_a_whole=self._whole)
        if not self._whole:
            self._warn_of_idle_rule(action.name, place)
        parts = self._names.action_parts(action.name)
        if parts is None:
            yield operation, action
            return
        together = parts.moved_together
        if together is not None:
            yield operation, Resolved(together, (*action.rules, *parts.rules))
            return
        for part_operation, resolved in zip(_PARTS[operation], (parts.services, parts.topics), strict=True):
            for part in resolved.values():
                yield part_operation, Resolved(part.name, (*action.rules, *part.rules))

    def _plain(self, operation: Operation, name: str) -> Resolved:
        return self._names.topic(name) if operation in _TOPICS else self._names.service(name)

    def _warn_of_idle_rule(self, action: str, place: str) -> None:
        rule = self._names.rule_matching(action)
        if rule is not None:
            where = self._where(rule.origin or place)
            self._result.warnings.append(action_remap_idle(self._fqn, rule.text, action, self._distro, where))

    def _pattern(self, endpoint: Endpoint, template: NameTemplate) -> None:
        """Handle a name of which only a part is known: unresolved, unless patterns are accepted and it has text."""
        operation, place = OPERATIONS[endpoint.kind], str(endpoint.source)
        text = template.text
        why = "; ".join(p.why for p in template.parts if isinstance(p, UnknownPart) and p.why)
        if not self._options.accept_patterns or not text.replace("*", "").strip("/~"):
            has_text = text.replace("*", "").strip("/~")
            unknown = f"the name of what it would {operation.verb} is not known ({template}: {why})"
            if not has_text and why:
                unknown = f"the name of what it would {operation.verb} is not known: {why}"
            self._unresolved(operation, place, unknown)
            return
        try:
            name = _expand_pattern(self._names, text)
        except InvalidNameError as error:
            self._unresolved(operation, place, str(error))
            return
        why = why or "only a part of the name is known"
        note = f"a pattern, because {why}; accepted by --accept-patterns"
        reason = Reason(self._fqn, "declared", place, str(endpoint.name), (), note, endpoint.type)
        self._result.permissions.append(Permission(operation, name, reason))
        warning = pattern_accepted(self._fqn, operation.verb, name, note, self._where(place))
        self._result.warnings.append(warning)

    def _where(self, place: str) -> SourceLocation:
        """Return the place to report: of what our own documents say, that of the node in the launch file."""
        return self._node.location if place.startswith(_OWN_DOCUMENTS) else SourceLocation.read(place)

    def _impossible(self, error: InvalidNameError) -> None:
        impossible = node_name_impossible(self._fqn, str(error), self._node.location)
        self._result.unresolved.append(Unresolved(None, impossible))

    def _unresolved(self, operation: Operation | None, place: str, why: str) -> None:
        interface = self._node.interface
        program = f"{interface.package}/{interface.executable or interface.plugin}"
        unknown = interface_unknown(self._fqn, why, program, self._where(place))
        self._result.unresolved.append(Unresolved(operation, unknown))


_HOME = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
_OWN_DOCUMENTS = tuple(
    os.path.join(_HOME, *folder, "")
    for folder in (("enclave_addons", "library", "documents"), ("nodl", "document", "common"))
)
"""Folders of documents that come with us, in which a user has nothing to correct."""


@lru_cache(maxsize=256)
def _built_in_rows(
    distro: str, library: ClientLibrary, conditions: frozenset[BuiltinCondition]
) -> tuple[tuple[Operation, str, str], ...]:
    rows = built_in_interfaces(distro, library, conditions)
    return tuple((OPERATIONS[row.kind], row.name, str(row)) for row in rows)


def _parameter_note(template: NameTemplate, node: RunningNode) -> str:
    notes = []
    for part in template.parts:
        if isinstance(part, ParameterPart):
            given = part.name in node.parameters or part.name in node.inputs.values
            what = "input" if part.name[:1] in "-<$" else "parameter"
            place = "in its environment" if part.name[0] == "$" else "by launch"
            notes.append(f"{what} {part.name}, {f'set {place}' if given else 'its default'}")
    return "; ".join(notes)


def _expand_pattern(names: NodeNames, text: str) -> str:
    """Expand a name with ``*`` in it as if each were a letter; whether remap rules match is not known."""
    stand_in = "STAR_OF_A_PATTERN"
    return names.expand(text.replace("*", stand_in)).replace(stand_in, "*")


def conditions_of(node: RunningNode, also: Iterable[str] = ()) -> frozenset[BuiltinCondition]:
    """Return which rows of the built-in interfaces hold for ``node``; ``also``: keys of ``ALSO``."""
    met = {BuiltinCondition.ALWAYS}.union(*(ALSO[name] for name in also))
    if node.interface.parameter_services:
        met.add(BuiltinCondition.PARAMETERS)
    if node.parameters.get("use_sim_time") is True:
        met.add(BuiltinCondition.SIM_TIME)
    if node.parameters.get("start_type_description_service") is not False:
        met.add(BuiltinCondition.TYPE_DESCRIPTION)
    if node.role == "lifecycle_node" or node.interface.lifecycle:
        met.add(BuiltinCondition.LIFECYCLE)
    if node.role == "container":
        met.add(BuiltinCondition.CONTAINER)
    if _listens_to_tf(node.interface):
        met.add(BuiltinCondition.TF_LISTENER)
    return frozenset(met)


def _listens_to_tf(interface: NodeInterface) -> bool:
    return any(
        endpoint.kind is EndpointKind.SUBSCRIPTION and endpoint.name.parts == ("/tf",)
        for endpoint in interface.endpoints
    )


def _event_of(service_type: str) -> str:
    """Return the type of what service introspection publishes (rosidl; ``Foo.srv`` has ``Foo_Event``)."""
    return f"{service_type}_Event" if service_type else ""
