"""Suggest enclaves to merge, with the permissions in excess, and enclaves to split, with what that saves."""

from __future__ import annotations

import argparse
import sys

from enclave_addons.review.document import plan_from_document
from enclave_addons.review.review_text import suggestions_text
from enclave_addons.review.similarity import merges, splits
from enclave_addons.review.verb.plans import read_plan

OPTIONS = {"": ()}


def run(options: argparse.Namespace) -> int:
    """Print which enclaves could be merged or split. Returns 0."""
    plan = plan_from_document(read_plan(options.words, options))
    sys.stdout.write(suggestions_text(merges(plan), splits(plan)))
    return 0
