"""Judge a plan for ``check``: each finding with the reason why the repository accepts it, if it does."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

import yaml

from enclave_common.command_line import PATH, Option
from enclave_common.files import read_text
from enclave_common.yaml_reader import load_yaml
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import UsageError, translated
from enclave_launch.review.checks import check_plan
from enclave_launch.review.checks.keystore import against_keystore, against_router
from enclave_launch.review.document import PlanFinding, plan_from_document
from enclave_launch.review.expectations import Expectations, read_expectations, rule_findings
from enclave_launch.verb.secure_plan.keystores import (
    DEFAULT_MARGIN,
    endings,
    on_zenoh,
    signed_grants,
    zenoh_findings,
)

EXPECTATIONS = "enclaves.review.yaml"
EXPECT: Option = ("--expect FILE", PATH, f"default: {EXPECTATIONS}, if it exists")
WITHIN: Option = ("--within TIME", {"default": DEFAULT_MARGIN}, "what expires soon (30d)")


def judged(
    document: DryRun,
    expect: Path | None,
    keystore: Path | str | None = None,
    within: str = DEFAULT_MARGIN,
    now: datetime | None = None,
) -> list[tuple[PlanFinding, str | None]]:
    """Return findings of a dry run, of the rules in ``expect``, and of ``keystore``, if one is given.

    Raises ``UsageError`` for rules that are missing or not understood, ``ProvisionError`` for the keystore.
    """
    expected = expectations(expect)
    findings = [*check_plan(document), *rule_findings(document, expected.never)]
    if keystore is not None:
        findings += _of_keystore(document, keystore, within, now)
    return [(finding, expected.reason_to_accept(finding)) for finding in findings]


def _of_keystore(
    document: DryRun, keystore: Path | str, within: str, now: datetime | None
) -> list[PlanFinding]:
    plan = plan_from_document(document)
    found = against_keystore(plan, signed_grants(keystore), endings(keystore, within, now))
    if plan.on_zenoh:
        found += against_router(plan, on_zenoh(keystore), zenoh_findings(keystore, now))
    return found


def expectations(file: Path | None) -> Expectations:
    """Read the expectations; raises ``UsageError`` for a named file that is missing, and for invalid content."""

    if file is None:
        if not os.path.exists(EXPECTATIONS):
            return Expectations()
        file = Path(EXPECTATIONS)
    with translated(OSError, UsageError, f"{file}: "), translated(yaml.YAMLError, UsageError, f"{file}: "):
        return read_expectations(load_yaml(read_text(file)) or {}, str(file))
