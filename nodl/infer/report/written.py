"""An inferred system under final names, written down: as JSON (a contract with whoever reads it) and as text."""

from __future__ import annotations

from enclave_common.terminal import json_text, printable
from nodl.infer.report.expanded import ExpandedInterface, ExpandedNode, ExpandedSystem


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
    }


def to_text(system: ExpandedSystem) -> str:
    """Return a line for each node, interface and open question."""
    lines: list[str] = []
    for node in system.nodes:
        held = f" in {', '.join(node.programs)}" if node.programs else ""
        lines.append(f"{node.namespace.rstrip('/')}/{node.name}{held}  ({node.interface.source})")
        for interface in node.interfaces:
            kind = interface.kind.value.replace("_", " ")
            note = "" if interface.certainty.value == "exact" else f"  [{interface.certainty.value}]"
            shown_type = f" [{interface.type}]" if interface.type else ""
            lines.append(f"  {kind:15} {interface.name}{shown_type}{note}  {interface.source}")
    if system.unresolved:
        lines.append(f"{len(system.unresolved)} unresolved:")
        lines.extend(f"  {question.source}: {question.why}" for question in system.unresolved)
    return "".join(f"{printable(line)}\n" for line in lines)
