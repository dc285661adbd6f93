"""An inferred system under final names, written down: as JSON (a contract with whoever reads it), as text, as a policy.

The policy (SROS2, version 0.2.0) has the least permissions of each node, one enclave for each, as the names stand
before launch changes them; ``secure-launch`` derives policies per process with remappings.
"""

from __future__ import annotations

from enclave_common.terminal import json_text, printable
from nodl.infer.report.expanded import ExpandedInterface, ExpandedNode, ExpandedSystem
from nodl.node_interface import EndpointKind
from nodl.policy_text import policy_text, profile_lines


def to_json(system: ExpandedSystem, *, built_in: bool = False) -> str:
    """Write ``{"nodes": [...], "unresolved": [...]}``; built-in interfaces only with ``built_in``."""
    document = {
        "nodes": [_node(node, built_in) for node in system.nodes],
        "unresolved": [
            {"file": question.source.file, "line": question.source.line, "why": question.why}
            for question in system.unresolved
        ],
    }
    return json_text(document, indent=2) + "\n"


def _node(node: ExpandedNode, built_in: bool) -> dict[str, object]:
    return {
        "name": node.name,
        "namespace": node.namespace,
        "file": node.interface.source.file,
        "line": node.interface.source.line,
        **({"programs": list(node.programs)} if node.programs else {}),
        **({"lifecycle": True} if node.interface.lifecycle else {}),
        "interfaces": [_interface(each) for each in node.interfaces if built_in or not each.built_in],
    }


def _interface(interface: ExpandedInterface) -> dict[str, object]:
    return {
        "kind": interface.kind.value,
        "name": interface.name,
        "type": interface.type,
        "certainty": interface.certainty.value,
        "file": interface.source.file,
        "line": interface.source.line,
    }


def to_text(system: ExpandedSystem, *, built_in: bool = False) -> str:
    """Return a line for each node, interface and open question; built-in interfaces only if ``built_in``."""
    lines: list[str] = []
    for node in system.nodes:
        held = f" in {', '.join(node.programs)}" if node.programs else ""
        lines.append(f"{node.namespace.rstrip('/')}/{node.name}{held}  ({node.interface.source})")
        for interface in node.interfaces:
            if built_in or not interface.built_in:
                kind = interface.kind.value.replace("_", " ")
                note = "" if interface.certainty.value == "exact" else f"  [{interface.certainty.value}]"
                shown_type = f" [{interface.type}]" if interface.type else ""
                lines.append(f"  {kind:15} {interface.name}{shown_type}{note}  {interface.source}")
    if system.unresolved:
        lines.append(f"{len(system.unresolved)} unresolved:")
        lines.extend(f"  {question.source}: {question.why}" for question in system.unresolved)
    return "".join(f"{printable(line)}\n" for line in lines)


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
