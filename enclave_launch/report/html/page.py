"""The page: one file, no request. Its Content-Security-Policy allows exactly its own scripts and style, by hash, and no
connection of any kind; a name that broke out of its place could still not run or load anything.
"""

from __future__ import annotations

import base64
import hashlib
import re
from pathlib import Path
from typing import Any

from enclave_common.terminal import json_text, printable
from enclave_launch import __version__
from enclave_launch.report.contents import ReportContents, in_one_sentence
from enclave_launch.report.graph import OUTWARD, ChannelUse, EnclaveGraph, evidence_text
from enclave_launch.report.html import tables
from enclave_launch.report.html.tables import text

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
        ("graph", "Graph", _GRAPH),
        ("findings", "Findings", tables.findings(contents)),
        ("permissions", "Permissions", _FILTER + tables.permissions(contents)),
        ("flows", "Flows", tables.flows(contents)),
        ("statistics", "Statistics", tables.statistics(contents)),
        ("expiry", "Expiry", tables.expiry(contents.endings)),
    )
    links = "".join(f'<a href="#{name}">{heading}</a>' for name, heading, _ in sections)
    parts = "".join(
        f'<section id="{name}" aria-labelledby="{name}-heading">\n'
        f'<h2 id="{name}-heading">{heading}</h2>\n{body}</section>\n'
        for name, heading, body in sections
    )
    return (
        f"<header><h1>{text(contents.title)}</h1>\n<p>{text(in_one_sentence(contents))}</p>\n"
        f'<nav aria-label="Sections">{links}</nav>\n'
        '<button type="button" id="theme" class="screen">light or dark</button></header>\n'
        f"<main>\n{parts}</main>\n<footer>Made by secure-plan {__version__}. The graph is drawn by Cytoscape.js "
        "(MIT licence).</footer>\n"
    )


_FILTER = (
    '<p class="screen"><label>Only rows with <input type="search" id="row-filter" autocomplete="off"></label> '
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
<button type="button" id="zoom-in" aria-label="zoom in">+</button>
<button type="button" id="zoom-out" aria-label="zoom out">&minus;</button>
<button type="button" id="fit">fit</button>
</div>
<p id="status" class="screen" role="status"></p>
<div class="graph-and-detail">
<div id="canvas" tabindex="0" role="application" aria-label="Graph of the launch: arrow keys move it, plus and minus \
zoom, 0 fits it; the list beside it reaches every element by keyboard"></div>
<aside class="screen"><ul id="matches" aria-label="Elements that match the search"></ul>
<div id="detail" tabindex="-1" aria-live="polite"><p>Choose an element in the list or in the graph.</p></div></aside>
</div>
<p class="key">Large box: enclave or namespace. Rounded box: node. Ellipse: topic. Rectangle: service. Hexagon: \
action. Dashed: interfaces unknown, or a name with wildcards. Arrows run from who sends or calls to \
who receives or serves.</p>
"""
