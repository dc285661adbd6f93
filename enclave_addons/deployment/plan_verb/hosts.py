"""Show which process runs on which host, and what flows between hosts.

Hosts come from a file (--hosts: glob of nodes or enclaves -> host, docs/deployment.md), else from the machine
attributes of the launch file. An enclave on two hosts is one private key on two.

exit status: 0 each process has its host, 1 one has none or an enclave would be on two, 2 wrong usage
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from enclave_addons.deployment.hosts import Hosts, load_hosts
from enclave_addons.deployment.placement import Placement, flows_between_hosts, in_restart_order, place
from enclave_addons.deployment.processes import deployed_processes
from enclave_addons.deployment.yaml_text import yaml_text
from enclave_addons.review.document import plan_from_document
from enclave_addons.review.information_flow import FlowGraph, flow_graph
from enclave_addons.review.review_text import step_text
from enclave_addons.review.verb.plans import FORM, read_plan
from enclave_common.command_line import PATH, FromProject, Option
from enclave_common.files import write_text
from enclave_common.terminal import json_text
from enclave_launch.errors import UsageError, translated
from keystore.errors import InvalidInputError

HOSTS: Option = (
    "--hosts FILE",
    {**PATH, "configured": FromProject("hosts")},
    "file that assigns nodes or enclaves to hosts",
)
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
        sys.stdout.writelines(f"{line}\n" for line in _lines(placement, graph))
    return 1 if placement.nowhere or placement.shared else 0


def hosts_of(file: Path | None) -> Hosts:
    """Read the hosts file; raises ``UsageError`` for a file that is not understood."""
    if file is None:
        return Hosts()
    with translated(InvalidInputError, UsageError):
        return load_hosts(file)


def _lines(placement: Placement, graph: FlowGraph) -> Iterator[str]:
    for host, processes in placement.hosts.items():
        yield f"host {host}"
        for one in processes:
            where = f"enclave {one.enclave}" if one.enclave is not None else "no enclave"
            yield f"  {one.shown}  ({where})"
    flows: dict[tuple[str, str], list[str]] = {}
    for source, target, step in flows_between_hosts(placement, graph):
        flows.setdefault((source, target), []).append(step_text(step))
    for (source, target), steps in flows.items():
        yield f"from {source} to {target}"
        yield from (f"  {text}" for text in steps)
    if len(placement.hosts) > 1 and not flows:
        yield "nothing flows between the hosts"
    for enclave, hosts in placement.shared.items():
        yield f"enclave {enclave} would have to live on {', '.join(hosts)}: one private key on several hosts"
    for one in placement.nowhere:
        yield f"{one.entry.place}: {one.shown} is on no host"


def hosts_document(placement: Placement, graph: FlowGraph) -> dict[str, object]:
    """Return a placement as plain values; ``restart_order`` lists sources before what they influence."""
    return {
        "version": 1,
        "hosts": {
            host: {
                "processes": [one.entry.process for one in processes],
                "enclaves": sorted({one.enclave for one in processes if one.enclave is not None}),
                "restart_order": [one.entry.process for one in in_restart_order(processes, graph)],
            }
            for host, processes in placement.hosts.items()
        },
        "flows": [
            {"from": source, "to": target, "by": step_text(step)}
            for source, target, step in flows_between_hosts(placement, graph)
        ],
        "enclaves_on_several_hosts": {path: list(hosts) for path, hosts in placement.shared.items()},
        "on_no_host": [one.entry.process for one in placement.nowhere],
    }


def enclaves_yaml(placement: Placement) -> str:
    """Write a hosts file that names enclaves only, for ``secure-keystore export --hosts``."""
    homes = placement.homes()
    return yaml_text({
        "version": 1,
        "hosts": {
            host: {"enclaves": [path for path, hosts in homes.items() if host in hosts]} for host in placement.hosts
        },
    })  # fmt: skip
