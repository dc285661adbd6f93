"""An inferred system under final names, written down: as JSON (a contract with whoever reads it) and as text.

Every interface is expanded as rcl does it, under the names that apply when launch changes nothing; what is open is
listed apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from enclave_addons.inference.kernel.results import UNDECIDED
from enclave_addons.inference.system import InferredSystem
from enclave_common.source_location import SourceLocation
from enclave_common.terminal import json_text, printable
from nodl.name_template import NameTemplate, UnknownPart
from nodl.names import InvalidNameError, expand_name
from nodl.node_interface import Certainty, Endpoint, EndpointKind, Gap, NodeInterface

_STAR = "STAR_OF_A_PATTERN"
_NODE = "NAME_OF_THE_NODE"


class ExpandedInterface(NamedTuple):
    """One interface under its fully qualified name (``*`` for what is not known of it)."""

    kind: EndpointKind
    name: str
    type: str
    certainty: Certainty
    source: SourceLocation
    note: str


class ExpandedNode(NamedTuple):
    """A node with the interfaces that its source makes; ``*`` stands for a name that is not known."""

    interface: NodeInterface
    interfaces: tuple[ExpandedInterface, ...]
    programs: tuple[str, ...] = ()  # executables and plugins of packages that hold it

    @property
    def name(self) -> str:
        return self.interface.name or "*"

    @property
    def namespace(self) -> str:
        return self.interface.namespace or "/"


class ExpandedSystem(NamedTuple):
    """All nodes by namespace and name, and by place what stayed open, each question once."""

    nodes: tuple[ExpandedNode, ...]
    unresolved: tuple[Gap, ...]


def expand(system: InferredSystem) -> ExpandedSystem:
    """Sort by node and place; evaluate equal questions once."""
    unresolved = dict.fromkeys(system.gaps)
    nodes = []
    for interface, programs in _told_once(system.nodes):
        for rule in interface.own_rules:
            unresolved[Gap(interface.source, f"the program gives its node the rule {rule}")] = None
        found: list[ExpandedInterface] = []
        for endpoint in interface.endpoints:
            for expanded, why in _expanded(endpoint, interface):
                if why:
                    unresolved[Gap(endpoint.source, why)] = None
                if expanded is not None:
                    found.append(expanded)
        unresolved.update(dict.fromkeys(interface.gaps))
        nodes.append(ExpandedNode(interface, tuple(dict.fromkeys(found)), programs))
    nodes.sort(key=lambda node: (node.namespace, node.name, node.interface.source))
    return ExpandedSystem(tuple(nodes), tuple(sorted(unresolved)))


def _told_once(nodes: Iterable[NodeInterface]) -> list[tuple[NodeInterface, tuple[str, ...]]]:
    """Return each node with every program that holds it; the gaps are those of all of them."""
    found: dict[object, NodeInterface] = {}
    programs: dict[object, dict[str, None]] = {}
    for node in nodes:
        key = node._replace(executable=None, plugin=None, gaps=())
        before = found.setdefault(key, node)
        found[key] = before._replace(gaps=tuple(dict.fromkeys((*before.gaps, *node.gaps))))
        names = [each for each in (node.executable, node.plugin) if each]
        programs.setdefault(key, {}).update(dict.fromkeys(f"{node.package}/{name}" for name in names))
    return [(found[key], tuple(programs[key])) for key in found]


def _expanded(endpoint: Endpoint, node: NodeInterface) -> Iterator[tuple[ExpandedInterface | None, str]]:
    """Return the interface of each name that ``endpoint`` has by default, and what is open about it."""
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
        note = endpoint.note if endpoint.name == endpoint.name.unconditional else UNDECIDED
        yield (
            ExpandedInterface(endpoint.kind, name, endpoint.type, endpoint.certainty, endpoint.source, note),
            why,
        )


def _why(template: NameTemplate) -> str:
    reasons = [part.why for part in template.parts if isinstance(part, UnknownPart) and part.why]
    return "; ".join(reasons) or "the name is not known"


def _full_name(template: NameTemplate, node: NodeInterface) -> str:
    if isinstance(template.parts[0] if template.parts else "", UnknownPart):
        return template.text  # not even whether it is absolute is known
    text = template.text.replace("*", _STAR)
    full = expand_name(text, namespace=node.namespace or "/", node=node.name or _NODE)
    return full.replace(_STAR, "*").replace(_NODE, "*")


def to_json(system: ExpandedSystem) -> str:
    """Write ``{"nodes": [...], "unresolved": [...]}``."""
    document = {
        "nodes": [_node(node) for node in system.nodes],
        "unresolved": [
            {"file": question.source.file, "line": question.source.line, "why": question.why}
            for question in system.unresolved
        ],
    }
    return json_text(document, indent=2) + "\n"


def _node(node: ExpandedNode) -> dict[str, object]:
    return {
        "name": node.name,
        "namespace": node.namespace,
        "file": node.interface.source.file,
        "line": node.interface.source.line,
        **({"programs": list(node.programs)} if node.programs else {}),
        **({"lifecycle": True} if node.interface.lifecycle else {}),
        "interfaces": [_interface(each) for each in node.interfaces],
    }


def _interface(interface: ExpandedInterface) -> dict[str, object]:
    return {
        "kind": interface.kind.value,
        "name": interface.name,
        "type": interface.type,
        "certainty": interface.certainty.value,
        "file": interface.source.file,
        "line": interface.source.line,
        **({"note": interface.note} if interface.note else {}),
    }


def to_text(system: ExpandedSystem) -> str:
    """Return a line for each node, interface and open question."""
    lines: list[str] = []
    for node in system.nodes:
        held = f" in {', '.join(node.programs)}" if node.programs else ""
        lines.append(f"{node.namespace.rstrip('/')}/{node.name}{held}  ({node.interface.source})")
        for interface in node.interfaces:
            kind = interface.kind.value.replace("_", " ")
            said = (
                "" if interface.certainty is Certainty.EXACT else interface.certainty.value,
                interface.note,
            )
            note = "".join(f"  [{each}]" for each in said if each)
            shown_type = f" [{interface.type}]" if interface.type else ""
            lines.append(f"  {kind:15} {interface.name}{shown_type}{note}  {interface.source}")
    if system.unresolved:
        lines.append(f"{len(system.unresolved)} unresolved:")
        lines.extend(f"  {question.source}: {question.why}" for question in system.unresolved)
    return "".join(f"{printable(line)}\n" for line in lines)
