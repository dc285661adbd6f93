"""All files of the evidence, from values: file name -> bytes. The same values give the same bytes. Performs no I/O.

Source of the statement about them: in-toto attestation framework, spec v1 (statement.md, resource_descriptor.md) and
its predicate ``test-result`` v0.1: the files are the subjects, the checks the tests.
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from enclave_addons.review.contents import ReportContents
from enclave_addons.review.document import plan_from_document
from enclave_addons.review.evidence.requirements import DISCLAIMER, PARTS
from enclave_addons.review.graph import (
    NO_ENCLAVE,
    OUTWARD,
    ChannelUse,
    EnclaveGraph,
    evidence_text,
    plan_graph,
)
from enclave_addons.review.html.page import html_report
from enclave_addons.review.information_flow import flow_graph, opened_by_sharing, reached_from
from enclave_addons.review.markdown import code, escaped
from enclave_addons.review.review_text import Judged, findings_document
from enclave_addons.review.sarif import sarif_document
from enclave_common.terminal import json_text, printable
from enclave_launch import __version__
from enclave_launch.dry_run import DryRun
from keystore.formats.permissions_patterns import can_meet

PAYLOAD_TYPE = "application/vnd.in-toto+json"
STATEMENT = "https://in-toto.io/Statement/v1"
PREDICATE = "https://in-toto.io/attestation/test-result/v0.1"


class Examined(NamedTuple):
    """The subject of the evidence. ``keys``, ``defaults`` and ``components`` are ``None`` where nothing was given to
    examine; ``document``: the dry run's JSON; ``file``: what was planned or where that was saved; ``rules``: every code
    that the checks can give, with its meaning."""

    document: Mapping[str, Any]
    plan: DryRun
    contents: ReportContents
    rules: Mapping[str, str]
    at: str
    root: str
    file: str
    keys: list[dict[str, Any]] | None = None
    defaults: dict[str, Any] | None = None
    components: dict[str, Any] | None = None


def evidence_files(examined: Examined) -> dict[str, bytes]:
    """Return the files without the statement, which names them."""
    contents, graph = examined.contents, examined.contents.graph
    rows = list(matrix_rows(graph))
    documents: dict[str, Any] = {
        "plan.json": examined.document,
        "access-control.json": {"version": 1, "permissions": [row._asdict() for row in rows]},
        "attack-surface.json": surface_document(examined.plan),
        "keys.json": _or_not_given(examined.keys, "keys", "no keystore was given (--keystore)"),
        "secure-defaults.json": _or_not_given(
            examined.defaults, "defaults", "no keystore was given (--keystore)"
        ),
        "components.json": _or_not_given(
            examined.components, "bill_of_materials", "no CycloneDX document was given (--sbom)"
        ),
        "findings.json": findings_document(contents.judged),
        "findings.sarif": sarif_document(
            contents.judged, examined.rules, __version__, examined.root, examined.file
        ),
        "accepted.json": _accepted(contents),
        "scope.json": _scope(examined),
        "requirements.json": {"version": 1, "claim": DISCLAIMER, "parts": [part._asdict() for part in PARTS]},
    }
    files = {name: f"{json_text(content, indent=2)}\n".encode() for name, content in documents.items()}
    files["access-control.csv"] = csv_text(rows).encode()
    files["report.html"] = html_report(contents).encode()
    files["README.md"] = summary(contents, documents["scope.json"], examined.at).encode()
    return dict(sorted(files.items()))


def _or_not_given(found: Any, name: str, why: str) -> dict[str, Any]:
    return {
        "version": 1,
        "examined": found is not None,
        "why_not": "" if found is not None else why,
        name: found,
    }


def _accepted(contents: ReportContents) -> dict[str, Any]:
    accepted = [
        {**dict(diagnostic), "reason": reason} for diagnostic, reason in contents.judged if reason is not None
    ]
    return {"version": 1, "accepted": accepted}


def _scope(examined: Examined) -> dict[str, Any]:
    found = {diagnostic.code for diagnostic, _ in examined.contents.judged}
    members = examined.contents.graph.members
    return {
        "version": 1,
        "launch": examined.contents.title,
        "examined_at": examined.at,
        "tool": f"secure-plan {__version__}",
        "checked": [
            {"code": code, "meaning": meaning, "found": code in found}
            for code, meaning in sorted(examined.rules.items())
            if examined.keys is not None or not code.startswith("keystore-")
        ],
        "not_checked": _not_checked(examined),
        "gaps": sorted(
            {
                diagnostic.text
                for diagnostic, _ in examined.contents.judged
                if diagnostic.code in ("interface-unknown", "no-manifest")
            }
        ),
        "nodes": sum(member.known for member in members),
        "programs_without_known_interfaces": sum(not member.known for member in members),
    }


def _not_checked(examined: Examined) -> list[str]:
    missing = []
    if examined.keys is None:
        missing.append("keys, certificates and governance: no keystore was given")
    if examined.components is None:
        missing.append("known vulnerabilities and components: no bill of materials was given")
    return [
        *missing,
        "what the programs do: permissions bound it; descriptions of nodes are not verified",
        "connections between processes other than ROS: files, devices, networks, shared memory",
        "the host: its users, its updates, its physical protection",
        "what runs outside of this launch file",
    ]


def summary(contents: ReportContents, scope: Mapping[str, Any], at: str) -> str:
    """Write ``README.md`` of the folder: its contents, requirements, what was checked and what was not."""
    return "\n".join(_lines(contents, scope, at)) + "\n"


def _lines(contents: ReportContents, scope: Mapping[str, Any], at: str) -> Iterator[str]:
    open_ones = [diagnostic for diagnostic, accepted in contents.judged if accepted is None]
    yield from (f"# Evidence for {escaped(contents.title)}", "", DISCLAIMER, "")
    yield f"Examined {escaped(at)} by {escaped(scope['tool'])}. Findings: {len(open_ones)} open,"
    yield f"{len(contents.judged) - len(open_ones)} accepted. `report.html` shows all of it; it needs no network."
    for part in PARTS:
        yield from ("", f"## {part.name}", "", f"{part.shows[:1].upper()}{part.shows[1:]}.", "")
        yield f"Files: {', '.join(f'`{name}`' for name in part.files)}. Supports:"
        yield from ("", *(f"- {each}" for each in part.supports))
    yield from ("", "## Not checked", "", *(f"- {escaped(each)}" for each in scope["not_checked"]))
    if scope["gaps"]:
        yield from ("", "Gaps of the plan:", "", *(f"- {escaped(each)}" for each in scope["gaps"]))
    accepted = [(diagnostic, reason) for diagnostic, reason in contents.judged if reason is not None]
    if accepted:
        yield from ("", "## Accepted exceptions", "")
        yield from (
            f"- {code(diagnostic.code)} {escaped(diagnostic.text)}: {escaped(reason)}"
            for diagnostic, reason in accepted
        )
    yield from ("", "## Check it", "")
    yield "`statement.json` is an in-toto statement that names every file by its SHA-256; `statement.dsse.json` is the "
    yield "same, signed, if a key was given. Apart from a signature, the same input and time give the same bytes."


def statement(files: Mapping[str, bytes], judged: Judged, checked: list[str]) -> bytes:
    """Write the in-toto statement about ``files``; ``checked``: the code of every check that was made."""
    failed, warned = _codes(judged, "error"), _codes(judged, "warning")
    content: dict[str, Any] = {
        "_type": STATEMENT,
        "subject": [_resource(name, data) for name, data in sorted(files.items())],
        "predicateType": PREDICATE,
        "predicate": {
            "result": "FAILED" if failed else "WARNED" if warned else "PASSED",
            "configuration": [_resource("plan.json", files["plan.json"])],
            "passedTests": sorted(set(checked) - failed - warned),
            "warnedTests": sorted(warned - failed),
            "failedTests": sorted(failed),
        },
    }
    return f"{json_text(content, indent=2)}\n".encode()


def _codes(judged: Judged, severity: str) -> set[str]:
    return {
        diagnostic.code
        for diagnostic, accepted in judged
        if accepted is None and diagnostic.severity == severity
    }


def _resource(name: str, data: bytes) -> dict[str, Any]:
    return {"name": name, "digest": {"sha256": hashlib.sha256(data).hexdigest()}}


class Row(NamedTuple):
    """One permission in the evidence. ``node`` is empty where only a policy file says so. ``built_in``: every node has
    it. ``enforced_by``: ``DDS`` by each participant, ``Zenoh`` by the router."""

    enclave: str
    node: str
    operation: str
    name: str
    types: str
    built_in: bool
    evidence: str
    enforced_by: str


def matrix_rows(graph: EnclaveGraph) -> Iterator[Row]:
    """Yield the rows in the graph's order."""
    for use in graph.uses:
        channel = graph.channels[use.channel]
        yield Row(
            use.enclave,
            "" if use.member is None else graph.members[use.member].name,
            use.operation,
            channel.name,
            " ".join(channel.types),
            use.built_in,
            " | ".join(dict.fromkeys(evidence_text(reason) for reason in use.reasons)) or "a policy file",
            graph.middlewares[use.enclave],
        )


def csv_text(found: Iterable[Row]) -> str:
    """Render with a heading; no cell begins like a formula (OWASP, "CSV Injection")."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(Row._fields)
    writer.writerows([_cell(value) for value in row] for row in found)
    return stream.getvalue()


def _cell(value: object) -> str:
    text = ("yes" if value else "no") if isinstance(value, bool) else printable(str(value))
    return f"'{text}" if text.startswith(("=", "+", "-", "@")) else text


def surface_document(document: DryRun) -> dict[str, Any]:
    """Describe what each enclave exposes, from a dry run; interfaces that every node has are left out."""
    graph, plan = plan_graph(document), plan_from_document(document)
    flows = flow_graph(plan)
    return {
        "version": 1,
        "enclaves": {path: _enclave(graph, path) for path in graph.enclaves},
        "influences": {path: sorted(reached_from(flows, path)) for path in graph.enclaves},
        "only_by_sharing": [
            {"enclave": enclave, "from": one, "to": two} for enclave, one, two in opened_by_sharing(plan)
        ],
        "without_an_enclave": [
            {"program": member.name, "place": member.launched_at}
            for member in graph.members
            if member.enclave == NO_ENCLAVE
        ],
        "interfaces_unknown": [
            {"program": member.name, "enclave": member.enclave, "place": member.launched_at}
            for member in graph.members
            if not member.known and member.enclave != NO_ENCLAVE
        ],
        "domains": sorted({process.domain_id for process in document.processes}),
    }


def _enclave(graph: EnclaveGraph, enclave: str) -> dict[str, Any]:
    held = [use for use in graph.uses if use.enclave == enclave and not use.built_in]
    patterns = {graph.channels[use.channel].name for use in held if graph.channels[use.channel].is_pattern}
    return {"accepts": _incoming(graph, enclave, held), "wildcards": sorted(patterns)}


def _incoming(graph: EnclaveGraph, enclave: str, held: list[ChannelUse]) -> list[dict[str, Any]]:
    # ``sent_by``: enclaves of this launch that may send it; if empty, only processes outside of it could.
    coming_in = sorted({(use.operation, use.channel) for use in held if use.operation not in OUTWARD})
    return [
        {
            "operation": operation,
            "name": graph.channels[channel].name,
            "types": list(graph.channels[channel].types),
            "sent_by": sorted(_senders(graph, operation, graph.channels[channel].name) - {enclave}),
        }
        for operation, channel in coming_in
    ]


def _senders(graph: EnclaveGraph, operation: str, name: str) -> set[str]:
    return {
        use.enclave
        for use in graph.uses
        if use.operation == _SENT_BY[operation] and can_meet(graph.channels[use.channel].name, name)
    }


_SENT_BY: Mapping[str, str] = {
    "subscribe": "publish",
    "serve_services": "call_services",
    "serve_actions": "call_actions",
}
