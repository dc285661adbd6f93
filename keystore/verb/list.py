"""List the enclaves of a keystore."""

from __future__ import annotations

import argparse

from keystore.verb import common


def describe(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``secure-keystore list``."""
    common.add_keystore(parser)
    common.add_format(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print the names of all enclaves. Returns 0."""
    from keystore.steps.provisioning import list_enclaves

    names = list_enclaves(arguments.keystore)
    common.print_answer(arguments, {"enclaves": names}, names)
    return 0
