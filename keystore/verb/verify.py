"""Check the whole keystore: chains, keys, signatures, subjects, validity, modes, links, strays, schemas.

Each finding comes with its repair. Exit status 1 for errors and exposures, 0 for warnings and notes only.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import TYPE_CHECKING

from keystore.verb import common

if TYPE_CHECKING:
    from keystore.verification import VerifyReport


def describe(parser: argparse.ArgumentParser) -> None:
    common.add_keystore(parser)
    common.add_format(parser)
    common.add_signing(parser)


def run(arguments: argparse.Namespace) -> int:
    from keystore.verification import verify

    report = verify(arguments.keystore, access=common.access(arguments))
    if arguments.format == "json":
        common.print_json({
            "version": 1,
            "keystore": str(report.keystore),
            "enclaves": report.enclaves,
            "good": report.is_good,
            "findings": [asdict(finding) for finding in report.findings],
        })  # fmt: skip
    else:
        _print(report)
    return 0 if report.is_good else 1


def _print(report: VerifyReport) -> None:
    from keystore.errors import printable

    for finding in report.findings:
        print(f"{finding.severity.value}: {printable(finding.place)}: {finding.message} [{finding.code}]")
        if finding.repair:
            print(f"    {finding.repair}")
    verdict = "good" if report.is_good else "not good"
    print(f"{report.enclaves} enclaves, {len(report.findings)} findings: {verdict}")
