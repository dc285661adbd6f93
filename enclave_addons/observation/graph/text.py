"""An observed graph for a person. Performs no I/O."""

from __future__ import annotations

from collections.abc import Iterator

from enclave_addons.observation.graph.model import Attribution, Graph, GraphProcess, SeenInterface
from enclave_common.words import counted


def graph_text(graph: Graph) -> str:
    """Return one block for each process: who it is, its nodes, and what they have."""
    blocks = ["\n".join(_process(process)) for process in graph.processes]
    nodes = sum(1 for _ in graph.nodes)
    return (
        "\n\n".join([*blocks, f"{counted(len(graph.processes), 'participant')}, {counted(nodes, 'node')}"])
        + "\n"
    )


def participant_text(process: GraphProcess) -> str:
    """Return how a participant is called in messages."""
    seen = process.participant
    words = [f"process {seen.pid}" if seen.pid is not None else f"participant {seen.prefix}"]
    if seen.program:
        words.append(f"({seen.program})")
    if seen.host:
        words.append(f"on {seen.host}")
    return " ".join(words)


def _process(process: GraphProcess) -> Iterator[str]:
    seen = process.participant
    secured = "says that it is secured" if seen.claims_security else "not secured"
    yield f"{participant_text(process)}, enclave {seen.enclave or '(none announced)'}, {secured}"
    for node in process.nodes:
        yield f"  {node.fqn}"
        yield from (f"    {_interface(each)}" for each in node.interfaces)
    if process.unowned:
        yield "  of no node that is known:"
        yield from (f"    {_interface(each)}" for each in process.unowned)
    for endpoint in process.foreign:
        verb = "writes" if endpoint.writes else "reads"
        yield f"  not ROS: {verb} {endpoint.topic} [{endpoint.type}]"


def _interface(interface: SeenInterface) -> str:
    words = [f"{interface.kind.value.replace('_', ' ')} {interface.name} [{interface.type}]"]
    qualities = sorted({(e.quality.reliability, e.quality.durability) for e in interface.endpoints})
    if interface.kind.value in ("publisher", "subscription") and qualities:
        words.append("; ".join(" ".join(each).lower().replace("_", " ") for each in qualities))
    if interface.by is not Attribution.LIST:
        words.append(f"known by {interface.by}")
    if interface.missing:
        words.append(f"half open, without {', '.join(interface.missing)}")
    return ", ".join(words)
