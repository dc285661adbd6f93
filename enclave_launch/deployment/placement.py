"""Which process belongs on which host, what flows between hosts, and in which order to restart. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from enclave_launch.deployment.processes import DeployedProcess
from enclave_launch.errors import UsageError, translated
from enclave_launch.review.information_flow import FlowGraph, FlowStep, reached_from
from keystore.errors import InvalidInputError
from keystore.formats.hosts import Hosts, refuse_host_name

ONLY_HOST = "host"
"""Where nobody says anything about hosts."""


class Placement(NamedTuple):
    """``hosts``: host -> its processes, in launch order. ``nowhere``: processes that nothing places, though others are.
    ``shared``: enclave -> the hosts on which it would have to live, and with it its private key."""

    hosts: Mapping[str, tuple[DeployedProcess, ...]]
    nowhere: tuple[DeployedProcess, ...] = ()

    @property
    def shared(self) -> dict[str, tuple[str, ...]]:
        return {path: hosts for path, hosts in self.homes().items() if len(hosts) > 1}

    def homes(self) -> dict[str, tuple[str, ...]]:
        """Enclave -> hosts."""
        found: dict[str, dict[str, None]] = {}
        for host, processes in self.hosts.items():
            for process in processes:
                if process.enclave is not None:
                    found.setdefault(process.enclave, {})[host] = None
        return {path: tuple(hosts) for path, hosts in sorted(found.items())}


def place(processes: Iterable[DeployedProcess], hosts: Hosts) -> Placement:
    """By the hosts file (a node's name before its enclave), else by the ``machine`` of the launch file.

    Without either all are on one host. Raises ``UsageError`` for what belongs to several hosts.
    """
    listed = list(processes)
    found: dict[str, list[DeployedProcess]] = {name: [] for name in hosts.names}
    nowhere = []
    with translated(InvalidInputError, UsageError):
        for process in listed:
            host = _host_of(process, hosts)
            if host is None:
                nowhere.append(process)
            else:
                refuse_host_name(host, process.place)
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
    return process.machine


def flows_between_hosts(placement: Placement, graph: FlowGraph) -> Iterator[tuple[str, str, FlowStep]]:
    """(host, other host, what flows), in the order of the hosts: what the network between them must carry."""
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
    """Sources before what they influence, so that who comes back finds what it needs: one at a time, in this order.

    Enclaves that influence each other in a circle stand together, by name.
    """
    # Who reaches more stands before: along a flow the set of what is reached can only shrink.
    return sorted(enclaves, key=lambda one: (-len(reached_from(graph, one)), one))


def in_restart_order(processes: Sequence[DeployedProcess], graph: FlowGraph) -> tuple[DeployedProcess, ...]:
    """The processes by the order of their enclaves, those of one enclave as launched; without an enclave last."""
    order = restart_order({one.enclave for one in processes if one.enclave is not None}, graph)
    place_of = {path: number for number, path in enumerate(order)}
    return tuple(sorted(processes, key=lambda one: place_of.get(one.enclave or "", len(order))))
