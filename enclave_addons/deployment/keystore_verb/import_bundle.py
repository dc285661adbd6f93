"""Put a host's bundle in force, on that host: checked whole, then all at once. Needs no network and no CA key.

The first import pins the CAs (--require-ca, twice) and the host's name; later ones refuse what another CA signed,
another host's bundle, an earlier one, what was changed or cut off, and a governance weaker than the default. The bundle
in force restores what was changed since. KEYSTORE becomes a link to the version in force; ROS_SECURITY_KEYSTORE names
it. What is printed last is who has to be restarted; --restart does it, by the systemd units of this host.
"""

from __future__ import annotations

import argparse
import os
import socket

from enclave_addons.deployment.host_units import UnitOptions, differences, installed_units, stop
from enclave_addons.deployment.importing import (
    ImportOptions,
    ImportReport,
    Restart,
    import_bundle,
    parse_owner,
)
from enclave_addons.deployment.keystore_verb.units import UNIT_OPTIONS, restarted, unit_options
from enclave_addons.deployment.units import Unit, in_restart_order
from enclave_common.command_line import FLAG, PATH, TEXT, TEXTS
from keystore.disk.versions import Versions
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("bundle BUNDLE", PATH, "HOST.bundle of secure-keystore export"),
    ("--host NAME", TEXT, "which host this is; for the first import (default: hostname)"),
    ("--require-ca ROLE=SHA256", TEXTS,
     "which CA may do what: identity=SHA256 and permissions=SHA256; both at the first import; repeatable"),
    ("--accept-weaker ATTRIBUTE", TEXTS,
     "take a governance in which this attribute is weaker than the default; repeatable"),
    ("--owner UID:GID", TEXT,
     "for containers: write each enclave once more, as a directory of its own that belongs to this user; remembered"),
    ("--restart", FLAG, "restart the units that have to be, and stop those of enclaves that are gone"),
    *UNIT_OPTIONS,
    common.FORMAT,
    common.LOCK,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Put the bundle in force, and print what changed and what to restart. Returns 0."""
    host = arguments.host
    if host is None and Versions(arguments.keystore).current is None:
        host = socket.gethostname()
    options = ImportOptions(
        host,
        tuple(arguments.require_ca),
        tuple(arguments.accept_weaker),
        parse_owner(arguments.owner) if arguments.owner is not None else None,
        arguments.lock_timeout,
    )
    report = import_bundle(arguments.keystore, arguments.bundle, options=options)
    content = {
        "host": report.manifest.host,
        "number": report.manifest.number,
        "changed": list(report.changed),
        "removed": list(report.removed),
        "restart": report.restart.name.lower(),
    }
    lines = (
        f"{report.keystore}: {report.manifest.host}, number {report.manifest.number} is in force",
        *(f"{one}: changed" for one in report.changed),
        *(f"{one}: removed" for one in report.removed),
        f"to restart: {report.restart.value}",
    )
    common.print_answer(arguments, content, lines)
    found = unit_options(arguments)
    keystore = os.path.abspath(arguments.keystore)
    units = [one for one in installed_units(found) if one.target == one.name or one.keystore == keystore]
    common.warn((*report.notes, *differences(units, report.manifest)), arguments)
    return _restart(report, units, found) if arguments.restart else 0


def _restart(report: ImportReport, units: list[Unit], options: UnitOptions) -> int:
    processes = in_restart_order(units)
    gone = [one for one in processes if one.enclave not in report.manifest.names]
    stop(gone)
    common.print_lines(f"{one.name}: stopped, its enclave is gone" for one in gone)
    left = [one for one in processes if one not in gone]
    if report.restart is Restart.NOBODY:
        return 0
    if report.restart is Restart.CHANGED:
        left = [one for one in left if one.enclave in report.changed]
    return restarted(left, options, together=report.restart is Restart.TOGETHER)
