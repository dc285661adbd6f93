"""Put a host's bundle in force, on that host: checked whole, then all at once. Needs no network and no CA key.

The first import pins the CAs (--require-ca, twice) and the host's name; later ones refuse what another CA signed,
another host's bundle, an earlier one, what was changed or cut off, and a governance weaker than the default. The bundle
in force restores what was changed since. KEYSTORE becomes a link to the version in force; ROS_SECURITY_KEYSTORE names
it. What is printed last is who has to be restarted.
"""

from __future__ import annotations

import argparse
import socket

from enclave_common.command_line import PATH, TEXT, TEXTS
from keystore.disk.versions import Versions
from keystore.steps.importing import ImportOptions, import_bundle
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("bundle BUNDLE", PATH, "HOST.bundle of secure-keystore export"),
    ("--host NAME", TEXT, "which host this is; for the first import (default: hostname)"),
    ("--require-ca ROLE=SHA256", TEXTS,
     "which CA may do what: identity=SHA256 and permissions=SHA256; both at the first import; repeatable"),
    ("--accept-weaker ATTRIBUTE", TEXTS,
     "take a governance in which this attribute is weaker than the default; repeatable"),
    common.FORMAT,
    common.LOCK,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Put the bundle in force, and print what changed and what to restart. Returns 0."""
    host = arguments.host
    if host is None and Versions(arguments.keystore).current is None:
        host = socket.gethostname()
    options = ImportOptions(
        host, tuple(arguments.require_ca), tuple(arguments.accept_weaker), arguments.lock_timeout
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
    common.warn(report.notes, arguments)
    return 0
