"""What enclaves hold: more than their nodes ask for, and more than one node should. Performs no I/O."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from enclave_common.words import some_of
from enclave_launch.dry_run import DryRun
from enclave_launch.review.checks.rules import finding
from enclave_launch.review.document import GrantedName, PlanDocument, PlanFinding
from enclave_launch.review.similarity import splits
from keystore.formats.permissions_patterns import has_wildcard

_NAMED = 3  # permissions that a node gains, by name; the rest is counted


def names_twice(plan: PlanDocument, document: DryRun) -> Iterator[PlanFinding]:
    """Yield nodes with the same fully qualified name, which ROS cannot distinguish."""
    for name, count in sorted(Counter(node.fqn for node in plan.nodes).items()):
        if count > 1:
            yield finding("node-name-twice", name, f"{count} nodes are called {name}")


def wildcards(plan: PlanDocument, document: DryRun) -> Iterator[PlanFinding]:
    """Yield permissions whose name is a pattern, except those that planning reported already, and those of names that
    a program makes up at each start, which nobody could list."""
    explained = " ".join(each.text for each in plan.diagnostics if each.code == "pattern-accepted")
    for enclave, grants in sorted(plan.enclaves.items()):
        for grant in sorted(grants - plan.built_in(enclave)):
            if has_wildcard(grant.name) and f" {grant.name}:" not in explained:
                yield finding("wildcard", grant.name, f"enclave {enclave} may {grant}")


def shared(plan: PlanDocument, document: DryRun) -> Iterator[PlanFinding]:
    """Find enclaves in which nodes gain permissions of others."""
    for split in splits(plan):
        gains = "; ".join(f"{node} gains {some_of(grants, _NAMED)}" for node, grants in split.saved)
        nodes = len(plan.units_of(split.enclave))
        yield finding(
            "enclave-shared", split.enclave, f"{nodes} nodes share enclave {split.enclave}: {gains}"
        )


def unasked(plan: PlanDocument, document: DryRun) -> Iterator[PlanFinding]:
    """Yield permissions that no node of an enclave requests.

    Only of enclaves whose every program is known: a policy file may list what nothing else describes."""
    for enclave, grants in sorted(plan.enclaves.items()):
        nodes = plan.nodes_of(enclave)
        if not nodes or document.enclaves[enclave].permissions_unknown:
            continue
        for grant in sorted(grants - frozenset[GrantedName]().union(*(node.grants for node in nodes))):
            text = f"enclave {enclave} may {grant}, and none of its nodes requests that"
            yield finding("permission-unasked", enclave, text)


CHECKS = (names_twice, wildcards, shared, unasked)
