"""Plans, findings, suggestions and flows of a review as text for a terminal, and as plain values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from enclave_addons.review.document import OPERATIONS, GrantedName, PlanDocument
from enclave_addons.review.information_flow import FlowGraph, FlowStep, opened_by_sharing, reached_from
from enclave_addons.review.similarity import Merge, Split
from enclave_common.words import counted, some_of
from enclave_launch.dry_run import Diagnostic
from nodl.ament_index import MISSING_PREFIX

Judged = Sequence[tuple[Diagnostic, "str | None"]]


def plan_text(plan: PlanDocument) -> str:
    """Format each enclave with its nodes and their interfaces; those that every node has are counted."""
    return "\n".join(line for path in sorted(plan.enclaves) for line in _enclave(plan, path)) + "\n"


def _enclave(plan: PlanDocument, path: str) -> Iterator[str]:
    nodes = plan.nodes_of(path)
    shown = plan.own(path) if nodes else plan.enclaves[path]
    yield f"enclave {path}"
    yield from (f"  node {node.fqn}  ({node.program})" for node in nodes)
    for operation in OPERATIONS:
        names = sorted(grant.name for grant in shown if grant.operation == operation)
        if names:
            yield f"  {operation.replace('_', ' ')}: {' '.join(names)}"
    hidden = len(plan.enclaves[path] - shown)
    if hidden:
        yield f"  and {hidden} that every node has"


def findings_text(judged: Judged, *, verbose: bool = False) -> str:
    """Return a paragraph for each finding, open ones first, and a last line that counts them.

    Unless ``verbose``, open findings of a code in ``_FOLDED`` are one paragraph, those of ``_SUMMED_UP`` are counted,
    and what this machine lacks is one paragraph before the others.
    """
    ordered = sorted(judged, key=lambda item: (item[1] is not None, item[0].severity))
    absent = [] if verbose else [item for item in judged if item[1] is None and _kind_of_absent(item[0])]
    lines: list[str] = []
    if any(finding.code not in _SUMMED_UP for finding, _ in absent):
        lines += _absent_text([finding for finding, _ in absent])
        ordered = [item for item in ordered if item not in absent]
    summed_up: list[str] = []
    for diagnostic, accepted, others in _folded(ordered, verbose):
        if diagnostic.code in _SUMMED_UP and accepted is None and not verbose:
            summed_up.append(f"{1 + len(others)} {diagnostic.code}")
            continue
        place = f"{diagnostic.place}: " if diagnostic.file else ""
        head = f"accepted ({accepted})" if accepted is not None else diagnostic.severity
        text = diagnostic.text
        if others:
            subjects = dict.fromkeys(each.subject for each in (diagnostic, *others))
            text = f"{text} (and {len(others)} more of this kind, about {some_of(subjects, _NAMED)})"
        lines.append(f"{head}: {place}{text} [{diagnostic.code}]")
        if diagnostic.remedy and accepted is None:
            lines.append(f"  {diagnostic.remedy}")
    lines.append(_count(judged) + (f" ({', '.join(summed_up)}; -v lists them)" if summed_up else ""))
    return "\n".join(lines) + "\n"


def _kind_of_absent(finding: Diagnostic) -> str:
    """Return what the finding reports to be absent from this machine; empty if it is about the launch itself."""
    if finding.code == "parameter-file-missing" and not finding.subject.startswith(f"{MISSING_PREFIX}/"):
        return ""
    if finding.code == "program-not-executable" and "/" in finding.subject:
        return ""
    return _ABSENT.get(finding.code, "")


def _absent_text(findings: Sequence[Diagnostic]) -> Iterator[str]:
    """Yield the paragraph about all that this machine lacks of a launch."""
    subjects: dict[str, dict[str, None]] = {}
    for finding in findings:
        subjects.setdefault(_kind_of_absent(finding), {})[finding.subject] = None
    kinds = (
        f"{kind if len(names) == 1 else f'{kind}s'} {some_of(names, _NAMED)}"
        for kind, names in subjects.items()
    )
    codes = ", ".join(dict.fromkeys(finding.code for finding in findings))
    yield f"warning: not on this machine, so the plan may be incomplete: {'; '.join(kinds)} [{codes}]"
    yield "  install or build them, and check again; -v lists each with its place"


_ABSENT = {
    "package-not-installed": "package",
    "program-not-installed": "program",
    "program-not-executable": "program",
    "include-left-out": "launch file",
    "parameter-file-missing": "parameter file",
}
_NAMED = 5
_FOLDED = frozenset({
    "container-elsewhere", "enclave-shared", "executable-not-built", "executable-without-enclave", "include-left-out",
    "interface-unknown", "library-version", "no-manifest", "no-publisher", "no-server", "no-subscriber",
    "node-name-unknown", "package-not-installed", "parameter-file-missing", "parameter-unknown",
    "pattern-accepted", "program-not-installed", "remap-dead", "wildcard",
})  # fmt: skip
"""Codes with one cause and often many subjects; what is wrong with a keystore is reported one by one."""
_SUMMED_UP = frozenset({
    "enclave-shared", "ends-not-judged", "executable-not-built", "library-version", "no-publisher", "no-server",
    "no-subscriber", "package-not-installed",
})  # fmt: skip
"""Codes of which a plan has many that are as they are meant to be, or that follow from a finding that is printed."""


def _folded(ordered: Judged, verbose: bool) -> Iterator[tuple[Diagnostic, str | None, list[Diagnostic]]]:
    groups: dict[object, list[tuple[Diagnostic, str | None]]] = {}
    for number, (diagnostic, accepted) in enumerate(ordered):
        alone = verbose or accepted is not None or diagnostic.code not in _FOLDED
        key = number if alone else (diagnostic.severity, diagnostic.code)
        groups.setdefault(key, []).append((diagnostic, accepted))
    for (diagnostic, accepted), *others in groups.values():
        yield diagnostic, accepted, [other for other, _ in others]


def _count(judged: Judged) -> str:
    open_ones = [diagnostic for diagnostic, accepted in judged if accepted is None]
    errors = sum(diagnostic.severity == "error" for diagnostic in open_ones)
    accepted_ones = f", {len(judged) - len(open_ones)} accepted" if len(judged) > len(open_ones) else ""
    return f"{counted(errors, 'error')}, {counted(len(open_ones) - errors, 'warning')}{accepted_ones}"


def findings_document(judged: Judged) -> dict[str, object]:
    """Return the findings for JSON, each with the reason why it was accepted, or None."""
    return {
        "version": 1,
        "findings": [{**dict(diagnostic), "accepted": accepted} for diagnostic, accepted in judged],
    }


def suggestions_text(merges: Sequence[Merge], splits: Sequence[Split]) -> str:
    """Format the enclaves worth merging and splitting, with what each change costs or saves."""
    lines = [line for merge in merges for line in _merge(merge)]
    lines += [line for split in splits for line in _split(split)]
    return (
        "\n".join(lines or ["no two enclaves are alike, and no enclave may do more than its nodes need"])
        + "\n"
    )


def _merge(merge: Merge) -> Iterator[str]:
    yield (
        f"merge {merge.one} and {merge.two}: {merge.similarity:.0%} alike, "
        f"costs {counted(merge.cost, 'permission')} in excess"
    )
    yield from (f"  {enclave} would gain: {_names(gained)}" for enclave, gained in merge.excess)


def _split(split: Split) -> Iterator[str]:
    yield f"split {split.enclave}: saves {counted(split.gain, 'permission')}"
    yield from (f"  {node} would lose: {_names(saved)}" for node, saved in split.saved)


def _names(grants: Sequence[GrantedName]) -> str:
    return ", ".join(map(str, grants))


MOST_WAYS = 3  # named for each step


def paths_text(source: str, target: str, paths: Sequence[Sequence[FlowStep]]) -> str:
    """Format the shortest paths from one enclave to another, or state that there is none."""
    if not paths:
        return f"nothing flows from {source} to {target}, over any number of enclaves\n"
    count = f"{len(paths)} shortest ways" if len(paths) > 1 else "the shortest way"
    lines = [f"{source} can influence {target}; {count}:"]
    for path in paths:
        lines += [f"  {step_text(step)}" for step in path]
        lines.append("")
    return "\n".join(lines[:-1]) + "\n"


def step_text(step: FlowStep) -> str:
    """Format a step as ``/camera -> /planner by topic /image``."""
    ways = [str(hop) for hop in step.hops[:MOST_WAYS]]
    more = len(step.hops) - len(ways)
    return f"{step.source} -> {step.target} by {', '.join(ways)}{f' and {more} more' if more else ''}"


def reach_text(plan: PlanDocument, graph: FlowGraph) -> str:
    """Format what each enclave can influence, then the flows that exist only because nodes share an enclave."""
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
