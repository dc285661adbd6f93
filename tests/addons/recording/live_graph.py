"""Prints the graph of a domain as rclpy sees it, node by node, once it has stopped changing. Run by rclpy's python."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import rclpy
from rclpy.action import graph as action_graph

ME = "live_graph"


def look(node: Any) -> dict[str, dict[str, list[list[str]]]]:
    actions = {
        "serve_actions": action_graph.get_action_server_names_and_types_by_node,
        "call_actions": action_graph.get_action_client_names_and_types_by_node,
    }
    others = {
        "publish": node.get_publisher_names_and_types_by_node,
        "subscribe": node.get_subscriber_names_and_types_by_node,
        "serve_services": node.get_service_names_and_types_by_node,
        "call_services": node.get_client_names_and_types_by_node,
    }
    graph: dict[str, dict[str, list[list[str]]]] = {}
    for name, namespace in node.get_node_names_and_namespaces():
        if name == ME:
            continue
        found = {kind: ask(name, namespace) for kind, ask in others.items()}
        found |= {kind: ask(node, name, namespace) for kind, ask in actions.items()}
        graph[f"{namespace.rstrip('/')}/{name}"] = {
            kind: sorted([each, *types] for each, types in rows if "/_action/" not in each)
            for kind, rows in found.items()
        }
    return graph


def main(expected: int) -> None:
    rclpy.init()
    node = rclpy.create_node(ME)
    before, steady = None, 0
    deadline = time.monotonic() + 120  # twelve programs start at once, on a machine that does much else
    while steady < 10 and time.monotonic() < deadline:
        time.sleep(0.5)
        now = look(node)
        steady = steady + 1 if now == before and len(now) >= expected else 0
        before = now
    print(json.dumps(before))
    rclpy.shutdown()


if __name__ == "__main__":
    main(int(sys.argv[1]))
