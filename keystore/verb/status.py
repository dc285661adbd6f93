"""Show what in the keystore expires when, the earliest first.

exit status, for monitoring: 0 nothing is due, 3 something expires within the margin, 4 something has expired
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from enclave_common.command_line import FLAG
from enclave_common.terminal import printable
from enclave_common.words import counted
from keystore.formats.validity import iso, parse_duration
from keystore.steps.expiry import status
from keystore.verb import common

if TYPE_CHECKING:
    from datetime import datetime

    from keystore.steps.expiry import Expiry, StatusReport

SOON, ENDED = 3, 4


OPTIONS: common.Table = (
    common.KEYSTORE,
    common.WITHIN,
    ("--all", FLAG, "list everything in text too, not only what is due"),
    common.FORMAT,
)


def run(arguments: argparse.Namespace) -> int:
    """Print what ends when. Returns 3 where something ends soon, 4 where it has ended."""
    report = status(arguments.keystore)
    due = report.due(parse_duration(arguments.expiring_within))
    lines = _lines(report, report.expiries if arguments.all else due)
    common.print_answer(arguments, _json(report, due), lines)
    if any(not one.is_valid(report.now) for one in due):
        return ENDED
    return SOON if due else 0


def _json(report: StatusReport, due: tuple[Expiry, ...]) -> dict[str, Any]:
    return {
        "keystore": str(report.keystore),
        "now": iso(report.now),
        "enclaves": list(report.enclaves),
        "expiries": [
            {
                "what": one.what,
                "enclave": one.enclave,
                "not_before": iso(one.not_before),
                "not_after": iso(one.not_after),
                "days_left": (one.not_after - report.now).days,
                "valid": one.is_valid(report.now),
                "due": one in due,
            }
            for one in report.expiries
        ],
    }


def _lines(report: StatusReport, shown: tuple[Expiry, ...]) -> Iterator[str]:
    yield f"{counted(len(report.enclaves), 'enclave')} in {printable(str(report.keystore))}"
    for one in shown:
        yield f"{iso(one.not_after)}  {_left(one, report.now):>14}  {printable(one.subject)}"
    if not shown and report.expiries:
        first = report.expiries[0]
        yield f"nothing is due; the first to expire is the {first.subject}, {iso(first.not_after)}"


def _left(one: Expiry, now: datetime) -> str:
    if one.not_before > now:
        return "not yet valid"
    days = (one.not_after - now).days
    return f"{counted(days, 'day')} left" if days >= 0 else "expired"
