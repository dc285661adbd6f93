"""The tables of the report as HTML; text that others chose becomes HTML by ``text``, everything that enters a page."""

from __future__ import annotations

import html
from collections.abc import Iterable, Iterator

from enclave_common.terminal import printable
from enclave_common.words import counted
from enclave_launch.report.contents import Influence, ReportContents
from enclave_launch.report.graph import ChannelUse, EnclaveGraph, evidence_text
from enclave_launch.report.review_text import step_text
from enclave_launch.review.checks.keystore import Ending
from enclave_launch.review.document import PlanFinding

SOON = 30
"""Days within which an end is marked."""


def text(value: object) -> str:
    """Escape ``value`` as text of an element or attribute; unprintable characters become visible escapes."""
    return html.escape(printable(str(value)))


def row(cells: Iterable[str], *, attributes: str = "") -> str:
    """Return a table row of cells that are HTML already."""
    return f"<tr{attributes}>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def table(caption: str, headings: Iterable[str], rows: Iterable[str]) -> str:
    """Return a table; ``caption`` and ``headings`` are trusted text."""
    head = "".join(f'<th scope="col">{heading}</th>' for heading in headings)
    body = "\n".join(rows)
    return f"<table><caption>{caption}</caption><thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table>\n"


def permissions(contents: ReportContents) -> str:
    """Return a folded table for each enclave; interfaces that every node has are only counted at first."""
    parts = []
    for number, (enclave, uses) in enumerate(contents.uses_of().items()):
        own = [use for use in uses if not use.built_in]
        members = sum(member.enclave == enclave for member in contents.graph.members)
        opened = " open" if number == 0 else ""
        parts.append(
            f'<details class="enclave" data-enclave="{number}"{opened}><summary><code>{text(enclave)}</code> '
            f"{counted(members, 'node')}, {counted(len(own), 'permission')} requested, "
            f"{len(uses) - len(own)} that every node has{contents.graph.enforcement(enclave)}</summary>\n"
            + table(
                f"What enclave {text(enclave)} may do, and why",
                ("operation", "name", "type", "requested by", "evidence"),
                (_permission(contents.graph, use) for use in own),
            )
            + "</details>\n"
        )
    return "".join(parts) or "<p>This launch has no enclaves.</p>"


def _permission(graph: EnclaveGraph, use: ChannelUse) -> str:
    channel = graph.channels[use.channel]
    who = "no node: a policy file" if use.member is None else graph.members[use.member].name
    evidence = "<br>".join(dict.fromkeys(text(evidence_text(reason)) for reason in use.reasons))
    mark = ' <strong class="mark">wildcard</strong>' if channel.is_pattern else ""
    return row(
        (
            use.operation.replace("_", " "),
            f"<code>{text(channel.name)}</code>{mark}",
            text(", ".join(channel.types) or "not known"),
            f"<code>{text(who)}</code>",
            evidence,
        )
    )


def findings(contents: ReportContents) -> str:
    """Return what ``check`` found, the most severe first and accepted findings last."""
    if not contents.judged:
        return "<p>Nothing was found.</p>"
    ordered = sorted(contents.judged, key=lambda item: (item[1] is not None, item[0].severity))
    return table(
        "Findings of secure-plan check",
        ("severity", "rule", "place", "what", "what to do"),
        (_finding(diagnostic, accepted) for diagnostic, accepted in ordered),
    )


def _finding(diagnostic: PlanFinding, accepted: str | None) -> str:
    severity = diagnostic.severity if accepted is None else "accepted"
    remedy = diagnostic.remedy if accepted is None else f"accepted: {accepted}"
    return row(
        (
            f'<strong class="{severity}">{severity}</strong>',
            f"<code>{text(diagnostic.code)}</code>",
            text(f"{diagnostic.file}:{diagnostic.line}" if diagnostic.file else ""),
            text(diagnostic.text),
            text(remedy),
        )
    )


def flows(contents: ReportContents) -> str:
    """Return which enclave influences which, and which ways exist only because nodes share an enclave."""
    parts = [
        table(
            "Which enclave can influence which",
            ("from", "directly", "over any number of hops"),
            (_influence(one) for one in contents.influences),
        )
    ]
    if contents.opened:
        parts.append(
            table(
                "Possible only because nodes share an enclave",
                ("enclave", "from", "to"),
                (row(f"<code>{text(name)}</code>" for name in one) for one in contents.opened),
            )
        )
    return "".join(parts)


def _influence(one: Influence) -> str:
    ways = "<br>".join(text(step_text(step)) for step in one.steps)
    return row((f"<code>{text(one.enclave)}</code>", ways or "nobody", counted(one.reached, "enclave")))


def statistics(contents: ReportContents) -> str:
    """Count the plan, in the columns of table 2 of the LiSA4ROS2 paper."""
    rows = (
        row((one.column, one.meaning, str(one.all), str(one.system)), attributes=' class="numbers"')
        for one in contents.counts
    )
    return table(
        "As in table 2 of the LiSA4ROS2 paper, without ros_discovery_info, which is the middleware's",
        ("column", "what", "all", "of them of every node"),
        rows,
    )


def expiry(endings: Iterable[Ending] | None) -> str:
    """Return when the certificates and documents of the keystore expire, a hint if no keystore was given."""
    if endings is None:
        return "<p>No keystore was given (<code>--keystore DIR</code>).</p>"
    return table("When parts of the keystore expire", ("expires", "days left", "what"), _endings(endings))


def _endings(endings: Iterable[Ending]) -> Iterator[str]:
    for one in endings:
        left = "expired" if one.days_left < 0 else str(one.days_left)
        mark = f'<strong class="error">{left}</strong>' if one.days_left < SOON else left
        yield row((text(one.ends), mark, text(one.subject)))
