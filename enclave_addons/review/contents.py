"""The contents of a report on a plan, as values; ``markdown.py`` and ``html/`` give them a form."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from enclave_addons.review.checks.keystore import Ending
from enclave_addons.review.document import PlanDocument, plan_from_document
from enclave_addons.review.graph import ChannelUse, EnclaveGraph, plan_graph, short_path
from enclave_addons.review.information_flow import FlowStep, flow_graph, opened_by_sharing, reached_from
from enclave_addons.review.review_text import Judged
from enclave_common.words import counted
from enclave_launch.dry_run import DryRun


class Count(NamedTuple):
    """A column of table 2: its heading, all of it, and the part that every node has."""

    column: str
    meaning: str
    all: int
    system: int


class Influence(NamedTuple):
    """Direct ways out of an enclave, and how many enclaves it reaches over any number of hops."""

    enclave: str
    steps: tuple[FlowStep, ...]
    reached: int


class ReportContents(NamedTuple):
    """The contents of a report. ``endings`` is ``None`` without a keystore."""

    title: str
    graph: EnclaveGraph
    judged: Judged
    influences: tuple[Influence, ...]
    opened: tuple[tuple[str, str, str], ...]
    counts: tuple[Count, ...]
    endings: tuple[Ending, ...] | None = None

    def uses_of(self) -> dict[str, list[ChannelUse]]:
        """Map each enclave to what it may do, in the graph's order."""
        found: dict[str, list[ChannelUse]] = {path: [] for path in self.graph.enclaves}
        for use in self.graph.uses:
            found[use.enclave].append(use)
        return found


def report_contents(
    document: DryRun,
    judged: Judged,
    *,
    title: str,
    root: str = "",
    endings: Iterable[Ending] | None = None,
) -> ReportContents:
    """Collect what a report shows from a dry run and its findings; ``root``: prefix to strip from paths."""
    plan = plan_from_document(document)
    return ReportContents(
        title,
        plan_graph(document, root),
        [
            (diagnostic.changed(file=diagnostic.file and short_path(diagnostic.file, root)), why)
            for diagnostic, why in judged
        ],
        tuple(_influences(plan)),
        tuple(opened_by_sharing(plan)),
        counts(plan),
        None if endings is None else tuple(endings),
    )


def in_one_sentence(contents: ReportContents) -> str:
    """Return what the report says in all: how much runs, whether everything is known, what needs attention."""
    graph = contents.graph
    known = sum(member.known for member in graph.members)
    unknown = len(graph.members) - known
    running = "runs" if known == 1 else "run"
    is_known = (
        f"the interfaces of {counted(unknown, 'program')} are not known"
        if unknown
        else "the interfaces of all of them are known"
    )
    open_ones = [diagnostic.severity for diagnostic, accepted in contents.judged if accepted is None]
    counts_of = ((open_ones.count("error"), "error"), (open_ones.count("warning"), "warning"))
    listed = " and ".join(counted(number, what) for number, what in counts_of if number)
    accepted = len(contents.judged) - len(open_ones)
    sentence = f"{counted(known, 'node')} {running} in {counted(len(graph.enclaves), 'enclave')}, {is_known}"
    sentence += f"; open findings: {listed or 'none'}"
    sentence += f", and {counted(accepted, 'accepted finding')}" if accepted else ""
    if contents.endings:
        sentence += f"; the first expiry in the keystore is {contents.endings[0].ends}"
    return f"{sentence}."


def _influences(plan: PlanDocument) -> Iterator[Influence]:
    graph = flow_graph(plan)
    for source, targets in graph.items():
        steps = tuple(FlowStep(source, target, hops) for target, hops in targets.items())
        yield Influence(source, steps, len(reached_from(graph, source)))


def counts(plan: PlanDocument) -> tuple[Count, ...]:
    """Count what table 2 of the LiSA4ROS2 paper counts, without the middleware's ``ros_discovery_info``."""
    return (
        Count("N", "nodes", len(plan.nodes), 0),
        _names(plan, "T", "topics", "publish", "subscribe"),
        _names(plan, "S", "services", "serve_services", "call_services"),
        _names(plan, "A", "actions", "serve_actions", "call_actions"),
        _uses(plan, "PUB", "publishers", "publish"),
        _uses(plan, "SUB", "subscriptions", "subscribe"),
        _uses(plan, "SS", "service servers", "serve_services"),
        _uses(plan, "SC", "service clients", "call_services"),
        _uses(plan, "AS", "action servers", "serve_actions"),
        _uses(plan, "AC", "action clients", "call_actions"),
    )


def _names(plan: PlanDocument, column: str, meaning: str, *operations: str) -> Count:
    own = {grant.name for node in plan.nodes for grant in node.own if grant.operation in operations}
    everywhere = {
        grant.name for node in plan.nodes for grant in node.built_in if grant.operation in operations
    }
    return Count(column, meaning, len(own | everywhere), len(everywhere - own))


def _uses(plan: PlanDocument, column: str, meaning: str, operation: str) -> Count:
    own = sum(grant.operation == operation for node in plan.nodes for grant in node.own)
    system = sum(grant.operation == operation for node in plan.nodes for grant in node.built_in - node.own)
    return Count(column, meaning, own + system, system)
