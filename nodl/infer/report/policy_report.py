"""An SROS2 policy (version 0.2.0) with the least permissions of each inferred node.

One enclave per node, as the names stand before launch changes them; ``secure-launch`` derives policies per
process with remappings. Schema: ros2/sros2 ``policy/schemas/policy.xsd``.
"""

from __future__ import annotations

from xml.sax.saxutils import escape, quoteattr

from nodl.infer.report.expanded import ExpandedSystem, Node
from nodl.node_interface import EndpointKind

# group, child, attribute, kind: in the order of the schema
_GROUPS = (
    ("topics", "topic", "publish", EndpointKind.PUBLISHER),
    ("topics", "topic", "subscribe", EndpointKind.SUBSCRIPTION),
    ("services", "service", "reply", EndpointKind.SERVICE_SERVER),
    ("services", "service", "request", EndpointKind.SERVICE_CLIENT),
    ("actions", "action", "execute", EndpointKind.ACTION_SERVER),
    ("actions", "action", "call", EndpointKind.ACTION_CLIENT),
)


def to_policy(system: ExpandedSystem, *, accept_patterns: bool = False) -> str:
    """Names known in part are left out unless ``accept_patterns``; names not known at all always are."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<policy version="0.2.0">', "  <enclaves>"]
    for node in system.nodes:
        if node.interface.name is not None:
            lines.extend(_enclave(node, accept_patterns))
    lines += ["  </enclaves>", "</policy>", ""]
    return "\n".join(lines)


def _enclave(node: Node, accept_patterns: bool) -> list[str]:
    path = f"{node.namespace.rstrip('/')}/{node.name}"
    lines = [
        f"    <enclave path={quoteattr(path)}>",
        "      <profiles>",
        f"        <profile ns={quoteattr(node.namespace)} node={quoteattr(node.name)}>",
    ]
    for group, child, attribute, kind in _GROUPS:
        names = sorted(
            {i.name for i in node.interfaces if i.kind is kind and _allowed(i.name, accept_patterns)}
        )
        if names:
            lines.append(f'          <{group} {attribute}="ALLOW">')
            lines.extend(f"            <{child}>{escape(name)}</{child}>" for name in names)
            lines.append(f"          </{group}>")
    return [*lines, "        </profile>", "      </profiles>", "    </enclave>"]


def _allowed(name: str, accept_patterns: bool) -> bool:
    if "*" not in name:
        return True
    return accept_patterns and name.startswith("/") and bool(name.replace("*", "").strip("/"))
