"""An inferred system under final names: every interface expanded as rcl does it, what is open listed apart.

All writers read this; names here are those that apply when launch changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from nodl.builtin_interfaces import PARAMETER_SERVICES
from nodl.infer.results import remapped
from nodl.infer.system import InferredSystem
from nodl.name_template import NameTemplate, UnknownPart
from nodl.names import InvalidNameError, expand_name
from nodl.node_interface import Certainty, ClientLibrary, Endpoint, EndpointKind, NodeInterface
from nodl.remap import RemapRules, parse_rule
from nodl.source_ref import SourceRef

_STAR = "STAR_OF_A_PATTERN"
_NODE = "NAME_OF_THE_NODE"


@dataclass(frozen=True, slots=True)
class ExpandedInterface:
    """One interface under its fully qualified name (``*`` for what is not known of it)."""

    kind: EndpointKind
    name: str
    type: str
    certainty: Certainty
    source: SourceRef
    built_in: bool = False


@dataclass(frozen=True, slots=True)
class ExpandedNode:
    """A node with all its interfaces, built-in ones included; ``*`` stands for a name that is not known."""

    interface: NodeInterface
    interfaces: tuple[ExpandedInterface, ...]
    programs: tuple[str, ...] = ()  # executables and plugins of packages that hold it

    @property
    def name(self) -> str:
        return self.interface.name or "*"

    @property
    def namespace(self) -> str:
        return self.interface.namespace or "/"


@dataclass(frozen=True, slots=True)
class OpenQuestion:
    """Something that the analysis could not find out, with the place in the source."""

    source: SourceRef
    why: str


@dataclass(frozen=True, slots=True)
class ExpandedSystem:
    """All nodes by namespace and name, and by place what stayed open, each question once."""

    nodes: tuple[ExpandedNode, ...]
    unresolved: tuple[OpenQuestion, ...]


def expand(system: InferredSystem) -> ExpandedSystem:
    """Sorted by node and place; equal questions are asked once."""
    unresolved: dict[OpenQuestion, None] = {}
    nodes = []
    for written, programs in _told_once(system.nodes):
        interface = _under_own_rules(written)
        found: list[ExpandedInterface] = []
        for endpoint in interface.endpoints:
            for expanded, why in _expanded(endpoint, interface):
                if why:
                    unresolved[OpenQuestion(endpoint.source, why)] = None
                if expanded is not None:
                    found.append(expanded)
        for gap in interface.gaps:
            unresolved[OpenQuestion(gap.source, gap.why)] = None
        found.extend(_built_in(interface))
        nodes.append(ExpandedNode(interface, tuple(dict.fromkeys(found)), programs))
    for gap in system.gaps:
        unresolved[OpenQuestion(gap.source, gap.why)] = None
    nodes.sort(key=lambda node: (node.namespace, node.name, node.interface.source))
    return ExpandedSystem(tuple(nodes), tuple(sorted(unresolved, key=lambda q: (q.source, q.why))))


def _told_once(nodes: Iterable[NodeInterface]) -> list[tuple[NodeInterface, tuple[str, ...]]]:
    """Each node with every program that holds it; the gaps are those of all of them."""
    found: dict[object, NodeInterface] = {}
    programs: dict[object, dict[str, None]] = {}
    for node in nodes:
        key = node._replace(executable=None, plugin=None, gaps=())
        before = found.setdefault(key, node)
        found[key] = before._replace(gaps=tuple(dict.fromkeys((*before.gaps, *node.gaps))))
        names = [each for each in (node.executable, node.plugin) if each]
        programs.setdefault(key, {}).update(dict.fromkeys(f"{node.package}/{name}" for name in names))
    return [(found[key], tuple(programs[key])) for key in found]


def _under_own_rules(node: NodeInterface) -> NodeInterface:
    """Under the remap rules that the program itself gives to the node."""
    return remapped(node, RemapRules(tuple(map(parse_rule, node.own_rules)), ())) if node.own_rules else node


def _expanded(endpoint: Endpoint, node: NodeInterface) -> Iterator[tuple[ExpandedInterface | None, str]]:
    """The interface of each name that ``endpoint`` has by default, and what is open about it."""
    kind = endpoint.kind.value.replace("_", " ")
    filled = endpoint.name.unconditional.fill_each({})
    if not filled:
        yield None, ""
    for template in filled:
        why = "" if template.is_literal else f"{kind} {endpoint.name}: {_why(template)}"
        try:
            name = _full_name(template, node)
        except InvalidNameError as error:
            yield None, f"{kind}: {error}"
            continue
        yield ExpandedInterface(endpoint.kind, name, endpoint.type, endpoint.certainty, endpoint.source), why


def _why(template: NameTemplate) -> str:
    reasons = [part.why for part in template.parts if isinstance(part, UnknownPart) and part.why]
    return "; ".join(reasons) or "the name is not known"


def _full_name(template: NameTemplate, node: NodeInterface) -> str:
    if isinstance(template.parts[0] if template.parts else "", UnknownPart):
        return template.text  # not even whether it is absolute is known
    text = template.text.replace("*", _STAR)
    full = expand_name(text, namespace=node.namespace or "/", node=node.name or _NODE)
    return full.replace(_STAR, "*").replace(_NODE, "*")


# --- built-in interfaces ------------------------------------------------------------------------------------

_LIFECYCLE_SERVICES = {
    "change_state": "lifecycle_msgs/srv/ChangeState",
    "get_state": "lifecycle_msgs/srv/GetState",
    "get_available_states": "lifecycle_msgs/srv/GetAvailableStates",
    "get_available_transitions": "lifecycle_msgs/srv/GetAvailableTransitions",
    "get_transition_graph": "lifecycle_msgs/srv/GetAvailableTransitions",
}


def _built_in(node: NodeInterface) -> Iterator[ExpandedInterface]:
    """What every node of a current distribution (iron and later) has, by client library."""
    base = f"{'' if node.namespace in (None, '/') else node.namespace}/{node.name or '*'}"

    def made(kind: EndpointKind, name: str, type_name: str) -> ExpandedInterface:
        return ExpandedInterface(kind, name, type_name, Certainty.EXACT, node.source, built_in=True)

    events = "rcl_interfaces/msg/ParameterEvent"
    yield made(EndpointKind.PUBLISHER, "/parameter_events", events)
    yield made(EndpointKind.PUBLISHER, "/rosout", "rcl_interfaces/msg/Log")
    if node.library is ClientLibrary.RCLCPP:
        yield made(EndpointKind.SUBSCRIPTION, "/parameter_events", events)
    for service, type_name in PARAMETER_SERVICES.items():
        yield made(EndpointKind.SERVICE_SERVER, f"{base}/{service}", type_name)
    description = "type_description_interfaces/srv/GetTypeDescription"
    yield made(EndpointKind.SERVICE_SERVER, f"{base}/get_type_description", description)
    if node.lifecycle:
        for service, type_name in _LIFECYCLE_SERVICES.items():
            yield made(EndpointKind.SERVICE_SERVER, f"{base}/{service}", type_name)
        transition = "lifecycle_msgs/msg/TransitionEvent"
        yield made(EndpointKind.PUBLISHER, f"{base}/transition_event", transition)
