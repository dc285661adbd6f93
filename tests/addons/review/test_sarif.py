"""SARIF as its schema wants it, for findings of every kind and with any text."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft4Validator

from enclave_addons.review.checks import RULES, check_plan
from enclave_addons.review.checks.rules import finding
from enclave_addons.review.sarif import sarif_document
from enclave_common.terminal import json_text
from enclave_launch import DryRun
from enclave_launch.dry_run import Diagnostic
from tests.addons.review.report.conftest import hostile, robot

SCHEMA = Path(__file__).parent / "sarif" / "sarif-2.1.0-rtm.5.json"
VALIDATOR = Draft4Validator(json.loads(SCHEMA.read_text(encoding="utf-8")))
ROOT = "/work/my robot"


def results(findings: list[tuple[Diagnostic, str | None]]) -> list[dict[str, Any]]:
    log: dict[str, Any] = sarif_document(findings, RULES, "0.1.0", ROOT, f"{ROOT}/a.launch.xml")
    found: list[dict[str, Any]] = log["runs"][0]["results"]
    return found


def errors(findings: list[tuple[Diagnostic, str | None]]) -> list[str]:
    document = json.loads(json_text(sarif_document(findings, RULES, "0.1.0", ROOT, f"{ROOT}/a.launch.xml")))
    return [f"{list(error.absolute_path)}: {error.message}" for error in VALIDATOR.iter_errors(document)]


@pytest.mark.parametrize("plan", [robot(), hostile()], ids=["robot", "hostile names"])
def test_findings_of_plans_are_valid(plan: DryRun) -> None:
    found = check_plan(plan)
    assert found
    assert errors([(told, None if number % 2 else "accepted") for number, told in enumerate(found)]) == []


text = st.text(max_size=20)
told = st.builds(
    Diagnostic,
    severity=st.sampled_from(["error", "warning"]),
    code=st.sampled_from(sorted(RULES)),
    subject=text,
    file=st.none()
    | st.binary(min_size=1, max_size=20).map(  # names as a file may have them, also those that are not UTF-8
        lambda name: f"{ROOT}/{os.fsdecode(name.replace(bytes(1), b'0'))}"
    ),
    line=st.integers(0, 10**6),
    text=text,
    remedy=text,
)


@given(st.lists(st.tuples(told, st.none() | text), max_size=4))
def test_any_finding_is_valid(findings: list[tuple[Diagnostic, str | None]]) -> None:
    assert errors(findings) == []


def test_the_schema_refuses_what_is_not_sarif() -> None:
    document: dict[str, Any] = sarif_document([], RULES, "0.1.0", ROOT, f"{ROOT}/a.launch.xml")
    assert not list(VALIDATOR.iter_errors(document))
    assert list(VALIDATOR.iter_errors({**document, "version": "2.0.0"}))
    assert list(VALIDATOR.iter_errors({**document, "runs": [{"results": []}]}))


def test_a_finding_keeps_its_fingerprint_when_its_line_moves() -> None:
    def at(line: int, subject: str = "/x") -> Diagnostic:
        return finding("no-publisher", subject, "text", (f"{ROOT}/a.xml", line))

    prints = [results([(each, None)])[0]["partialFingerprints"] for each in (at(3), at(9), at(3, "/y"))]
    assert prints[0] == prints[1] != prints[2]


def test_each_result_has_a_place_without_which_code_hosts_refuse_the_whole_log() -> None:
    found = results([
        (finding("node-name-twice", "/x", "text"), None),
        (finding("no-publisher", "/x", "text", (f"{ROOT}/b.launch.xml", 7)), None),
    ])  # fmt: skip
    places = [result["locations"][0]["physicalLocation"] for result in found]
    assert [(place["artifactLocation"]["uri"], place["region"]["startLine"]) for place in places] == [
        ("a.launch.xml", 1),
        ("b.launch.xml", 7),
    ]
