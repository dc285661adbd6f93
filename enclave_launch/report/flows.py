"""Influence between enclaves as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from enclave_launch.review.document import PlanDocument
from enclave_launch.review.information_flow import FlowGraph, FlowStep, opened_by_sharing, reached_from

MOST_WAYS = 3  # named for each step


def paths_text(source: str, target: str, paths: Sequence[Sequence[FlowStep]]) -> str:
    """The shortest ways from one enclave to another, or that there is none."""
    if not paths:
        return f"nothing flows from {source} to {target}, over any number of enclaves\n"
    count = f"{len(paths)} shortest ways" if len(paths) > 1 else "the shortest way"
    lines = [f"{source} can influence {target}; {count}:"]
    for path in paths:
        lines += [f"  {step_text(step)}" for step in path]
        lines.append("")
    return "\n".join(lines[:-1]) + "\n"


def step_text(step: FlowStep) -> str:
    """``/camera -> /planner by topic /image``."""
    ways = [str(hop) for hop in step.hops[:MOST_WAYS]]
    more = len(step.hops) - len(ways)
    return f"{step.source} -> {step.target} by {', '.join(ways)}{f' and {more} more' if more else ''}"


def reach_text(plan: PlanDocument, graph: FlowGraph) -> str:
    """For each enclave what it can influence, then the flows that exist only because nodes share an enclave."""
    return "\n".join([*_reach(graph), *_opened(plan)]) + "\n"


def _reach(graph: FlowGraph) -> Iterator[str]:
    for source in graph:
        direct, all_reached = set(graph[source]), reached_from(graph, source)
        over_others = sorted(all_reached - direct)
        yield f"{source} -> {' '.join(sorted(direct)) or 'nobody'}"
        if over_others:
            yield f"  and over others: {' '.join(over_others)}"


def _opened(plan: PlanDocument) -> Iterator[str]:
    opened = opened_by_sharing(plan)
    if opened:
        yield "only because nodes share an enclave:"
        yield from (f"  in {enclave}: {one} -> {two}" for enclave, one, two in opened)
