"""Assign processes to hosts, find what flows between hosts, and order restarts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from enclave_addons.deployment.hosts import Hosts, refuse_host_name
from enclave_addons.deployment.processes import DeployedProcess
from enclave_addons.review.information_flow import FlowGraph, FlowStep, reached_from
from enclave_launch.errors import UsageError, translated
from keystore.errors import InvalidInputError

ONLY_HOST = "host"
"""The name of the host if neither the hosts file nor the launch file names one."""


class Placement(NamedTuple):
    """The processes of each host in launch order, and those that nothing places although others are placed."""

    hosts: Mapping[str, tuple[DeployedProcess, ...]]
    nowhere: tuple[DeployedProcess, ...] = ()

    @property
    def shared(self) -> dict[str, tuple[str, ...]]:
        """Return the enclaves, and so private keys, that would be on several hosts -> those hosts."""
        return {path: hosts for path, hosts in self.homes().items() if len(hosts) > 1}

    def homes(self) -> dict[str, tuple[str, ...]]:
        """Return enclave -> hosts."""
        found: dict[str, dict[str, None]] = {}
        for host, processes in self.hosts.items():
            for process in processes:
                if process.enclave is not None:
                    found.setdefault(process.enclave, {})[host] = None
        return {path: tuple(hosts) for path, hosts in sorted(found.items())}


def place(processes: Iterable[DeployedProcess], hosts: Hosts) -> Placement:
    """Place each process by the hosts file (node before enclave), else by its ``machine``, else on ``ONLY_HOST``.

    Raises UsageError for a process on several hosts, and a host without a valid name."""
    listed = list(processes)
    found: dict[str, list[DeployedProcess]] = {name: [] for name in hosts.names}
    nowhere = []
    with translated(InvalidInputError, UsageError):
        for process in listed:
            host = _host_of(process, hosts)
            if host is None:
                nowhere.append(process)
            else:
                refuse_host_name(host, process.entry.place)
                found.setdefault(host, []).append(process)
    if not found:
        return Placement({ONLY_HOST: tuple(listed)})
    return Placement({host: tuple(own) for host, own in found.items()}, tuple(nowhere))


def _host_of(process: DeployedProcess, hosts: Hosts) -> str | None:
    for node in process.nodes:
        if (host := hosts.of_node(node)) is not None:
            return host
    if process.enclave is not None and (host := hosts.of_enclave(process.enclave)) is not None:
        return host
    return process.entry.machine


def flows_between_hosts(placement: Placement, graph: FlowGraph) -> Iterator[tuple[str, str, FlowStep]]:
    """Yield (host, other host, what flows) for what the network between hosts must carry, in the order of the hosts."""
    homes = placement.homes()
    order = list(placement.hosts)
    found = [
        (one, two, FlowStep(source, target, hops))
        for source, targets in graph.items()
        for target, hops in targets.items()
        for one in homes.get(source, ())
        for two in homes.get(target, ())
        if one != two
    ]
    yield from sorted(found, key=lambda flow: (order.index(flow[0]), order.index(flow[1]), flow[2]))


def restart_order(enclaves: Iterable[str], graph: FlowGraph) -> list[str]:
    """Sort enclaves so that each comes before what it influences; those in a circle stand together, by name."""
    # Who reaches more stands before: along a flow the set of what is reached can only shrink.
    return sorted(enclaves, key=lambda one: (-len(reached_from(graph, one)), one))


def in_restart_order(processes: Sequence[DeployedProcess], graph: FlowGraph) -> tuple[DeployedProcess, ...]:
    """Sort processes by the order of their enclaves, those of one enclave as launched; those without one come last."""
    order = restart_order({one.enclave for one in processes if one.enclave is not None}, graph)
    place_of = {path: number for number, path in enumerate(order)}
    return tuple(sorted(processes, key=lambda one: place_of.get(one.enclave or "", len(order))))
