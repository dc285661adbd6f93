"""Check the plan, for CI: report what is wrong or worth a look.

Accepted findings, with their reasons, and forbidden flows are listed in enclaves.review.yaml in the working directory,
or in the file of --expect (docs/secure-plan.md). docs/checks.md explains each finding.

exit status: 0 no errors, 1 errors, with --strict also warnings, 2 wrong usage
"""

from __future__ import annotations

import argparse
import os
import sys

from enclave_addons.review.checks import MEANINGS
from enclave_addons.review.review_text import findings_document, findings_text
from enclave_addons.review.sarif import sarif_document
from enclave_addons.review.verb.judging import EXPECT, WITHIN, judged
from enclave_addons.review.verb.plans import planned_file, read_plan
from enclave_common.command_line import FLAG, PATH, FromProject, one_of
from enclave_common.terminal import json_text
from enclave_launch import __version__
from enclave_launch.dry_run import Diagnostic, DryRun

OPTIONS = {
    "": (
        ("--format", one_of("text", "json", "sarif"), "how to print (text)"),
        ("--strict", FLAG, "warnings count as errors"),
        (
            "--keystore DIR",
            {**PATH, "configured": FromProject("keystore", if_exists=True)},
            "compare the plan with it; it is only read",
        ),
        WITHIN,
        EXPECT,
    )
}


def run(options: argparse.Namespace) -> int:
    """Print the findings. Returns 1 for an error that nobody accepted (``--strict``: for any finding)."""
    plan = read_plan(options.words, options)
    found = judged(plan, options.expect, options.keystore, options.expiring_within, project=options.project)
    sys.stdout.write(_text(plan, found, options))
    open_ones = [finding for finding, accepted in found if accepted is None]
    return 1 if any(options.strict or finding.severity == "error" for finding in open_ones) else 0


def _text(plan: DryRun, found: list[tuple[Diagnostic, str | None]], options: argparse.Namespace) -> str:
    if options.format == "sarif":
        file = planned_file(options.words, options, plan)
        log = sarif_document(found, MEANINGS, __version__, os.getcwd(), file)
        return json_text(log, indent=2) + "\n"
    if options.format == "json":
        return json_text(findings_document(found), indent=2) + "\n"
    return findings_text(found, verbose=options.verbose)
