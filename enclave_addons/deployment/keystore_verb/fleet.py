"""Show the state of a fleet from its bundles and imported keystores.

  secure-keystore fleet status DIR...

Prints which host has which enclaves until when, is out of date, still trusts an old CA, or carries a revoked enclave.
With --keystore, that of the CA, signatures are checked and compared with its register.

exit status: 0 all well, 1 something to look at (or unreadable), 3 something expires within the margin, 4 has expired
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from enclave_addons.deployment.fleet import fleet_status
from enclave_common.command_line import PATH
from enclave_common.terminal import printable
from enclave_common.words import counted
from keystore.formats.validity import iso, parse_duration
from keystore.verb import common
from keystore.verb.status import ENDED, SOON

if TYPE_CHECKING:
    from enclave_addons.deployment.fleet import FleetReport, HostStatus


OPTIONS: common.Table = (
    ("what status", {"choices": ("status",)}, "the only one there is"),
    ("places DIR", {"nargs": "+", **PATH}, "bundles, or directories of them"),
    ("--keystore KEYSTORE", PATH, "the CA's own, to compare with"),
    common.WITHIN,
    common.FORMAT,
)


def run(arguments: argparse.Namespace) -> int:
    """Print the table. Returns 1 when a host is not as it should be."""
    report = fleet_status(
        arguments.places, keystore=arguments.keystore, within=parse_duration(arguments.expiring_within)
    )
    common.print_answer(arguments, _json(report), _lines(report))
    if any(one.ended for one in report.hosts):
        return ENDED
    if any(one.due for one in report.hosts):
        return SOON
    return 0 if report.is_good else 1


def _lines(report: FleetReport) -> Iterator[str]:
    for one in report.hosts:
        held = f"{counted(len(one.manifest.enclaves), 'enclave')}, until {iso(one.manifest.ends)}"
        yield f"{one.manifest.host}: number {one.manifest.number}, {held}"
        yield from (f"  {text}" for text in one.found)
    for place, why in report.unreadable:
        yield f"{printable(str(place))}: cannot be used: {why}"
    good = sum(not one.found for one in report.hosts)
    yield f"{counted(len(report.hosts), 'host')}, {good} as expected, {len(report.unreadable)} unreadable"


def _json(report: FleetReport) -> dict[str, Any]:
    return {
        "now": iso(report.now),
        "hosts": [_host(one) for one in report.hosts],
        "unreadable": [{"place": str(place), "why": why} for place, why in report.unreadable],
    }


def _host(one: HostStatus) -> dict[str, Any]:
    manifest = one.manifest
    return {
        "host": manifest.host,
        "place": str(one.place),
        "number": manifest.number,
        "ends": iso(manifest.ends),
        "crl_number": manifest.crl_number,
        "authorities": {role.value: list(listed) for role, listed in manifest.authorities.items()},
        "enclaves": [
            {
                "enclave": entry.enclave,
                "serial": f"{entry.serial:x}",
                "not_after": iso(entry.not_after),
                "key_made_on_host": not entry.has_key,
            }
            for entry in manifest.enclaves
        ],
        "found": list(one.found),
    }
