"""Requests of a recorded node by the caller of rcl, without those that libraries make for every node."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum
from itertools import takewhile
from types import MappingProxyType
from typing import NamedTuple

from enclave_addons.recording.record.assembly import RecordedNode, RecordedProcess
from enclave_addons.recording.record.lines import EndpointMade
from enclave_addons.recording.record.written import meant_name
from nodl.builtin_interfaces import LOGGER_SERVICES, PARAMETER_SERVICES
from nodl.node_interface import ClientLibrary, EndpointKind
from nodl.remap import RemapRules, valid_rules

REFUSED = 1
"""``RCL_RET_ERROR``: what an endpoint gives that DDS refuses. Other results say that an argument is bad."""

_INTROSPECTION = "/_service_event"
_FIRST_PART = "/_action/send_goal"


class EndpointRole(Enum):
    """Why an endpoint is there."""

    OWN = "requested by the program"
    BUILT_IN = "every node has it"
    LIFECYCLE = "every lifecycle node has it"
    CONTAINER = "every component container has it"
    LOGGER_SERVICE = "the node's logger service"
    INTROSPECTION = "introspection of a service"
    PART_OF_ACTION = "part of an action"
    REPEATED = "rcl calls itself"


class RequestedEndpoint(NamedTuple):
    """One endpoint that the program requested.

    ``written`` as rcl got it, ``name`` as the source means it (``~/x`` for a name made from the node's own),
    ``final`` after expansion and remapping; for an action that of its parts. ``moved``: rules that the program
    itself holds made ``final`` of it, not those of the launch. ``introspected``: its service events are published.
    ``spellings``: what the source may write as well, where only ``final`` was observed; ``readings``: what it may mean
    as well by a name that begins with the node's own place.
    """

    kind: EndpointKind
    written: str
    name: str
    final: str
    type: str
    rc: int
    qos: tuple[int, ...] = ()
    error: tuple[str, ...] = ()
    moved: bool = False
    introspected: bool = False
    at: int = 0
    spellings: tuple[str, ...] = ()
    readings: tuple[str, ...] = ()

    @property
    def granted(self) -> bool:
        return self.rc == 0


class StartedNode(NamedTuple):
    """The start of a node as a record, a plan or a command line reports it.

    ``fqn`` and ``namespace`` are those of a plan, ``fqn`` empty if it gives no name; ``command`` is empty for a
    component, whose rules are those of the load request.
    """

    package: str = ""
    executable: str = ""
    plugin: str = ""
    fqn: str = ""
    namespace: str = ""
    command: tuple[str, ...] = ()
    rule_texts: tuple[str, ...] = ()
    parameters: Mapping[str, object] = MappingProxyType({})
    arguments: tuple[str, ...] = ()

    @property
    def program(self) -> str:
        return f"{self.package}/{self.plugin or self.executable}"

    @property
    def rules(self) -> RemapRules:
        """Return the rules that act on the node; one that rcl would refuse cannot have acted."""
        rules = valid_rules(self.rule_texts)
        return RemapRules(local=rules) if self.plugin else RemapRules(process=rules)


class RequestedNode(NamedTuple):
    """The requests of one node. ``name`` and ``namespace`` are the source's own, ``fqn`` the final name.

    ``known_start``: a line of the supervisor reports its start; ``declared``: values of parameters that the node
    declared; ``started_as``: what the launch calls it (``node``, ``component`` ...).
    """

    start: StartedNode
    name: str
    namespace: str
    fqn: str
    library: ClientLibrary
    lifecycle: bool
    states: tuple[str, ...]
    endpoints: tuple[RequestedEndpoint, ...]
    known_start: bool
    logger_services: bool = False
    container: bool = False
    process: str = ""
    location: str = ""
    distro: str = ""
    started_as: str = ""
    declared: Mapping[str, object] = MappingProxyType({})


def role_of(endpoint: EndpointMade) -> EndpointRole:
    """Return why ``endpoint`` is there."""
    by, kind, final = endpoint.by, endpoint.kind, endpoint.final or endpoint.written
    if by == "librcl.so":
        return EndpointRole.INTROSPECTION if final.endswith(_INTROSPECTION) else EndpointRole.BUILT_IN
    if by == "librcl_lifecycle.so":
        return EndpointRole.LIFECYCLE
    if by == "librcl_action.so":
        return EndpointRole.REPEATED if kind.family == "action" else EndpointRole.PART_OF_ACTION
    if kind is EndpointKind.SERVICE_SERVER:
        return _role_of_server(endpoint)
    if endpoint.written == "/parameter_events" and endpoint.type in ("", "rcl_interfaces/msg/ParameterEvent"):
        published = kind is EndpointKind.PUBLISHER
        return EndpointRole.BUILT_IN if published or not _is_rclpy(by) else EndpointRole.OWN
    return EndpointRole.OWN


def _role_of_server(endpoint: EndpointMade) -> EndpointRole:
    if endpoint.written.startswith("~/_container/"):
        return EndpointRole.CONTAINER
    _, slash, last = endpoint.written.rpartition("/")
    own_name = endpoint.fqn.rpartition("/")[2]
    mine = slash and endpoint.written in (f"{own_name}/{last}", f"{endpoint.fqn}/{last}")
    if not mine or not (endpoint.type == "" or endpoint.type.startswith("rcl_interfaces/")):
        return EndpointRole.OWN
    if last in PARAMETER_SERVICES:
        return EndpointRole.BUILT_IN
    return EndpointRole.LOGGER_SERVICE if last in LOGGER_SERVICES else EndpointRole.OWN


def requested_by(process: RecordedProcess, node: RecordedNode) -> RequestedNode:
    """Return what ``node`` requested, with what the launch started there."""
    started, component = process.started, node.component
    made = node.made
    roles = [role_of(endpoint) for endpoint in node.endpoints]
    endpoints = tuple(_requested_endpoints(node, roles, _rules(process, node)))
    origin = component or started
    return RequestedNode(
        start=_start(process, node),
        name=made.name if made else "",
        namespace=_namespace(made.namespace if made else ""),
        fqn=node.fqn,
        library=_library(node),
        lifecycle=EndpointRole.LIFECYCLE in roles,
        states=tuple(node.states),
        endpoints=endpoints,
        known_start=started is not None,
        logger_services=EndpointRole.LOGGER_SERVICE in roles,
        container=EndpointRole.CONTAINER in roles,
        process=started.process if started else str(process.pid),
        location=origin.location if origin else "",
        started_as="component" if component else (started.kind if started else ""),
        declared=node.declared,
    )


def requested_endpoint(
    process: RecordedProcess, node: RecordedNode, endpoint: EndpointMade
) -> RequestedEndpoint | None:
    """Return ``endpoint`` of ``node`` as it comes in; None for a part of an action, or rcl's own call."""
    if role_of(endpoint) in (EndpointRole.PART_OF_ACTION, EndpointRole.REPEATED):
        return None
    return _own(endpoint, node, _rules(process, node), set())


def parts_of(node: RecordedNode, endpoint: EndpointMade) -> list[EndpointMade]:
    """Return the services and topics of an action, which are made before it; none for any other endpoint."""
    parts: list[EndpointMade] = []
    if endpoint.kind.family != "action":
        return parts
    for each in takewhile(lambda each: each is not endpoint, node.endpoints):
        role = role_of(each)
        if role is EndpointRole.PART_OF_ACTION:
            parts.append(each)
        elif role is EndpointRole.OWN and each.kind.family == "action":
            parts.clear()
    return parts


def all_requested(processes: Iterable[RecordedProcess]) -> list[RequestedNode]:
    """Return every node that could be made, in the order of the record."""
    return [
        requested_by(process, node) for process in processes for node in process.nodes.values() if node.fqn
    ]


def _start(process: RecordedProcess, node: RecordedNode) -> StartedNode:
    started, component = process.started, node.component
    if component is not None:
        return StartedNode(
            component.package,
            plugin=component.plugin,
            rule_texts=component.rules,
            parameters=component.parameters,
        )
    if started is not None:
        return StartedNode(
            started.package,
            started.executable.rpartition("/")[2],
            rule_texts=started.rules,
            parameters=started.parameters,
            arguments=started.arguments,
        )
    return StartedNode(executable=process.loaded.program.rpartition("/")[2] if process.loaded else "")


def _rules(process: RecordedProcess, node: RecordedNode) -> RemapRules | None:
    """Return the launch's rules; None if it is not known what started the process."""
    return _start(process, node).rules if process.started else None


def _requested_endpoints(
    node: RecordedNode, roles: list[EndpointRole], rules: RemapRules | None
) -> Iterable[RequestedEndpoint]:
    introspected = {
        endpoint.final.removesuffix(_INTROSPECTION)
        for endpoint, role in zip(node.endpoints, roles, strict=True)
        if role is EndpointRole.INTROSPECTION
    }
    for endpoint, role in zip(node.endpoints, roles, strict=True):
        if role is EndpointRole.OWN:
            yield _own(endpoint, node, rules, introspected)


def _own(
    endpoint: EndpointMade, node: RecordedNode, rules: RemapRules | None, introspected: set[str]
) -> RequestedEndpoint:
    final = _final_name(node, endpoint)
    meant = meant_name(endpoint.kind, endpoint.written, final, node.fqn or endpoint.fqn, rules)
    return RequestedEndpoint(
        endpoint.kind,
        endpoint.written,
        meant.name,
        final,
        endpoint.type,
        endpoint.rc,
        endpoint.qos,
        endpoint.error,
        meant.moved,
        final in introspected,
        endpoint.at,
    )


def _final_name(node: RecordedNode, endpoint: EndpointMade) -> str:
    """Return the final name, of an action that of its parts.

    Only they have the name that it gets: rcl of jazzy and older does not remap actions, though it resolves their names
    as if it did.
    """
    for part in reversed(parts_of(node, endpoint)):
        if part.final.endswith(_FIRST_PART):
            return part.final.removesuffix(_FIRST_PART)
    return endpoint.final


def _namespace(written: str) -> str:
    return "/" + written.strip("/") if written.strip("/") else ""


def _library(node: RecordedNode) -> ClientLibrary:
    callers = [node.made.by] if node.made else []
    callers += [endpoint.by for endpoint in node.endpoints]
    if any(_is_rclpy(by) for by in callers):
        return ClientLibrary.RCLPY
    of_rclcpp = any(by.startswith("librclcpp") for by in callers)
    return ClientLibrary.RCLCPP if of_rclcpp else ClientLibrary.UNKNOWN


def _is_rclpy(library: str) -> bool:
    return library.startswith("_rclpy")
