"""The text of an SROS2 policy (version 0.2.0). Schema: ros2/sros2 ``policy/schemas/policy.xsd``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.sax.saxutils import escape, quoteattr

from nodl.node_interface import EndpointKind

Names = Mapping[EndpointKind, Iterable[str]]

# group, child, attribute, kind: in the order of the schema
_GROUPS = (
    ("topics", "topic", "publish", EndpointKind.PUBLISHER),
    ("topics", "topic", "subscribe", EndpointKind.SUBSCRIPTION),
    ("services", "service", "reply", EndpointKind.SERVICE_SERVER),
    ("services", "service", "request", EndpointKind.SERVICE_CLIENT),
    ("actions", "action", "execute", EndpointKind.ACTION_SERVER),
    ("actions", "action", "call", EndpointKind.ACTION_CLIENT),
)


def policy_text(enclaves: Mapping[str, Iterable[str]]) -> str:
    """Render a policy. ``enclaves``: path → the lines of its profiles."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<policy version="0.2.0">', "  <enclaves>"]
    for path, profiles in enclaves.items():
        lines += [f"    <enclave path={quoteattr(path)}>", "      <profiles>", *profiles]
        lines += ["      </profiles>", "    </enclave>"]
    return "\n".join([*lines, "  </enclaves>", "</policy>", ""])


def profile_lines(namespace: str, node: str, names: Names) -> list[str]:
    """Render the profile of one node; groups without names are left out."""
    lines = [f"        <profile ns={quoteattr(namespace)} node={quoteattr(node)}>"]
    for group, child, attribute, kind in _GROUPS:
        of_kind = sorted(set(names.get(kind, ())))
        if of_kind:
            lines.append(f'          <{group} {attribute}="ALLOW">')
            lines += [f"            <{child}>{escape(name)}</{child}>" for name in of_kind]
            lines.append(f"          </{group}>")
    return [*lines, "        </profile>"]
