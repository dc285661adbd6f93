"""Manifests to start from: NoDL v1 per package, NoDL v2 per node.

Names stay as the code writes them (relative, private), so that they survive a change of namespace. What a
manifest cannot say (a name known in part) is left out and told in a comment.
"""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from nodl.infer.system import InferredSystem
from nodl.node_interface import Endpoint, EndpointKind, NodeInterface

_V1 = {
    EndpointKind.PUBLISHER: ("topic", "publisher"),
    EndpointKind.SUBSCRIPTION: ("topic", "subscription"),
    EndpointKind.SERVICE_SERVER: ("service", "server"),
    EndpointKind.SERVICE_CLIENT: ("service", "client"),
    EndpointKind.ACTION_SERVER: ("action", "server"),
    EndpointKind.ACTION_CLIENT: ("action", "client"),
}
_V2 = {
    EndpointKind.PUBLISHER: "publishers",
    EndpointKind.SUBSCRIPTION: "subscriptions",
    EndpointKind.SERVICE_SERVER: "service_servers",
    EndpointKind.SERVICE_CLIENT: "service_clients",
    EndpointKind.ACTION_SERVER: "action_servers",
    EndpointKind.ACTION_CLIENT: "action_clients",
}


def to_v1(system: InferredSystem) -> dict[str, str]:
    """File name -> text: one document per package (``nodes.nodl.xml`` for nodes of none)."""
    packages: dict[str, list[NodeInterface]] = {}
    for node in system.nodes:
        packages.setdefault(f"{node.package or 'nodes'}.nodl.xml", []).append(node)
    return {file: _v1_document(nodes) for file, nodes in sorted(packages.items())}


def _v1_document(nodes: list[NodeInterface]) -> str:
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<interface version="1">']
    for node in nodes:
        said, unsaid = _split(node)
        lines.extend(f"  <!-- {node.name or '?'}: {_comment(endpoint)} -->" for endpoint in unsaid)
        if not said:
            continue
        name = node.name or "unknown"
        executable = node.executable or node.plugin or name
        lines.append(f"  <node name={quoteattr(name)} executable={quoteattr(executable)}>")
        lines.extend(_v1_elements(said))
        lines.append("  </node>")
    return "\n".join([*lines, "</interface>", ""])


def _v1_elements(said: dict[tuple[EndpointKind, str], str]) -> list[str]:
    elements: dict[tuple[str, str, str], list[str]] = {}
    for (kind, name), type_name in said.items():
        tag, role = _V1[kind]
        elements.setdefault((tag, name, type_name), []).append(role)
    lines = []
    for (tag, name, type_name), roles in sorted(elements.items()):
        role = roles[0] if len(roles) == 1 else "both"
        lines.append(
            f"    <{tag} name={quoteattr(name)} type={quoteattr(type_name)} role={quoteattr(role)}/>"
        )
    return lines


def to_v2(system: InferredSystem) -> dict[str, str]:
    """File name -> text: one document per node, ``<executable or node name>.nodl.yaml``."""
    documents: dict[str, str] = {}
    for node in system.nodes:
        stem = node.executable or node.name or "unknown"
        file = f"{stem.removesuffix('.py')}.nodl.yaml"
        if file in documents:
            file = f"{stem.removesuffix('.py')}.{node.name}.nodl.yaml"
        documents[file] = _v2_document(node)
    return dict(sorted(documents.items()))


def _v2_document(node: NodeInterface) -> str:
    said, unsaid = _split(node)
    lines = [f"# Node {node.name or '(name not known)'}, inferred from {node.source}."]
    lines.append("# Quality of service is not inferred; put in what the code asks for.")
    lines.extend(f"# Not described: {_comment(endpoint)}" for endpoint in unsaid)
    lines.append("nodl_version: 2")
    for kind, category in _V2.items():
        entries = sorted((name, type_name) for (each, name), type_name in said.items() if each is kind)
        if entries:
            lines.append(f"{category}:")
        for name, type_name in entries:
            lines += [f"  - name: {_quoted(name)}", f"    type: {_quoted(type_name)}"]
            if kind in (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION):
                lines.append("    qos: {history: SYSTEM_DEFAULT, reliability: SYSTEM_DEFAULT}")
    return "\n".join([*lines, ""])


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def _split(node: NodeInterface) -> tuple[dict[tuple[EndpointKind, str], str], list[Endpoint]]:
    """What a manifest can say, by kind and name, and the endpoints that it cannot."""
    said: dict[tuple[EndpointKind, str], str] = {}
    unsaid: list[Endpoint] = []
    for endpoint in node.endpoints:
        for template in endpoint.name.unconditional.fill_each({}):
            if template.is_literal and endpoint.type:
                said.setdefault((endpoint.kind, template.text), endpoint.type)
            else:
                unsaid.append(endpoint)
    return said, unsaid


def _comment(endpoint: Endpoint) -> str:
    what = f"{endpoint.kind.value.replace('_', ' ')} {endpoint.name} [{endpoint.type or 'type not known'}]"
    return f"{what} at {endpoint.source}".replace("--", "- -")
