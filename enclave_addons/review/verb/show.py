"""Print the plan: enclaves, nodes, permissions."""

from __future__ import annotations

import argparse
import sys

from enclave_addons.review.document import plan_from_document
from enclave_addons.review.review_text import plan_text
from enclave_addons.review.verb.plans import FORM, read_document, read_plan
from enclave_common.terminal import json_text

OPTIONS = {"": (FORM,)}


def run(options: argparse.Namespace) -> int:
    """Print the plan. Returns 0."""
    if options.format == "json":
        sys.stdout.write(f"{json_text(read_document(options.words, options), indent=2)}\n")
    else:
        sys.stdout.write(plan_text(plan_from_document(read_plan(options.words, options))))
    return 0
