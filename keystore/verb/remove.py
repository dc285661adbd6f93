"""Revoke enclaves and delete them; all remaining enclaves get the CRL.

Cyclone DDS and Fast DDS refuse revoked peers when they start with the new crl.pem, so deploy afterwards;
RTI Connext is not given a CRL by its rmw. Run it where the CA keys are: a deployed copy refuses it.
"""

from __future__ import annotations

import argparse

from enclave_common.command_line import FLAG
from enclave_common.words import counted
from keystore.steps.removal import RemoveOptions, remove
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("enclaves", {**common.ENCLAVES, "nargs": "+"}, ""),
    ("--no-revoke", FLAG, "only delete: copies elsewhere stay valid"),
    *common.CHANGE,
)


def run(arguments: argparse.Namespace) -> int:
    """Remove the enclaves, and print what was revoked. Returns 0."""
    options = RemoveOptions(revoke=not arguments.no_revoke, **common.change(arguments))
    report = remove(arguments.keystore, arguments.enclaves, options=options)
    if not arguments.quiet:
        common.print_lines(f"removed {name}" for name in report.removed)
        common.print_lines(f"already removed: {name}" for name in report.gone)
    if report.revoked:
        print(
            f"{counted(report.revoked, 'revoked certificate')} in the CRL; deploy the new crl.pem to all enclaves"
        )
    common.warn(report.warnings, arguments)
    return 0
