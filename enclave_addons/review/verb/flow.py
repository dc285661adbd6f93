"""Show which enclave can influence which, over any number of hops.

  secure-plan flow --from /camera --to /base PACKAGE LAUNCH_FILE     the shortest paths, or that there is none
  secure-plan flow --from /camera --to /cmd_vel PACKAGE LAUNCH_FILE  to whoever receives a topic, service or action
  secure-plan flow PACKAGE LAUNCH_FILE                               what each enclave reaches

An enclave counts as passing on all that it receives. What every node has (parameter services, /rosout ...) counts only
with --built-in.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Collection

from enclave_addons.review.document import PlanDocument, plan_from_document
from enclave_addons.review.information_flow import FlowGraph, flow_graph, shortest_paths
from enclave_addons.review.review_text import paths_text, reach_text
from enclave_addons.review.verb.plans import read_plan
from enclave_common.command_line import FLAG
from enclave_launch.dry_run import Operation
from enclave_launch.errors import UsageError

SENDING: Collection[Operation] = (
    "publish",
    "call_services",
    "call_actions",
    "serve_services",
    "serve_actions",
)
RECEIVING: Collection[Operation] = (
    "subscribe",
    "serve_services",
    "serve_actions",
    "call_services",
    "call_actions",
)
"""Requests and answers flow both ways, so both ends of a service or action send and receive."""

OPTIONS = {
    "": (
        (
            "--from ENCLAVE|NODE|NAME",
            {"dest": "influence_from"},
            "source: an enclave, a node, or whoever sends on a topic, service or action",
        ),
        (
            "--to ENCLAVE|NODE|NAME",
            {"dest": "influence_to"},
            "target: an enclave, a node, or whoever receives from one",
        ),
        ("--built-in", FLAG, "count what every node has, too"),
    )
}


def run(options: argparse.Namespace) -> int:
    """Print who can influence whom. Returns 0."""
    if (options.influence_from is None) is not (options.influence_to is None):
        raise UsageError("flow: give both --from and --to, or neither")
    plan = plan_from_document(read_plan(options.words, options))
    graph = flow_graph(plan, built_in=options.built_in)
    if options.influence_from is None:
        sys.stdout.write(reach_text(plan, graph))
        return 0
    sources = _enclaves(plan, options.influence_from, SENDING)
    targets = _enclaves(plan, options.influence_to, RECEIVING)
    for source in sources:
        for target in targets:
            sys.stdout.write(_paths(graph, source, target))
    return 0


def _paths(graph: FlowGraph, source: str, target: str) -> str:
    if source == target:
        return f"both ends are in enclave {source}: nothing separates them\n"
    return paths_text(source, target, shortest_paths(graph, source, target))


def _enclaves(plan: PlanDocument, end: str, operations: Collection[Operation]) -> list[str]:
    homes = {**{node.fqn: node.enclave for node in plan.nodes}, **{path: path for path in plan.enclaves}}
    if end in homes:
        return [homes[end]]
    users = [node for node in plan.nodes if any(grant.name == end for grant in node.grants)]
    found = {
        node.enclave
        for node in users
        for grant in node.grants
        if grant.name == end and grant.operation in operations
    }
    if found:
        return sorted(found)
    if users:
        what = "sends on it" if operations is SENDING else "receives from it"
        raise UsageError(f"flow: {end} is a name of this plan, but no node {what}")
    known = " ".join(sorted(homes))
    raise UsageError(f"flow: {end} is no enclave, node or name of this plan; its enclaves and nodes: {known}")
