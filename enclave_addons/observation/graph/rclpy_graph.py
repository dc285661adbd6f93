"""Asks rclpy for the graph, where that is installed: through the middleware that the nodes themselves use. Acts.

rclpy gives names and types by node; quality of service and identifiers of topics only, so participants are
distinguished by the identifiers of what their nodes publish. It does not know processes. Source: rclpy ``node.py``,
``action/graph.py``.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from enclave_addons.observation.graph.model import (
    Attribution,
    Graph,
    GraphNode,
    GraphProcess,
    SeenEndpoint,
    SeenInterface,
    SeenParticipant,
)
from enclave_addons.review.quality import INFINITE, Quality
from nodl.names import join
from nodl.node_interface import EndpointKind

_NAME = f"_ros2cli_observer_{os.getpid()}"
"""Hidden, and what the enclave of ``secure-keystore tool-enclave --for list`` may call itself."""
_GUID = 16
_NO_DURATION = (0, 9223372036854775807)  # unspecified, and rmw's infinite


class RclpyObserver:
    """Observe as ``CycloneObserver``, in the domain and enclave that rclpy takes from ``ROS_*``. Raises ``ImportError``
    without rclpy, and what rclpy raises where the middleware refuses."""

    def __init__(self) -> None:
        import rclpy

        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node(
            _NAME,
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,
            allow_undeclared_parameters=True,
        )
        self._seen: dict[str, GraphProcess] = {}
        self._now: tuple[GraphProcess, ...] = ()
        self._changes = 0

    def poll(self) -> int:
        """Poll once, and return how many changes there have been in all."""
        now = tuple(self._processes())
        if now != self._now:
            self._now = now
            self._changes += 1
            for process in now:
                known = self._seen.get(process.participant.guid)
                self._seen[process.participant.guid] = _united(known, process) if known else process
        return self._changes

    def graph(self, *, past: bool = False) -> Graph:
        found = self._seen.values() if past else self._now
        return Graph(tuple(sorted(found, key=lambda each: each.participant.guid)))

    @property
    def forged(self) -> tuple[str, ...]:
        """Return nothing: rclpy does not show who wrote a list."""
        return ()

    def close(self) -> None:
        self._node.destroy_node()
        self._context.shutdown()

    def _processes(self) -> Iterator[GraphProcess]:
        nodes: dict[SeenParticipant, list[GraphNode]] = {}
        for name, namespace, enclave in self._node.get_node_names_and_namespaces_with_enclaves():
            if name == _NAME:
                continue
            fqn = join(namespace, name)
            interfaces = tuple(sorted(self._interfaces(name, namespace, fqn)))
            guids = (endpoint.participant for each in interfaces for endpoint in each.endpoints)
            guid = next(guids, hashlib.sha256(f"{enclave} {fqn}".encode()).digest()[:_GUID].hex())
            ordinal = sum(each.fqn == fqn for found in nodes.values() for each in found)
            node = GraphNode(fqn, interfaces, ordinal)
            nodes.setdefault(SeenParticipant(guid, enclave), []).append(node)
        for participant, members in sorted(nodes.items()):
            yield GraphProcess(
                participant, tuple(sorted(members)), listed=True, gid_size=_GUID, announced=True
            )

    def _interfaces(self, name: str, namespace: str, fqn: str) -> Iterator[SeenInterface]:
        for kind, ask in self._questions().items():
            for final, types in _names_and_types(ask, name, namespace):
                if "/_action/" in final and kind.family != "action":
                    continue
                endpoints = tuple(self._endpoints(kind, final, fqn)) if kind.family == "topic" else ()
                for type_name in types:
                    yield SeenInterface(kind, final, type_name, endpoints, (), Attribution.LIST)

    def _questions(self) -> Mapping[EndpointKind, Any]:
        from rclpy.action import graph

        node = self._node
        return {
            EndpointKind.PUBLISHER: node.get_publisher_names_and_types_by_node,
            EndpointKind.SUBSCRIPTION: node.get_subscriber_names_and_types_by_node,
            EndpointKind.SERVICE_SERVER: node.get_service_names_and_types_by_node,
            EndpointKind.SERVICE_CLIENT: node.get_client_names_and_types_by_node,
            EndpointKind.ACTION_SERVER: lambda *of: graph.get_action_server_names_and_types_by_node(
                node, *of
            ),
            EndpointKind.ACTION_CLIENT: lambda *of: graph.get_action_client_names_and_types_by_node(
                node, *of
            ),
        }

    def _endpoints(self, kind: EndpointKind, final: str, fqn: str) -> Iterator[SeenEndpoint]:
        writes = kind is EndpointKind.PUBLISHER
        ask = (
            self._node.get_publishers_info_by_topic if writes else self._node.get_subscriptions_info_by_topic
        )
        for info in ask(final):
            if join(info.node_namespace, info.node_name) == fqn:
                guid = bytes(info.endpoint_gid)[:_GUID].hex()
                participant = f"{guid[:24]}000001c1"
                quality = _quality(info.qos_profile)
                yield SeenEndpoint(guid, participant, writes, f"rt{final}", info.topic_type, quality)


def _names_and_types(ask: Any, name: str, namespace: str) -> Iterable[tuple[str, list[str]]]:
    from rclpy.node import NodeNameNonExistentError

    try:
        return list(ask(name, namespace))
    except NodeNameNonExistentError:
        return []


def _quality(profile: Any) -> Quality:
    deadline, lease = profile.deadline.nanoseconds, profile.liveliness_lease_duration.nanoseconds
    history = profile.history.name
    return Quality(
        reliability=profile.reliability.name,
        durability=profile.durability.name,
        history=history if history in ("KEEP_LAST", "KEEP_ALL") else "",
        depth=profile.depth if history == "KEEP_LAST" else 0,
        deadline=INFINITE if deadline in _NO_DURATION else deadline,
        liveliness=profile.liveliness.name,
        lease=INFINITE if lease in _NO_DURATION else lease,
    )


def _united(before: GraphProcess, now: GraphProcess) -> GraphProcess:
    nodes = {(each.fqn, each.ordinal): each for each in before.nodes}
    for node in now.nodes:
        known = nodes.get((node.fqn, node.ordinal))
        fresh = {(i.kind, i.name, i.type) for i in node.interfaces}
        kept = tuple(i for i in known.interfaces if (i.kind, i.name, i.type) not in fresh) if known else ()
        nodes[node.fqn, node.ordinal] = node._replace(interfaces=tuple(sorted((*kept, *node.interfaces))))
    return now._replace(nodes=tuple(nodes[key] for key in sorted(nodes)))
