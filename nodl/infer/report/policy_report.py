"""An SROS2 policy (version 0.2.0) with the least permissions of each inferred node.

One enclave per node, as the names stand before launch changes them; ``secure-launch`` derives policies per
process with remappings.
"""

from __future__ import annotations

from nodl.infer.report.expanded import ExpandedNode, ExpandedSystem
from nodl.node_interface import EndpointKind
from nodl.policy_text import policy_text, profile_lines


def to_policy(system: ExpandedSystem, *, accept_patterns: bool = False) -> str:
    """Names known in part are left out unless ``accept_patterns``; names not known at all always are."""
    enclaves: dict[str, list[str]] = {}
    for node in system.nodes:
        if node.interface.name is not None:
            path = f"{node.namespace.rstrip('/')}/{node.name}"
            enclaves.setdefault(path, []).extend(_profile(node, accept_patterns))
    return policy_text(enclaves)


def _profile(node: ExpandedNode, accept_patterns: bool) -> list[str]:
    names: dict[EndpointKind, list[str]] = {}
    for interface in node.interfaces:
        if _allowed(interface.name, accept_patterns):
            names.setdefault(interface.kind, []).append(interface.name)
    return profile_lines(node.namespace, node.name or "", names)


def _allowed(name: str, accept_patterns: bool) -> bool:
    if "*" not in name:
        return True
    return accept_patterns and name.startswith("/") and bool(name.replace("*", "").strip("/"))
