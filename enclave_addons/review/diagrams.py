"""The graph of a plan in two languages that draw pictures: dot (Graphviz) and Mermaid (in Markdown on code hosts).

Elements are numbered; names stand in quoted labels only, escaped. What every node has is left out."""

from __future__ import annotations

import html
from collections.abc import Iterator

from enclave_addons.review.document import Kind
from enclave_addons.review.graph import NO_ENCLAVE, OUTWARD, ChannelUse, EnclaveGraph
from enclave_common.terminal import printable

_DOT_SHAPES: dict[Kind, str] = {"topic": "ellipse", "service": "box", "action": "hexagon"}
_MERMAID_SHAPES: dict[Kind, tuple[str, str]] = {
    "topic": ("([", "])"),
    "service": ("[", "]"),
    "action": ("{{", "}}"),
}


def dot(graph: EnclaveGraph) -> str:
    """Format the graph as a Graphviz digraph with a cluster for each enclave."""
    lines = ["digraph launch {", "  rankdir=LR; compound=true; node [fontname=sans]; edge [fontname=sans];"]
    for number, (enclave, members) in enumerate(_groups(graph)):
        lines.append(f"  subgraph cluster_{number} {{ label={_dot_text(_label(enclave))};")
        for member in members:
            style = "solid" if graph.members[member].known else "dashed"
            text = _dot_text(graph.members[member].name)
            lines.append(f"    n{member} [shape=component, style={style}, label={text}];")
        if _holds_policy(graph, enclave):
            lines.append(f'    e{_number(graph, enclave)} [shape=note, label="policy file"];')
        lines.append("  }")
    for number in _shown(graph):
        channel = graph.channels[number]
        lines.append(f"  c{number} [shape={_DOT_SHAPES[channel.kind]}, label={_dot_text(channel.name)}];")
    lines += [f"  {one} -> {two};" for one, two in _arrows(graph)]
    return "\n".join([*lines, "}"]) + "\n"


def mermaid(graph: EnclaveGraph) -> str:
    """Format the graph as a Mermaid flowchart with a subgraph for each enclave."""
    lines = ["flowchart LR"]
    for number, (enclave, members) in enumerate(_groups(graph)):
        lines.append(f"  subgraph g{number} [{_mermaid_text(_label(enclave))}]")
        lines += [f"    n{member}[[{_mermaid_text(graph.members[member].name)}]]" for member in members]
        if _holds_policy(graph, enclave):
            lines.append(f'    e{_number(graph, enclave)}>"policy file"]')
        lines.append("  end")
    for number in _shown(graph):
        channel = graph.channels[number]
        opening, closing = _MERMAID_SHAPES[channel.kind]
        lines.append(f"  c{number}{opening}{_mermaid_text(channel.name)}{closing}")
    lines += [f"  {one} --> {two}" for one, two in _arrows(graph)]
    return "\n".join(lines) + "\n"


def _groups(graph: EnclaveGraph) -> Iterator[tuple[str, list[int]]]:
    members: dict[str, list[int]] = {path: [] for path in graph.enclaves}
    for number, member in enumerate(graph.members):
        members.setdefault(member.enclave, []).append(number)
    yield from sorted(members.items())


def _label(enclave: str) -> str:
    return "without an enclave" if enclave == NO_ENCLAVE else f"enclave {enclave}"


def _own(graph: EnclaveGraph) -> list[ChannelUse]:
    return [use for use in graph.uses if not use.built_in]


def _shown(graph: EnclaveGraph) -> list[int]:
    return sorted({use.channel for use in _own(graph)})


def _holds_policy(graph: EnclaveGraph, enclave: str) -> bool:
    return any(use.member is None and use.enclave == enclave for use in graph.uses)


def _number(graph: EnclaveGraph, enclave: str) -> int:
    return graph.enclaves.index(enclave)


def _arrows(graph: EnclaveGraph) -> Iterator[tuple[str, str]]:
    for use in _own(graph):
        member = f"e{_number(graph, use.enclave)}" if use.member is None else f"n{use.member}"
        ends = (member, f"c{use.channel}")
        yield ends if use.operation in OUTWARD else (ends[1], ends[0])


def _dot_text(text: str) -> str:
    """Quote an ID: only the quote is special there, and the backslash in labels (Graphviz, "The DOT Language")."""
    escaped = printable(text).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _mermaid_text(text: str) -> str:
    """Quote a label: Mermaid reads HTML there and has entity codes with ``#`` (Mermaid, "Flowcharts", entity codes)."""
    coded = html.escape(printable(text).replace("#", "#35;"), quote=False).replace("&", "#")
    escaped = coded.replace('"', "#quot;").replace("`", "#96;")
    return f'"{escaped}"'
