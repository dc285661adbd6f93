"""Findings as SARIF 2.1.0 (OASIS), the format that code hosts show beside the lines of a pull request."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from urllib.parse import quote

from enclave_launch.review.document import Told

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def sarif_document(
    findings: Iterable[tuple[Told, str | None]], rules: Mapping[str, str], version: str, root: str
) -> dict[str, object]:
    """``findings``: each with the reason why it was accepted, else ``None``; files below ``root`` become relative."""
    results = [_result(told, accepted, root) for told, accepted in findings]
    used = sorted({str(result["ruleId"]) for result in results})
    driver = {
        "name": "secure-plan",
        "semanticVersion": version,
        "rules": [{"id": code, "shortDescription": {"text": rules.get(code, code)}} for code in used],
    }
    base = {"SRCROOT": {"uri": f"file://{quote(os.fsencode(root.rstrip('/')))}/"}}
    run = {"tool": {"driver": driver}, "originalUriBaseIds": base, "results": results}
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}


def _result(told: Told, accepted: str | None, root: str) -> dict[str, object]:
    text = f"{told.text}: {told.remedy}" if told.remedy else told.text
    result: dict[str, object] = {
        "ruleId": told.code,
        "level": told.severity,
        "message": {"text": text},
        "partialFingerprints": {"codeSubjectAndFile/v1": _fingerprint(told, root)},
    }
    if told.file:
        result["locations"] = [_location(told.file, told.line, root)]
    if accepted is not None:
        result["suppressions"] = [{"kind": "external", "justification": accepted}]
    return result


def _fingerprint(told: Told, root: str) -> str:
    """The same while a finding stays, wherever its line moves: code hosts tell old findings from new ones by it."""
    file = os.path.relpath(told.file, root) if told.file else ""
    return hashlib.sha256(
        "\0".join((told.code, told.subject, file)).encode("utf-8", "backslashreplace")
    ).hexdigest()


def _location(file: str, line: int, root: str) -> dict[str, object]:
    path = os.path.abspath(file)
    inside = path.startswith(os.path.join(root, ""))
    place: dict[str, object] = (
        {"uri": quote(os.fsencode(os.path.relpath(path, root))), "uriBaseId": "SRCROOT"}
        if inside
        else {"uri": f"file://{quote(os.fsencode(path))}"}
    )
    physical: dict[str, object] = {"artifactLocation": place}
    if line > 0:
        physical["region"] = {"startLine": line}
    return {"physicalLocation": physical}
