"""The in-toto statement about the files of the evidence. Pure.

Source: in-toto attestation framework, spec v1 (statement.md, resource_descriptor.md) and its predicate
``test-result`` v0.1: the files are the subjects, the checks the tests.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from enclave_launch.boundary.terminal import json_text
from enclave_launch.report.review_text import Judged

PAYLOAD_TYPE = "application/vnd.in-toto+json"
STATEMENT = "https://in-toto.io/Statement/v1"
PREDICATE = "https://in-toto.io/attestation/test-result/v0.1"


def statement(files: Mapping[str, bytes], judged: Judged, checked: list[str]) -> bytes:
    """``judged``: the findings; ``checked``: the code of every check that was made."""
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
    return {told.code for told, accepted in judged if accepted is None and told.severity == severity}


def _resource(name: str, data: bytes) -> dict[str, Any]:
    return {"name": name, "digest": {"sha256": hashlib.sha256(data).hexdigest()}}
