"""Show which enclave can influence which, over any number of hops.

  secure-plan flow --from /camera --to /base PACKAGE LAUNCH_FILE     the shortest ways, or that there is none
  secure-plan flow PACKAGE LAUNCH_FILE                               what each enclave reaches

An enclave counts as passing on all that it receives. What every node has (parameter services, /rosout ...) counts only
with --built-in.
"""

from __future__ import annotations

import argparse
import sys

from enclave_common.command_line import FLAG
from enclave_launch.errors import UsageError
from enclave_launch.report.review_text import paths_text, reach_text
from enclave_launch.review.document import plan_from_document
from enclave_launch.review.information_flow import flow_graph, shortest_paths
from enclave_launch.verb.secure_plan.plans import read_plan

OPTIONS = {
    "": (
        ("--from ENCLAVE|NODE", {"dest": "influence_from"}, "source: an enclave, node or name"),
        ("--to ENCLAVE|NODE", {"dest": "influence_to"}, "target: an enclave, node or name"),
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
    homes = {**{node.fqn: node.enclave for node in plan.nodes}, **{path: path for path in plan.enclaves}}
    for end in (options.influence_from, options.influence_to):
        if end not in homes:
            known = " ".join(sorted(homes))
            raise UsageError(f"flow: {end} is neither an enclave nor a node of this plan; it has: {known}")
    source, target = homes[options.influence_from], homes[options.influence_to]
    if source == target:
        ends = f"{options.influence_from} and {options.influence_to}"
        sys.stdout.write(f"{ends} are both in enclave {source}: nothing separates them\n")
        return 0
    sys.stdout.write(paths_text(source, target, shortest_paths(graph, source, target)))
    return 0
