"""Manifests to start from: NoDL v1, one for each package (``v2_report`` writes version 2).

Names stay as the code writes them (relative, private), so that they survive a change of namespace. What a
manifest cannot say (a name known in part) is left out and told in a comment.
"""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from nodl.infer.system import InferredSystem
from nodl.node_interface import Endpoint, EndpointKind, NodeInterface


def to_v1(system: InferredSystem) -> dict[str, str]:
    """Map file name to text: one document per package (``nodes.nodl.xml`` for nodes of none)."""
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
        elements.setdefault((kind.family, name, type_name), []).append(kind.role)
    lines = []
    for (tag, name, type_name), roles in sorted(elements.items()):
        role = roles[0] if len(roles) == 1 else "both"
        lines.append(
            f"    <{tag} name={quoteattr(name)} type={quoteattr(type_name)} role={quoteattr(role)}/>"
        )
    return lines


def _split(node: NodeInterface) -> tuple[dict[tuple[EndpointKind, str], str], list[Endpoint]]:
    """Return what a manifest can say, by kind and name, and the endpoints that it cannot."""
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
