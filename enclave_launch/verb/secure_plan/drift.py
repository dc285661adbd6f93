"""Hold a running system against the plan: what runs and is not planned, what is planned and does not run.

Looks at the DDS domain, with Cyclone DDS's Python binding or rclpy. A secured system needs --keystore and --enclave
(secure-keystore tool-enclave KEYSTORE --for observe makes one). docs/running-systems.md says what is told.

exit status: 0 as planned, 1 alarms, 2 wrong usage, 3 the domain cannot be observed
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from enclave_launch.admission.variables import domain_of
from enclave_launch.boundary.command_line import PATH, PATHS, TEXT, TEXTS, one_of
from enclave_launch.boundary.terminal import json_text, message
from enclave_launch.errors import EnclaveLaunchError, UsageError, translated
from enclave_launch.verb.secure_plan.plans import FORM, read_plan, read_saved
from keystore.errors import KeystoreError

if TYPE_CHECKING:
    from enclave_launch.drift.compare import Security
    from enclave_launch.drift.expected import Expected
    from enclave_launch.drift.finding import DriftFinding
    from nodl.graph.model import Graph
    from nodl.graph.observing import Observer, Where

_BETWEEN = 0.5  # seconds between two comparisons while something may still come


class CannotObserve(EnclaveLaunchError):
    """The domain cannot be joined, or nothing to observe with is installed."""

    exit_status = 3


OPTIONS = {
    "what to look at": (
        ("--domain-id N", {"type": int}, "default: the domain that the plan is for"),
        ("--keystore DIR", PATH, "of a secured system"),
        ("--enclave NAME", TEXT, "the observer's own"),
        ("--for SECONDS", {"type": float, "dest": "longest", "default": 30.0},
         "how long what is planned may take to appear (30)"),
        ("--settle SECONDS", {"type": float, "default": 5.0}, "compare when nothing changed so long (5)"),
        ("--with", {**one_of("auto", "cyclonedds", "rclpy"), "dest": "observer"}, ""),
        ("--graph RUN.json", PATH, "what secure-nodl observe --save kept, in place of looking"),
    ),
    "": (
        ("--accept NODE", TEXTS, "may run beside the plan; wildcards (repeatable)"),
        ("--also-planned PLAN.json", PATHS, "another launch in this domain (repeatable)"),
        FORM,
    ),
}  # fmt: skip


def run(options: argparse.Namespace) -> int:
    """Print how the domain differs from the plan. Returns 1 for an alarm."""
    from enclave_launch.drift.compare import Circumstances, compare
    from enclave_launch.drift.expected import expected_in, out_of_sight
    from enclave_launch.drift.finding import Level, drift_document, drift_text

    documents = [read_plan(options.words, options), *map(read_saved, options.also_planned)]
    if zenoh := out_of_sight(documents):
        raise UsageError(f"drift: only DDS is observed, and {', '.join(zenoh)} of the plan on Zenoh")
    domain = _domain(options, documents[0])
    security = _security(options)
    expected: Expected = expected_in(documents, domain)

    def findings(graph: Graph, forged: tuple[str, ...] = ()) -> list[DriftFinding]:
        circumstances = Circumstances(security, tuple(options.accept), forged=forged)
        return compare(expected, graph, circumstances)

    graph, found = _looked(options, domain, findings)
    if options.format == "json":
        sys.stdout.write(json_text(drift_document(found, graph), indent=2) + "\n")
    else:
        sys.stdout.write(message(drift_text(found, graph)).replace("\n    ", "\n"))
    return 1 if any(each.level is Level.ALARM for each in found) else 0


Findings = Callable[..., "list[DriftFinding]"]


def _looked(options: argparse.Namespace, domain: int, findings: Findings) -> tuple[Graph, list[DriftFinding]]:
    """Raises ``CannotObserve``."""
    from nodl.errors import NoDLError
    from nodl.graph.observing import Where, observer

    try:
        if options.graph is not None:
            from nodl.graph.observation import read_observed

            graph = read_observed(options.graph).graph
            return graph, findings(graph)
        where = Where(domain, options.observer, _enclave_directory(options))
        with observer(where, os.environ) as up:
            return _settled(options, where, up, findings)
    except (NoDLError, OSError) as error:
        raise CannotObserve(str(error)) from error


def _settled(
    options: argparse.Namespace, where: Where, up: Observer, findings: Findings
) -> tuple[Graph, list[DriftFinding]]:
    """Once nothing changes any more and nothing is missing; what is missing has until the end of ``--for``."""
    from enclave_launch.drift.finding import FindingCertainty, Level
    from nodl.graph.observing import Quiet, look_until

    end = time.monotonic() + options.longest
    while True:
        look_until(up, Quiet(up, options.settle, max(options.longest, options.settle)))
        graph = up.graph()
        found = findings(graph, up.forged)
        waits = any(
            each.certainty is not FindingCertainty.FACT and each.level is Level.ALARM for each in found
        )
        if not waits or time.monotonic() >= end:
            return graph, found
        time.sleep(_BETWEEN)


def _domain(options: argparse.Namespace, document: Any) -> int:
    if options.domain_id is not None:
        return int(options.domain_id)
    domains = sorted({each["domain_id"] for each in document["processes"]})
    if len(domains) > 1:
        listed = ", ".join(map(str, domains))
        raise UsageError(
            f"drift: the plan has processes in the domains {listed}: say with --domain-id which to look at"
        )
    return domains[0] if domains else domain_of(os.environ)


def _security(options: argparse.Namespace) -> Security | None:
    from enclave_launch.drift.compare import Security

    if options.keystore is None:
        if options.enclave is not None:
            raise UsageError("drift: --enclave needs --keystore, the keystore that it is in")
        return None
    from keystore.steps.tool_enclaves import enclaves_by_guid

    with translated(KeystoreError, UsageError, f"--keystore {options.keystore}: "):
        return Security(enclaves_by_guid(options.keystore), authenticated=options.enclave is not None)


def _enclave_directory(options: argparse.Namespace) -> Path | None:
    if options.enclave is None:
        return None
    return Path(options.keystore).absolute() / "enclaves" / str(options.enclave).lstrip("/")
