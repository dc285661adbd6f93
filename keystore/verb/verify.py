"""Check the whole keystore: chains, keys, signatures, subjects, validity, modes, links, strays, schemas.

Each finding comes with its repair. Exit status 1 for errors and exposures, 0 for warnings and notes only.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING

from enclave_common.command_line import PATH, TEXTS
from enclave_common.terminal import quoted
from enclave_common.words import counted
from keystore.formats.governance_yaml import governance_of
from keystore.signing.public_key import fingerprints
from keystore.verb import common
from keystore.verification import Requirements, verify

if TYPE_CHECKING:
    from keystore.verification import VerifyReport


OPTIONS: common.Table = (
    common.KEYSTORE,
    common.FORMAT,
    *common.SIGNING,
    ("--require-governance FILE", PATH,
     "the governance that must be in force, as YAML or XML; it may be weaker than the default"),
    ("--require-ca SHA256", TEXTS,
     "fingerprint of a CA certificate that may be trusted, no other may; repeatable"),
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Print the findings. Returns 1 when one of them is an error."""
    fingerprints(one.partition("=")[2] or one for one in arguments.require_ca)  # refuse what is none
    required = Requirements(
        governance_of(arguments.require_governance) if arguments.require_governance else None,
        tuple(arguments.require_ca),
    )
    report = verify(arguments.keystore, access=common.access(arguments), required=required)
    content = {
        "keystore": str(report.keystore),
        "enclaves": report.enclaves,
        "good": report.is_good,
        "findings": [asdict(finding) for finding in report.findings],
    }
    common.print_answer(arguments, content, _lines(report))
    return 0 if report.is_good else 1


def _lines(report: VerifyReport) -> Iterator[str]:
    for finding in report.findings:
        yield f"{finding.severity.value}: {quoted(finding.place)}: {finding.message} [{finding.code}]"
        if finding.repair:
            yield f"    {finding.repair}"
    verdict = "good" if report.is_good else "not good"
    yield f"{counted(report.enclaves, 'enclave')}, {counted(len(report.findings), 'finding')}: {verdict}"
