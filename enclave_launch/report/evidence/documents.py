"""All files of the evidence, from values: file name -> bytes. The same values give the same bytes. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from enclave_launch import __version__
from enclave_launch.boundary.terminal import json_text
from enclave_launch.report.contents import ReportContents
from enclave_launch.report.evidence import matrix
from enclave_launch.report.evidence.requirements import DISCLAIMER, PARTS
from enclave_launch.report.evidence.summary import summary
from enclave_launch.report.evidence.surface import surface_document
from enclave_launch.report.html.page import html_report
from enclave_launch.report.review_text import findings_document
from enclave_launch.report.sarif import sarif_document


class Examined(NamedTuple):
    """What the evidence is about. ``keys``, ``defaults`` and ``components`` are ``None`` where nothing was given to
    look at; ``rules``: every code that the checks can give, with its meaning."""

    document: Mapping[str, Any]
    contents: ReportContents
    rules: Mapping[str, str]
    at: str
    root: str
    keys: list[dict[str, Any]] | None = None
    defaults: dict[str, Any] | None = None
    components: dict[str, Any] | None = None


def evidence_files(examined: Examined) -> dict[str, bytes]:
    """Without the statement, which names them."""
    contents, graph = examined.contents, examined.contents.graph
    rows = list(matrix.rows(graph))
    documents: dict[str, Any] = {
        "plan.json": examined.document,
        "access-control.json": {"version": 1, "permissions": [row._asdict() for row in rows]},
        "attack-surface.json": surface_document(examined.document),
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
        {**told._asdict(), "reason": reason} for told, reason in contents.judged if reason is not None
    ]
    return {"version": 1, "accepted": accepted}


def _scope(examined: Examined) -> dict[str, Any]:
    found = {told.code for told, _ in examined.contents.judged}
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
                told.text
                for told, _ in examined.contents.judged
                if told.code in ("interface-unknown", "no-manifest")
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
        "what the programs do: permissions bound it, and descriptions of nodes are taken as they are written",
        "ways between processes other than ROS: files, devices, networks, shared memory",
        "the host: its users, its updates, its physical protection",
        "what runs outside of this launch file",
    ]
