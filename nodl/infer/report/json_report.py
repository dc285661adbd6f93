"""The JSON form of an inferred system: a contract with whoever reads it."""

from __future__ import annotations

from enclave_launch.boundary.terminal import json_text
from nodl.infer.report.expanded import ExpandedInterface, ExpandedNode, ExpandedSystem


def to_json(system: ExpandedSystem, *, built_in: bool = False) -> str:
    """``{"nodes": [...], "unresolved": [...]}``; built-in interfaces only with ``built_in``."""
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
