"""Prints what each node of the domain has, as JSON, once that has stayed the same for a second. Runs with real rclpy.

python observer.py NODE...      the nodes to wait for, by full name
"""

import json
import sys
import time
from typing import Any

import rclpy
from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)

LISTS = {
    "publish": lambda node, *of: node.get_publisher_names_and_types_by_node(*of),
    "subscribe": lambda node, *of: node.get_subscriber_names_and_types_by_node(*of),
    "serve_services": lambda node, *of: node.get_service_names_and_types_by_node(*of),
    "call_services": lambda node, *of: node.get_client_names_and_types_by_node(*of),
    "serve_actions": get_action_server_names_and_types_by_node,
    "call_actions": get_action_client_names_and_types_by_node,
}


def look(observer: Any, wanted: set[str]) -> dict[str, Any]:
    seen: dict[str, Any] = {}
    for name, namespace in observer.get_node_names_and_namespaces():
        fqn = f"{namespace.rstrip('/')}/{name}"
        if fqn in wanted:
            try:
                lists = {
                    list_name: sorted(ask(observer, name, namespace)) for list_name, ask in LISTS.items()
                }
            except rclpy.node.NodeNameNonExistentError:
                continue
            seen[fqn] = {name: [[topic, types] for topic, types in found] for name, found in lists.items()}
    return seen


def main() -> None:
    rclpy.init()
    observer = rclpy.create_node("observer_of_the_test")
    before: dict[str, Any] | None = None
    since = time.monotonic()
    deadline = since + 100
    while time.monotonic() < deadline:
        seen = look(observer, set(sys.argv[1:]))
        if seen != before or len(seen) < len(sys.argv) - 1:
            before, since = seen, time.monotonic()
        elif time.monotonic() - since > 3.0:
            break
        time.sleep(0.1)
    print(json.dumps(before))


main()
