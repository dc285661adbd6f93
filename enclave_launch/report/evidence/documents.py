"""All files of the evidence, from values: file name -> bytes. The same values give the same bytes. Performs no I/O.

Source of the statement about them: in-toto attestation framework, spec v1 (statement.md, resource_descriptor.md) and
its predicate ``test-result`` v0.1: the files are the subjects, the checks the tests.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from enclave_common.terminal import json_text
from enclave_launch import __version__
from enclave_launch.dry_run import DryRun
from enclave_launch.report.contents import ReportContents
from enclave_launch.report.evidence import matrix
from enclave_launch.report.evidence.requirements import DISCLAIMER, PARTS
from enclave_launch.report.evidence.surface import surface_document
from enclave_launch.report.html.page import html_report
from enclave_launch.report.markdown import code, escaped
from enclave_launch.report.review_text import Judged, findings_document
from enclave_launch.report.sarif import sarif_document

PAYLOAD_TYPE = "application/vnd.in-toto+json"
STATEMENT = "https://in-toto.io/Statement/v1"
PREDICATE = "https://in-toto.io/attestation/test-result/v0.1"


class Examined(NamedTuple):
    """The subject of the evidence. ``keys``, ``defaults`` and ``components`` are ``None`` where nothing was given to
    look at; ``document``: the dry run's JSON; ``rules``: every code that the checks can give, with its meaning."""

    document: Mapping[str, Any]
    plan: DryRun
    contents: ReportContents
    rules: Mapping[str, str]
    at: str
    root: str
    keys: list[dict[str, Any]] | None = None
    defaults: dict[str, Any] | None = None
    components: dict[str, Any] | None = None


def evidence_files(examined: Examined) -> dict[str, bytes]:
    """Return the files without the statement, which names them."""
    contents, graph = examined.contents, examined.contents.graph
    rows = list(matrix.rows(graph))
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
        "findings.sarif": sarif_document(contents.judged, examined.rules, __version__, examined.root),
        "accepted.json": _accepted(contents),
        "scope.json": _scope(examined),
        "requirements.json": {"version": 1, "claim": DISCLAIMER, "parts": [part._asdict() for part in PARTS]},
    }
    files = {name: f"{json_text(content, indent=2)}\n".encode() for name, content in documents.items()}
    files["access-control.csv"] = matrix.csv_text(rows).encode()
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
        {**diagnostic._asdict(), "reason": reason}
        for diagnostic, reason in contents.judged
        if reason is not None
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
