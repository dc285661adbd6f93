"""The report as Markdown; names stand in code spans that no name can end, all else from a launch file is escaped."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from enclave_addons.review.contents import ReportContents, in_one_sentence
from enclave_addons.review.diagrams import mermaid
from enclave_addons.review.graph import ChannelUse, EnclaveGraph, evidence_text
from enclave_addons.review.review_text import step_text
from enclave_common.terminal import printable

_SPECIAL = re.compile(r"([\\`*_{}\[\]<>#|~&])")
MOST_DRAWN = 60
"""Elements up to which the graph is part of the report: code hosts refuse to draw large ones."""


def markdown_report(contents: ReportContents) -> str:
    """Render sections as in the HTML report; ends with a newline."""
    return "\n".join(_lines(contents)) + "\n"


def _lines(contents: ReportContents) -> Iterator[str]:
    yield from (f"# {escaped(contents.title)}", "", escaped(in_one_sentence(contents)))
    if len(contents.graph.members) + len(contents.graph.channels) <= MOST_DRAWN:
        yield from ("", "```mermaid", mermaid(contents.graph).rstrip("\n"), "```")
    yield from ("", "## Findings", "")
    yield from _findings(contents)
    yield from ("", "## Permissions")
    for enclave, uses in contents.uses_of().items():
        yield from _enclave(contents.graph, enclave, uses)
    yield from ("", "## Flows", "")
    yield from _flows(contents)
    yield from (
        "",
        "## Statistics",
        "",
        f"{'; '.join(f'{one.column}: {one.meaning}' for one in contents.counts)}. As in table 2 of the LiSA4ROS2 "
        "paper, without `ros_discovery_info`.",
        "",
    )
    yield from _table(
        ("", *(one.column for one in contents.counts)),
        (
            ("all", *(str(one.all) for one in contents.counts)),
            ("of every node", *(str(one.system) for one in contents.counts)),
        ),
    )
    if contents.endings is not None:
        yield from ("", "## Expiry", "")
        rows = ((escaped(one.ends), str(one.days_left), escaped(one.subject)) for one in contents.endings)
        yield from _table(("expires", "days left", "what"), rows)


def _findings(contents: ReportContents) -> Iterator[str]:
    if not contents.judged:
        yield "Nothing was found."
        return
    rows = (
        (
            diagnostic.severity if accepted is None else "accepted",
            code(diagnostic.code),
            escaped(diagnostic.place),
            escaped(diagnostic.text),
            escaped(diagnostic.remedy if accepted is None else f"accepted: {accepted}"),
        )
        for diagnostic, accepted in contents.judged
    )
    yield from _table(("severity", "rule", "place", "what", "what to do"), rows)


def _enclave(graph: EnclaveGraph, enclave: str, uses: list[ChannelUse]) -> Iterator[str]:
    yield from ("", f"### {code(enclave)}", "")
    own = [use for use in uses if not use.built_in]
    if own:
        rows = (
            (
                use.operation.replace("_", " "),
                code(graph.channels[use.channel].name),
                "a policy file" if use.member is None else code(graph.members[use.member].name),
                "<br>".join(dict.fromkeys(escaped(evidence_text(reason)) for reason in use.reasons)),
            )
            for use in own
        )
        yield from _table(("operation", "name", "requested by", "evidence"), rows)
        yield ""
    yield f"{len(uses) - len(own)} more that every node has{graph.enforcement(enclave)}."


def _flows(contents: ReportContents) -> Iterator[str]:
    rows = (
        (
            code(one.enclave),
            "<br>".join(escaped(step_text(step)) for step in one.steps) or "nobody",
            str(one.reached),
        )
        for one in contents.influences
    )
    yield from _table(("enclave", "can influence directly", "enclaves over any number of hops"), rows)
    if contents.opened:
        yield from ("", "Possible only because nodes share an enclave:", "")
        yield from _table(("enclave", "from", "to"), (tuple(map(code, one)) for one in contents.opened))


def _table(headings: Iterable[str], rows: Iterable[Iterable[str]]) -> Iterator[str]:
    heads = tuple(headings)
    yield f"| {' | '.join(heads)} |"
    yield f"|{'---|' * len(heads)}"
    yield from (f"| {' | '.join(cells)} |" for cells in rows)


def escaped(text: str) -> str:
    """Escape text for a line of Markdown (CommonMark 2.4: any ASCII punctuation may be escaped)."""
    return _SPECIAL.sub(r"\\\1", printable(text))


def code(text: str) -> str:
    """Return a code span, also for text with backticks (CommonMark 6.1) or with a bar, which would end a cell."""
    shown = printable(text).replace("|", "\\|")
    fence = "`" * (max(map(len, re.findall("`+", shown)), default=0) + 1)
    pad = " " if shown.startswith("`") or shown.endswith("`") or not shown else ""
    return f"{fence}{pad}{shown}{pad}{fence}"
