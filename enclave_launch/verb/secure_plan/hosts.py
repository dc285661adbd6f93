"""Show which process runs on which host, and what flows between hosts.

Hosts come from a file (--hosts: glob of nodes or enclaves -> host, docs/deployment.md), else from the machine
attributes of the launch file. An enclave on two hosts is one private key on two.

exit status: 0 each process has its host, 1 one has none or an enclave would be on two, 2 wrong usage
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from enclave_common.command_line import PATH, Option
from enclave_common.new_file import write_text
from enclave_common.terminal import json_text
from enclave_launch.deployment.placement import place
from enclave_launch.deployment.processes import deployed_processes
from enclave_launch.errors import UsageError, translated
from enclave_launch.report.hosts import enclaves_yaml, hosts_document, hosts_text
from enclave_launch.review.document import plan_from_document
from enclave_launch.review.information_flow import flow_graph
from enclave_launch.verb.secure_plan.plans import FORM, read_plan
from keystore.errors import InvalidInputError
from keystore.formats.hosts import Hosts, load_hosts

HOSTS: Option = ("--hosts FILE", PATH, "file that assigns nodes or enclaves to hosts")
OPTIONS = {
    "": (
        HOSTS,
        FORM,
        ("--write-enclaves FILE", PATH,
         "write the hosts with their enclaves, for secure-keystore export --hosts"),
    )
}  # fmt: skip


def run(options: argparse.Namespace) -> int:
    """Print who runs where. Returns 1 when a process has no host, or an enclave several."""
    document = read_plan(options.words, options)
    placement = place(deployed_processes(document), hosts_of(options.hosts))
    graph = flow_graph(plan_from_document(document))
    if options.write_enclaves is not None:
        with translated(OSError, UsageError, f"{options.write_enclaves}: "):
            write_text(options.write_enclaves, enclaves_yaml(placement))
    if options.format == "json":
        sys.stdout.write(json_text(hosts_document(placement, graph), indent=2) + "\n")
    else:
        sys.stdout.write(hosts_text(placement, graph))
    return 1 if placement.nowhere or placement.shared else 0


def hosts_of(file: Path | None) -> Hosts:
    """Read the hosts file; raises ``UsageError`` for a file that is not understood."""
    if file is None:
        return Hosts()
    with translated(InvalidInputError, UsageError):
        return load_hosts(file)
