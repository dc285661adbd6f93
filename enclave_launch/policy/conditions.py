"""Which conditions of the table of built-in interfaces a running node meets: parameters, role, manifest."""

from __future__ import annotations

from collections.abc import Iterable

from enclave_launch.policy.running_node import RunningNode
from nodl.builtin_interfaces import BuiltinCondition
from nodl.node_interface import EndpointKind, NodeInterface

ALSO: dict[str, frozenset[BuiltinCondition]] = {
    "clock": frozenset({BuiltinCondition.SIM_TIME}),
    "logger-services": frozenset({BuiltinCondition.LOGGER_SERVICES}),
    "service-events": frozenset(),
}
"""What ``--also`` grants every node beyond what it has by itself: ``/clock``, which a node needs once somebody sets
``use_sim_time`` while it runs; the logger services; ``<service>/_service_event`` of service introspection."""


def conditions_of(node: RunningNode, also: Iterable[str] = ()) -> frozenset[BuiltinCondition]:
    """Which rows of the built-in interfaces hold for ``node``; ``also``: keys of ``ALSO`` for what else runs
    in it."""
    met = {BuiltinCondition.ALWAYS}.union(*(ALSO[name] for name in also))
    if node.interface.parameter_services:
        met.add(BuiltinCondition.PARAMETERS)
    if node.parameters.get("use_sim_time") is True:
        met.add(BuiltinCondition.SIM_TIME)
    if node.parameters.get("start_type_description_service") is not False:
        met.add(BuiltinCondition.TYPE_DESCRIPTION)
    if node.role == "lifecycle_node" or node.interface.lifecycle:
        met.add(BuiltinCondition.LIFECYCLE)
    if node.role == "container":
        met.add(BuiltinCondition.CONTAINER)
    if _listens_to_tf(node.interface):
        met.add(BuiltinCondition.TF_LISTENER)
    return frozenset(met)


def _listens_to_tf(interface: NodeInterface) -> bool:
    return any(
        endpoint.kind is EndpointKind.SUBSCRIPTION and endpoint.name.parts == ("/tf",)
        for endpoint in interface.endpoints
    )
