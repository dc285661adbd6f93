"""List the enclaves of a keystore."""

from __future__ import annotations

import argparse

from keystore.steps.provisioning import list_enclaves
from keystore.verb import common

OPTIONS: common.Table = (common.KEYSTORE, common.FORMAT)


def run(arguments: argparse.Namespace) -> int:
    """Print the names of all enclaves. Returns 0."""
    names = list_enclaves(arguments.keystore)
    common.print_answer(arguments, {"enclaves": names}, names)
    return 0
