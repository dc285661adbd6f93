"""Hosts of a plan as text and as plain values: what runs where, what flows between them, what would be on two."""

from __future__ import annotations

from collections.abc import Iterator

from enclave_launch.deployment.placement import Placement, flows_between_hosts, in_restart_order
from enclave_launch.deployment.yaml_text import yaml_text
from enclave_launch.report.review_text import step_text
from enclave_launch.review.information_flow import FlowGraph


def hosts_text(placement: Placement, graph: FlowGraph) -> str:
    """Format a placement for a terminal."""
    return "\n".join(_lines(placement, graph)) + "\n"


def _lines(placement: Placement, graph: FlowGraph) -> Iterator[str]:
    for host, processes in placement.hosts.items():
        yield f"host {host}"
        for one in processes:
            where = f"enclave {one.enclave}" if one.enclave is not None else "no enclave"
            yield f"  {one.fqn or one.process}  ({where})"
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
        yield f"{one.place}: {one.fqn or one.process} is on no host"


def hosts_document(placement: Placement, graph: FlowGraph) -> dict[str, object]:
    """Return a placement as plain values; ``restart_order`` lists sources before what they influence."""
    return {
        "version": 1,
        "hosts": {
            host: {
                "processes": [one.process for one in processes],
                "enclaves": sorted({one.enclave for one in processes if one.enclave is not None}),
                "restart_order": [one.process for one in in_restart_order(processes, graph)],
            }
            for host, processes in placement.hosts.items()
        },
        "flows": [
            {"from": source, "to": target, "by": step_text(step)}
            for source, target, step in flows_between_hosts(placement, graph)
        ],
        "enclaves_on_several_hosts": {path: list(hosts) for path, hosts in placement.shared.items()},
        "on_no_host": [one.process for one in placement.nowhere],
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
