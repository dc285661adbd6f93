"""Print the plan: enclaves, nodes, permissions."""

from __future__ import annotations

import argparse
import sys

from enclave_common.terminal import json_text
from enclave_launch.report.review_text import plan_text
from enclave_launch.review.document import plan_from_document
from enclave_launch.verb.secure_plan.plans import FORM, read_plan

OPTIONS = {"": (FORM,)}


def run(options: argparse.Namespace) -> int:
    """Print the plan. Returns 0."""
    document = read_plan(options.words, options)
    as_json = options.format == "json"
    text = f"{json_text(document, indent=2)}\n" if as_json else plan_text(plan_from_document(document))
    sys.stdout.write(text)
    return 0
