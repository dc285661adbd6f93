"""The page: one file, no request. Its Content-Security-Policy allows exactly its own scripts and style, by hash, and no
connection of any kind; a name that broke out of its place could still not run or load anything.
"""

from __future__ import annotations

import base64
import hashlib
import html
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from enclave_addons.review.checks.keystore import Ending
from enclave_addons.review.contents import Influence, ReportContents, in_one_sentence
from enclave_addons.review.graph import OUTWARD, ChannelUse, EnclaveGraph, evidence_text
from enclave_addons.review.review_text import step_text
from enclave_common.terminal import json_text, printable
from enclave_common.words import counted
from enclave_launch import __version__
from enclave_launch.dry_run import Diagnostic

ASSETS = Path(__file__).parent / "assets"
_SOURCE_MAP = re.compile(r"^//# sourceMappingURL=.*$", re.MULTILINE)
_UNUSUAL = re.compile(r"[^ -~\n\t]")


def html_report(contents: ReportContents) -> str:
    """Write the whole page; the same contents give the same bytes."""
    scripts = [_script(name) for name in ("cytoscape.min.js", "cytoscape-dagre.min.js", "report.js")]
    style = _asset("report.css")
    # Cytoscape.js adds a style element of this id unless there is one; ours holds its rule.
    head = (
        '<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_policy(scripts, style)}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="referrer" content="no-referrer">\n'
        f"<title>{text(contents.title)}: enclaves and permissions</title>\n"
        f'<style id="__________cytoscape_stylesheet">{style}</style>\n'
    )
    data = f'<script type="application/json" id="data">{script_data(graph_data(contents.graph))}</script>\n'
    code = "".join(f"<script>{script}</script>\n" for script in scripts)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n{head}</head>\n<body>\n{_body(contents)}{data}{code}'
        "</body>\n</html>\n"
    )


def script_data(content: object) -> str:
    """Render JSON so that no ``<`` can end the ``script`` element (HTML, "Restrictions for contents of script")."""
    escaped = json_text(content, separators=(",", ":"))
    return escaped.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def graph_data(graph: EnclaveGraph) -> dict[str, Any]:
    """Return the lists that the script draws and searches, with printable names; they refer to each other by number."""
    return {
        "enclaves": [printable(path) for path in graph.enclaves],
        "members": [
            {
                "name": printable(member.name),
                "enclave": printable(member.enclave),
                "namespace": printable(member.namespace),
                "program": printable(member.program),
                "place": printable(member.launched_at),
                "known": member.known,
            }
            for member in graph.members
        ],
        "channels": [
            {
                "kind": channel.kind,
                "name": printable(channel.name),
                "types": [printable(one) for one in channel.types],
                "pattern": channel.is_pattern,
            }
            for channel in graph.channels
        ],
        "uses": [_use(use) for use in graph.uses],
    }


def _use(use: ChannelUse) -> dict[str, Any]:
    return {
        "member": use.member,
        "enclave": printable(use.enclave),
        "channel": use.channel,
        "operation": use.operation.replace("_", " "),
        "out": use.operation in OUTWARD,
        "builtIn": use.built_in,
        "why": list(dict.fromkeys(printable(evidence_text(reason)) for reason in use.reasons)),
    }


def _policy(scripts: list[str], style: str) -> str:
    allowed = " ".join(map(_source, scripts))
    return f"default-src 'none'; script-src {allowed}; style-src {_source(style)}; base-uri 'none'; form-action 'none'"


def _source(inline: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()}'"


def _asset(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")


def _script(name: str) -> str:
    # Printable ASCII without source map: nothing changes it on the way, and developer tools request nothing.
    text = _SOURCE_MAP.sub("", _asset(name))
    return _UNUSUAL.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


def _body(contents: ReportContents) -> str:
    sections = (
        ("findings", "Findings", _findings(contents)),
        ("graph", "Graph", _GRAPH),
        ("permissions", "Enclaves", _permissions(contents)),
        ("flows", "Flows", _flows(contents)),
        ("statistics", "Numbers", _statistics(contents)),
        ("expiry", "Expiry", _expiry(contents.endings)),
    )
    links = "".join(f'<a href="#{name}">{heading}</a>' for name, heading, _ in sections)
    parts = "".join(
        f'<section id="{name}" aria-labelledby="{name}-heading">\n'
        f'<h2 id="{name}-heading">{heading}</h2>\n{body}</section>\n'
        for name, heading, body in sections
    )
    return (
        f'<header><div class="title"><h1>{text(contents.title)}</h1>\n'
        '<button type="button" id="theme" class="screen">light or dark</button></div>\n'
        f'<p class="tally">{_tally(contents)}</p>\n<p>{text(in_one_sentence(contents))}</p></header>\n'
        f'<nav aria-label="Sections" class="screen">{links}</nav>\n'
        f"<main>\n{parts}</main>\n<footer>Made by secure-plan {__version__}. The graph is drawn by Cytoscape.js "
        "(MIT licence).</footer>\n"
    )


def _tally(contents: ReportContents) -> str:
    """Return the numbers that a reader looks for first, as badges."""
    severities = [diagnostic.severity for diagnostic, accepted in contents.judged if accepted is None]
    counts = [(severities.count(each), each, each) for each in ("error", "warning")]
    counts += [
        (len(contents.judged) - len(severities), "accepted finding", "accepted"),
        (sum(member.known for member in contents.graph.members), "node", "plain"),
        (len(contents.graph.enclaves), "enclave", "plain"),
    ]
    shown = [each for each in counts if each[0] or each[2] == "plain"]
    return " ".join(
        f'<span class="badge {kind}">{counted(number, what)}</span>' for number, what, kind in shown
    )


_FILTER = (
    '<p class="screen tools"><label>Only rows with <input type="search" id="row-filter" autocomplete="off"></label> '
    '<label><input type="checkbox" id="rows-built-in"> what every node has</label></p>\n'
)
_GRAPH = """\
<div class="tools screen" role="toolbar" aria-label="Graph">
<label>Search <input type="search" id="search" autocomplete="off" aria-controls="matches"></label>
<label>Group by <select id="group"><option value="enclave">enclave</option><option value="namespace">namespace</option>
<option value="both">enclave and namespace</option><option value="none">nothing</option></select></label>
<label><input type="checkbox" id="show-topic" checked> topics</label>
<label><input type="checkbox" id="show-service" checked> services</label>
<label><input type="checkbox" id="show-action" checked> actions</label>
<label><input type="checkbox" id="hide-built-in" checked> hide built-ins</label>
<label><input type="checkbox" id="only-near"> only these and their neighbours</label>
<span class="zoom"><button type="button" id="zoom-in" aria-label="zoom in">+</button>
<button type="button" id="zoom-out" aria-label="zoom out">&minus;</button>
<button type="button" id="fit">fit</button></span>
</div>
<p id="status" class="screen" role="status"></p>
<div id="canvas" tabindex="0" role="application" aria-label="Graph of the launch: arrow keys move it, plus and minus \
zoom, 0 fits it; the list below it reaches every element by keyboard"></div>
<ul class="legend" aria-label="Legend"><li><span class="swatch group"></span>enclave or namespace</li>
<li><span class="swatch node"></span>node</li><li><span class="swatch topic"></span>topic</li>
<li><span class="swatch service"></span>service</li><li><span class="swatch action"></span>action</li>
<li><span class="swatch doubtful"></span>not known, or with wildcards</li>
<li><span class="swatch arrow"></span>from who sends or calls to who receives or serves</li></ul>
<div class="list-and-detail screen"><ul id="matches" aria-label="Elements that match the search"></ul>
<div id="detail" tabindex="-1" aria-live="polite"><p>Choose an element in the list or in the graph.</p></div></div>
"""


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
    return (
        f'<div class="scroll"><table><caption>{caption}</caption><thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody></table></div>\n"
    )


def _permissions(contents: ReportContents) -> str:
    """Return a list of the enclaves to choose from, and a table for each.

    Interfaces that every node has are only counted at first.
    """
    names, parts = [], []
    for number, (enclave, uses) in enumerate(contents.uses_of().items()):
        own = [use for use in uses if not use.built_in]
        members = sum(member.enclave == enclave for member in contents.graph.members)
        opened = " open" if number == 0 else ""
        names.append(
            f'<li><button type="button" data-enclave="{number}"><code>{text(enclave)}</code> '
            f'<span class="count">{len(own)}</span></button></li>'
        )
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
    if not parts:
        return "<p>This launch has no enclaves.</p>"
    chooser = f'<ul id="enclaves" class="screen" aria-label="Enclaves">{"".join(names)}</ul>\n'
    return f'{_FILTER}<div class="enclaves">{chooser}<div class="tables">{"".join(parts)}</div></div>\n'


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


def _findings(contents: ReportContents) -> str:
    """Return what ``check`` found, the most severe first and accepted findings last; of one kind together."""
    if not contents.judged:
        return "<p>Nothing was found.</p>"
    kinds: dict[tuple[str, str, str], list[Diagnostic]] = {}
    for diagnostic, accepted in sorted(
        contents.judged, key=lambda item: (item[1] is not None, item[0].severity)
    ):
        severity = diagnostic.severity if accepted is None else "accepted"
        fix = diagnostic.remedy if accepted is None else f"accepted: {accepted}"
        kinds.setdefault((severity, diagnostic.code, fix), []).append(diagnostic)
    items = "".join(_finding(*kind, found) for kind, found in kinds.items())
    return f'<ul class="findings">\n{items}</ul>\n'


_AT_ONCE = 4  # findings of one kind; the others are folded


def _finding(severity: str, code: str, fix: str, found: Sequence[Diagnostic]) -> str:
    number = f' <span class="count">{len(found)} times</span>' if len(found) > 1 else ""
    shown = [
        f'<li><span class="place">{text(each.place)}</span> {text(each.text)}</li>'
        if each.place
        else f"<li>{text(each.text)}</li>"
        for each in found
    ]
    rest = shown[_AT_ONCE:]
    more = f"<details><summary>{len(rest)} more</summary><ul>{''.join(rest)}</ul></details>" if rest else ""
    remedy = f'<p class="fix">{text(fix)}</p>' if fix else ""
    return (
        f'<li class="finding"><p class="kind"><strong class="badge {severity}">{severity}</strong> '
        f"<code>{text(code)}</code>{number}</p><ul>{''.join(shown[:_AT_ONCE])}</ul>{more}{remedy}</li>\n"
    )


def _flows(contents: ReportContents) -> str:
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


def _statistics(contents: ReportContents) -> str:
    """Count what the plan has."""
    rows = (
        row((one.meaning, str(one.all), str(one.system)), attributes=' class="numbers"')
        for one in contents.counts
    )
    return table(
        "What the launch has, and how much of it every node has", ("what", "all", "of every node"), rows
    )


def _expiry(endings: Iterable[Ending] | None) -> str:
    """Return when the certificates and documents of the keystore expire, a hint if no keystore was given."""
    if endings is None:
        return "<p>No keystore was given (<code>--keystore DIR</code>).</p>"
    return table("When parts of the keystore expire", ("expires", "days left", "what"), _endings(endings))


def _endings(endings: Iterable[Ending]) -> Iterator[str]:
    for one in endings:
        left = "expired" if one.days_left < 0 else str(one.days_left)
        mark = f'<strong class="error">{left}</strong>' if one.days_left < SOON else left
        yield row((text(one.ends), mark, text(one.subject)))
