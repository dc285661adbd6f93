"""List which launches have shares of which enclaves, or drop the shares of one.

A launch is a launch file with its arguments. Each launch on a keystore owns what it asks for; an enclave that several
of them use gets all of it. A launch that is never started again keeps its share until it is dropped: with --drop OWNER,
as it is listed. What no other launch asks for is then taken away for good.
"""

from __future__ import annotations

import argparse

from enclave_common.command_line import TEXT
from enclave_common.terminal import quoted
from keystore.steps.options import ProvisionOptions
from keystore.steps.provisioning import drop_shares
from keystore.steps.sharing import list_shares
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("--drop OWNER", TEXT, "drop the shares of this launch"),
    common.FORMAT,
    *common.CHANGE,
)


def run(arguments: argparse.Namespace) -> int:
    """Print which launch shares which enclave, or drop a launch. Returns 0."""
    if arguments.drop is not None:
        options = ProvisionOptions(**common.change(arguments))
        common.print_report(drop_shares(arguments.keystore, arguments.drop, options=options), arguments)
        return 0
    found = list_shares(arguments.keystore)
    lines = (
        f"{quoted(one.owner)}{' (running)' if one.running else ''}: {' '.join(one.enclaves)}" for one in found
    )
    common.print_answer(arguments, {"launches": [one._asdict() for one in found]}, lines)
    return 0
