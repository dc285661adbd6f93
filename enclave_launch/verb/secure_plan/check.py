"""Check the plan, for CI: what planning tells, and what only a whole plan shows.

Findings that somebody accepted with a reason, and flows that must never be, stand in enclaves.review.yaml in the
working directory, or in the file of --expect (docs/secure-plan.md).

exit status: 0 nothing (left) to mend, 1 errors, with --strict also warnings, 2 wrong usage
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from enclave_launch.boundary.terminal import json_text
from enclave_launch.verb.secure_plan.plans import add_plan_arguments, read_plan

if TYPE_CHECKING:
    from enclave_launch.review.document import Told
    from enclave_launch.review.expectations import Expectations

EXPECTATIONS = "enclaves.review.yaml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_plan_arguments(parser)
    parser.add_argument("--format", choices=("text", "json", "sarif"), default="text")
    parser.add_argument("--strict", action="store_true", help="warnings count as errors")
    parser.add_argument("--expect", type=Path, metavar="FILE", help=f"default: {EXPECTATIONS}, if it exists")


def run(options: argparse.Namespace) -> int:
    from enclave_launch.review.checks import check_plan
    from enclave_launch.review.expectations import rule_findings

    document = read_plan(options.words, options)
    expected = _expectations(options.expect)
    findings = [*check_plan(document), *rule_findings(document, expected.never)]
    judged = [(told, expected.reason_to_accept(told)) for told in findings]
    sys.stdout.write(_text(judged, options.format))
    open_ones = [told for told, accepted in judged if accepted is None]
    return 1 if any(options.strict or told.severity == "error" for told in open_ones) else 0


def _text(judged: list[tuple[Told, str | None]], form: str) -> str:
    from enclave_launch.report.review_text import findings_document, findings_text

    if form == "sarif":
        from enclave_launch import __version__
        from enclave_launch.report.sarif import sarif_document
        from enclave_launch.review.checks import RULES

        return json_text(sarif_document(judged, RULES, __version__, os.getcwd()), indent=2) + "\n"
    if form == "json":
        return json_text(findings_document(judged), indent=2) + "\n"
    return findings_text(judged)


def _expectations(file: Path | None) -> Expectations:
    """Raises ``UsageError`` for a file that was named and is missing, and for content that is not understood."""
    import yaml

    from enclave_launch.boundary.files import read_text
    from enclave_launch.errors import UsageError
    from enclave_launch.review.expectations import Expectations, read_expectations

    if file is None:
        if not os.path.exists(EXPECTATIONS):
            return Expectations()
        file = Path(EXPECTATIONS)
    try:
        return read_expectations(yaml.safe_load(read_text(file)) or {}, str(file))
    except OSError as error:
        raise UsageError(f"{file}: {error.strerror}") from error
    except yaml.YAMLError as error:
        raise UsageError(f"{file}: {error}") from error
