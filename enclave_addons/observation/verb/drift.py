"""Compare a running system with the plan: what runs unplanned, and what is planned and does not run.

Observes the DDS domain with Cyclone DDS's Python binding or rclpy. A secured system needs --keystore and --enclave
(secure-keystore tool-enclave KEYSTORE --for observe makes one). docs/running-systems.md lists the findings.

exit status: 0 as planned, 1 alarms, 2 wrong usage, 3 the domain cannot be observed, 4 cannot tell: nothing that is
planned is visible to the observer
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from enclave_addons.observation.drift.compare import Circumstances, Security, compare
from enclave_addons.observation.drift.expected import Expected, expected_in, out_of_sight
from enclave_addons.observation.drift.finding import (
    DriftFinding,
    FindingCertainty,
    Level,
    drift_document,
    drift_text,
)
from enclave_addons.observation.graph.cyclone import RANGE_VARIABLES
from enclave_addons.observation.graph.model import Graph
from enclave_addons.observation.graph.observation import read_observed
from enclave_addons.observation.graph.observing import (
    Observer,
    Quiet,
    Where,
    in_own_process,
    observe_until,
    observer,
)
from enclave_addons.review.verb.plans import FORM, read_plan, read_saved
from enclave_common.command_line import PATH, PATHS, TEXT, TEXTS, TIME, FromProject, one_of
from enclave_common.environment import environment_with
from enclave_common.terminal import json_text, message
from enclave_launch.admission.variables import domain_of
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import EnclaveLaunchError, UsageError, translated
from keystore.errors import KeystoreError
from keystore.steps.tool_enclaves import enclaves_by_guid
from nodl.errors import NoDLError

CANNOT_TELL = 4
"""Exit status."""
_BETWEEN = 0.5  # seconds between two comparisons while something may still come


class CannotObserve(EnclaveLaunchError):
    """The domain cannot be joined, or nothing to observe with is installed."""

    exit_status = 3


OPTIONS = {
    "what to observe": (
        ("--domain-id N", {"type": int}, "default: the domain that the plan is for"),
        ("--keystore DIR", {**PATH, "configured": FromProject("keystore", beside="enclave")}, "of a secured system"),
        ("--enclave NAME", TEXT, "the observer's own"),
        ("--for TIME", {**TIME, "dest": "longest", "default": 30.0}, "how long to wait for planned nodes (30s)"),
        ("--settle TIME", {**TIME, "default": 5.0}, "compare when nothing changed for this time (5s)"),
        ("--with", {**one_of("auto", "cyclonedds", "rclpy"), "dest": "observer"}, "what to observe with (auto)"),
        ("--graph RUN.json", PATH, "a file of secure-nodl observe --save, instead of observing"),
    ),
    "": (
        ("--accept NODE", TEXTS, "may run beside the plan; wildcards (repeatable)"),
        ("--also-planned PLAN.json", PATHS, "another launch in this domain (repeatable)"),
        FORM,
    ),
}  # fmt: skip


def run(options: argparse.Namespace) -> int:
    """Print how the domain differs from the plan. Returns 1 for an alarm, 4 if the observer does not see enough."""
    plans = [read_plan(options.words, options), *map(read_saved, options.also_planned)]
    if zenoh := out_of_sight(plans):
        raise UsageError(f"drift: only DDS is observed, and {', '.join(zenoh)} of the plan on Zenoh")
    domain = _domain(options, plans[0])
    security = _security(options)
    expected: Expected = expected_in(plans, domain)

    def findings(graph: Graph, forged: tuple[str, ...] = ()) -> list[DriftFinding]:
        circumstances = Circumstances(security, tuple(options.accept), forged=forged)
        return compare(expected, graph, circumstances, _enclaves_now(options))

    graph, found = _read_or_observed(options, domain, findings)
    if options.format == "json":
        sys.stdout.write(json_text(drift_document(found, graph), indent=2) + "\n")
    else:
        sys.stdout.write(message(drift_text(found, graph)).replace("\n    ", "\n"))
    levels = {each.level for each in found}
    if Level.ALARM in levels:
        return 1
    return CANNOT_TELL if Level.CANNOT_TELL in levels else 0


Findings = Callable[..., "list[DriftFinding]"]


def _read_or_observed(
    options: argparse.Namespace, domain: int, findings: Findings
) -> tuple[Graph, list[DriftFinding]]:
    try:
        if options.graph is not None:
            graph = read_observed(options.graph).graph
            return graph, findings(graph)
        where = Where(domain, options.observer, _enclave_directory(options))
        return in_own_process(lambda: _observed(options, where, findings))
    except (NoDLError, OSError) as error:
        raise CannotObserve(str(error)) from error


def _observed(
    options: argparse.Namespace, where: Where, findings: Findings
) -> tuple[Graph, list[DriftFinding]]:
    """Observe where the environment says; if the plan is out of sight there, once more on the loopback interface."""
    with observer(where, os.environ) as up:
        graph, found = _settled(options, up, findings)
    if _in_sight(found) or any(os.environ.get(name) for name in RANGE_VARIABLES):
        return graph, found
    local = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    with environment_with(local), observer(where, os.environ) as up:
        graph_there, found_there = _settled(options, up, findings)
    if not _in_sight(found_there):
        return graph, found
    print(
        "secure-plan drift: observed on the loopback interface, where the planned nodes communicate",
        file=sys.stderr,
    )
    return graph_there, found_there


def _in_sight(found: Sequence[DriftFinding]) -> bool:
    return all(each.level is not Level.CANNOT_TELL for each in found)


def _settled(
    options: argparse.Namespace, up: Observer, findings: Findings
) -> tuple[Graph, list[DriftFinding]]:
    """Wait until nothing changes any more and nothing is missing; what is missing has until the end of ``--for``."""
    end = time.monotonic() + options.longest
    while True:
        observe_until(up, Quiet(up, options.settle, max(options.longest, options.settle)))
        graph = up.graph()
        found = findings(graph, up.forged)
        waits = any(
            each.certainty is not FindingCertainty.FACT and each.level is not Level.NOTE for each in found
        )
        if not waits or time.monotonic() >= end:
            return graph, found
        time.sleep(_BETWEEN)


def _domain(options: argparse.Namespace, plan: DryRun) -> int:
    if options.domain_id is not None:
        return int(options.domain_id)
    domains = sorted({each.domain_id for each in plan.processes})
    if len(domains) > 1:
        listed = ", ".join(map(str, domains))
        raise UsageError(
            f"drift: the plan has processes in the domains {listed}: choose one with --domain-id"
        )
    return domains[0] if domains else domain_of(os.environ)


def _security(options: argparse.Namespace) -> Security | None:
    if options.keystore is None:
        if options.enclave is not None:
            raise UsageError("drift: --enclave needs --keystore, the keystore that it is in")
        return None

    with translated(KeystoreError, UsageError, f"--keystore {options.keystore}: "):
        return Security(enclaves_by_guid(options.keystore), authenticated=options.enclave is not None)


def _enclaves_now(options: argparse.Namespace) -> Callable[[], Mapping[int, str]] | None:
    if options.keystore is None:
        return None

    def read() -> Mapping[int, str]:
        with translated(KeystoreError, UsageError, f"--keystore {options.keystore}: "):
            return enclaves_by_guid(options.keystore)

    return read


def _enclave_directory(options: argparse.Namespace) -> Path | None:
    if options.enclave is None:
        return None
    return Path(options.keystore).absolute() / "enclaves" / str(options.enclave).lstrip("/")
