"""Write Zenoh's configuration: the router's, which enforces the permissions, and one for each enclave's processes.

For rmw_zenoh_cpp. The router starts with ZENOH_ROUTER_CONFIG_URI=KEYSTORE/zenoh/router.json5, a process with
ZENOH_SESSION_CONFIG_URI=KEYSTORE/enclaves/PATH/zenoh.json5 and --enclave PATH. On a host without CA keys (a bundle)
only the processes' files are written. From then on each change of the keystore is written there too.
"""

from __future__ import annotations

import argparse
import shlex

from enclave_addons.zenoh.writing import RESTART, matching_enclaves, write_zenoh
from enclave_common.command_line import TEXT
from enclave_common.words import counted
from keystore.disk import layout
from keystore.steps.options import ProvisionOptions
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("--enclave PATTERN", {"action": "append"},
     "which enclaves are on Zenoh: name or fnmatch pattern such as '/robot1/*'; repeatable (default: those "
     "that are already, all of them for the first time)"),
    ("--router HOST[:PORT]", TEXT,
     "where processes find the router (as before; localhost:7447 for the first time). For another host than "
     "localhost it listens on all addresses"),
    *common.CHANGE,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Write the files, and print which changed and how to use them. Returns 0."""
    names = matching_enclaves(arguments.keystore, arguments.enclave)
    options = ProvisionOptions(**common.change(arguments))
    report = write_zenoh(arguments.keystore, names, router=arguments.router, options=options)
    common.print_lines(f"{name} written" for name in report.written)
    if not report.written:
        print("nothing to change")
    common.warn(report.gaps, arguments)
    if report.enclaves:
        router = shlex.quote(str(report.keystore / layout.ZENOH_ROUTER))
        print(f"router of {counted(len(report.enclaves), 'enclave')} at {report.router.endpoint}:")
        print(f"  ZENOH_ROUTER_CONFIG_URI={router} ros2 run rmw_zenoh_cpp rmw_zenohd")
    if report.restart:
        common.warn([RESTART], arguments)
    return 0
