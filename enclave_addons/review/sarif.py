"""Findings as SARIF 2.1.0 (OASIS), the format that code hosts show beside the lines of a pull request."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from urllib.parse import quote

from enclave_launch.dry_run import Diagnostic

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def sarif_document(
    findings: Iterable[tuple[Diagnostic, str | None]],
    rules: Mapping[str, str],
    version: str,
    root: str,
    planned: str,
) -> dict[str, object]:
    """Return findings, each with the reason why it was accepted, as a SARIF log.

    Paths below ``root`` are relative. A finding without a file points to ``planned``, the file that was checked: code
    hosts refuse a log in which one result has no place.
    """
    results = [_result(diagnostic, accepted, root, planned) for diagnostic, accepted in findings]
    used = sorted({str(result["ruleId"]) for result in results})
    driver = {
        "name": "secure-plan",
        "semanticVersion": version,
        "rules": [{"id": code, "shortDescription": {"text": rules.get(code, code)}} for code in used],
    }
    base = {"SRCROOT": {"uri": f"file://{quote(os.fsencode(root.rstrip('/')))}/"}}
    run = {"tool": {"driver": driver}, "originalUriBaseIds": base, "results": results}
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}


def _result(diagnostic: Diagnostic, accepted: str | None, root: str, planned: str) -> dict[str, object]:
    text = f"{diagnostic.text}: {diagnostic.remedy}" if diagnostic.remedy else diagnostic.text
    result: dict[str, object] = {
        "ruleId": diagnostic.code,
        "level": diagnostic.severity,
        "message": {"text": text},
        "partialFingerprints": {"codeSubjectAndFile/v1": _fingerprint(diagnostic, root)},
        "locations": [_location(diagnostic.file or planned, diagnostic.line if diagnostic.file else 0, root)],
    }
    if accepted is not None:
        result["suppressions"] = [{"kind": "external", "justification": accepted}]
    return result


def _fingerprint(diagnostic: Diagnostic, root: str) -> str:
    """Return an identifier that is stable while a finding's line moves: code hosts match findings of two runs by it."""
    file = os.path.relpath(diagnostic.file, root) if diagnostic.file else ""
    return hashlib.sha256(
        "\0".join((diagnostic.code, diagnostic.subject, file)).encode("utf-8", "backslashreplace")
    ).hexdigest()


def _location(file: str, line: int, root: str) -> dict[str, object]:
    path = os.path.abspath(file)
    inside = path.startswith(os.path.join(root, ""))
    place: dict[str, object] = (
        {"uri": quote(os.fsencode(os.path.relpath(path, root))), "uriBaseId": "SRCROOT"}
        if inside
        else {"uri": f"file://{quote(os.fsencode(path))}"}
    )
    return {"physicalLocation": {"artifactLocation": place, "region": {"startLine": max(line, 1)}}}
