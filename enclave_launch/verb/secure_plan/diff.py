"""Compare two plans: enclaves, nodes, permissions and flows that were added and removed.

  secure-plan diff before.json PACKAGE LAUNCH_FILE [name:=value ...]
  secure-plan diff before.json after.json --format markdown

exit status: 0 no enclave may do more than before, 1 rights grew, 2 wrong usage
"""

from __future__ import annotations

import argparse
import sys

from enclave_launch.boundary.terminal import json_text
from enclave_launch.verb.secure_plan.plans import WORDS, add_resolving_options, read_plan


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("before", metavar="BEFORE", help="a saved plan (.json) or the PATH of a launch file")
    parser.add_argument("words", nargs="+", metavar=WORDS, help="what it is compared with")
    add_resolving_options(parser)
    parser.add_argument("--format", choices=("text", "json", "markdown"), default="text")


def run(options: argparse.Namespace) -> int:
    from enclave_launch.report.changes import changes_document, changes_markdown, changes_text
    from enclave_launch.review.changes import changes
    from enclave_launch.review.document import plan_from_document

    before = plan_from_document(read_plan([options.before], options))
    changed = changes(before, plan_from_document(read_plan(options.words, options)))
    if options.format == "json":
        sys.stdout.write(json_text(changes_document(changed), indent=2) + "\n")
    else:
        sys.stdout.write((changes_markdown if options.format == "markdown" else changes_text)(changed))
    return 1 if changed.rights_grew else 0
