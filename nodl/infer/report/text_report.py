"""The form for reading: a node, its interfaces, where they are made, and what stayed open."""

from __future__ import annotations

from enclave_launch.boundary.terminal import printable
from nodl.infer.report.expanded import ExpandedSystem


def to_text(system: ExpandedSystem, *, built_in: bool = False) -> str:
    """A line for each node, interface and open question; built-in interfaces only if ``built_in``."""
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
