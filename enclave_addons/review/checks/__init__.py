"""Checks of a plan beyond what planning itself reports; each is one function from a plan to findings.

rules.py       what each code means, and what to do about it
meetings.py    names, types and QoS of which two ends should meet and do not
keystore.py    a plan held against what a keystore has signed

Here: what an enclave holds (wildcards, sharing, permissions that nobody asks for, one name for two nodes), and what the
launch file gives to its processes (remap rules, parameters, secrets, security variables).

A finding has a stable code, a place where there is one, and what to do next.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

from enclave_addons.review.checks import meetings
from enclave_addons.review.checks.rules import MEANINGS, RULES, finding
from enclave_addons.review.document import GrantedName, PlanDocument, fqn_of, plan_from_document, program_of
from enclave_addons.review.similarity import splits
from enclave_common.words import some_of
from enclave_launch.dry_run import Component, Diagnostic, DryRun, Process
from keystore.formats.permissions_patterns import has_wildcard

__all__ = ["MEANINGS", "RULES", "check_plan"]


def check_plan(document: DryRun) -> list[Diagnostic]:
    """Return all findings of a dry run: those of planning first, then those of each check, sorted."""
    plan = plan_from_document(document)
    own = (
        diagnostic
        for check in (*meetings.CHECKS, *_OF_ENCLAVES, *_OF_PROCESSES)
        for diagnostic in check(plan, document)
    )
    return [
        *plan.diagnostics,
        *sorted(own, key=lambda each: (each.code, each.subject, each.file or "", each.line)),
    ]


_NAMED = 3  # permissions that a node gains, by name; the rest is counted


def names_twice(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Yield nodes with the same fully qualified name, which ROS cannot distinguish."""
    for name, count in sorted(Counter(node.fqn for node in plan.nodes).items()):
        if count > 1:
            yield finding("node-name-twice", name, f"{count} nodes are called {name}")


def wildcards(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Yield permissions whose name is a pattern.

    Left out are those that planning reported already, and those of names that a program makes up at each start.
    """
    explained = " ".join(each.text for each in plan.diagnostics if each.code == "pattern-accepted")
    for enclave, grants in sorted(plan.enclaves.items()):
        for grant in sorted(grants - plan.built_in(enclave)):
            if has_wildcard(grant.name) and f" {grant.name}:" not in explained:
                yield finding("wildcard", grant.name, f"enclave {enclave} may {grant}")


def shared(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Find enclaves in which nodes gain permissions of others."""
    for split in splits(plan):
        gains = "; ".join(f"{node} gains {some_of(grants, _NAMED)}" for node, grants in split.saved)
        nodes = len(plan.units_of(split.enclave))
        yield finding(
            "enclave-shared", split.enclave, f"{nodes} nodes share enclave {split.enclave}: {gains}"
        )


def unasked(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Yield permissions that no node of an enclave requests.

    Only of enclaves whose every program is known: a policy file may list what nothing else describes."""
    for enclave, grants in sorted(plan.enclaves.items()):
        nodes = plan.nodes_of(enclave)
        if not nodes or document.enclaves[enclave].permissions_unknown:
            continue
        for grant in sorted(grants - frozenset[GrantedName]().union(*(node.grants for node in nodes))):
            text = f"enclave {enclave} may {grant}, and none of its nodes requests that"
            yield finding("permission-unasked", enclave, text)


_OF_ENCLAVES = (names_twice, wildcards, shared, unasked)

Item = Process | Component

_SECRET = re.compile(
    r"(^|[._-])(pass(word|wd|phrase)?|pwd|secrets?|(access|auth|bearer|api|refresh)?[._-]?token|credentials?"
    r"|(api|access|private|secret)[._-]?key)$",
    re.IGNORECASE,
)
_BY_CONVENTION = ("/tf", "/tf_static")
"""Names that launch files remap for every node of a namespace, whether it has a transform listener or not."""
_CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")
_OF_EVERY_NODE = re.compile(
    r"use_sim_time$|start_type_description_service$|qos_overrides\.|.*/qos_overrides\."
)
"""Parameters that client libraries declare themselves (rclcpp TimeSource, node_type_descriptions, qos_overriding)."""


def remaps(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Yield remap rules that change no name.

    A rule is used if any node that gets it has a name that it changes. It may be used by a program that is not
    wholly known. One that is written with and without a slash, so that either fits, is used if one of the two is."""
    used, unknown = _used_rules(document), _not_wholly_known(document)
    dead: dict[tuple[str, str], Item] = {}
    alive: set[tuple[str, str]] = set()
    for item in document.launched:
        for source, target in item.remaps:
            rule = (source, target)
            if source in _BY_CONVENTION:
                continue
            relative = source.lstrip("/")
            both = {f"{relative}:={target}", f"/{relative}:={target}"} & {f"{a}:={b}" for a, b in item.remaps}
            if both & used.get(_key(item), set()) or _key(item) in unknown or source == target:
                alive.add(rule)
            dead.setdefault(rule, item)
    for rule, item in sorted(dead.items(), key=lambda each: each[0]):
        if rule not in alive:
            text = f"the rule {rule[0]} -> {rule[1]} changes no name of {_subject(item)}"
            yield _about(item, "remap-dead", text)


def _used_rules(document: DryRun) -> dict[tuple[str, str | None], set[str]]:
    """Map program and enclave to the texts of rules that changed a name of a node of it."""
    found: dict[tuple[str, str | None], set[str]] = {}
    for node in document.nodes:
        texts = found.setdefault((node.program, node.enclave), set())
        for interface in node.interfaces:
            for text in interface.remapped_by:
                rule = text.partition(" at ")[0]
                texts.update((rule, rule.partition(":")[2] if rule.count(":") > 1 else rule))
    return found


def _not_wholly_known(document: DryRun) -> set[tuple[str, str | None]]:
    """Return programs of which nothing is known, and those of nodes with gaps."""
    described = {(node.program, node.enclave) for node in document.nodes}
    gaps = {
        diagnostic.subject for diagnostic in document.diagnostics if diagnostic.code == "interface-unknown"
    }
    doubtful = {(node.program, node.enclave) for node in document.nodes if node.fqn in gaps}
    return doubtful | {_key(item) for item in document.launched} - described


def parameters(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Yield parameters that no node of the program declares, if the description of each says what it declares."""
    declared: dict[tuple[str, str | None], list[list[str] | None]] = {}
    for node in document.nodes:
        declared.setdefault((node.program, node.enclave), []).append(node.parameters)
    for item in document.launched:
        known = declared.get(_key(item), [])
        if not known or any(names is None for names in known):
            continue
        names = {name for some in known for name in some or ()}
        for parameter in sorted(item.parameters):
            if parameter not in names and not _OF_EVERY_NODE.match(parameter):
                text = f"{_subject(item)} is given parameter {parameter}, which it does not declare"
                yield _about(item, "parameter-unknown", text)


def security_variables(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Yield variables that the launch file sets and ``--secure`` sets, too; those of the security log are its own."""
    for process in document.processes:
        for name, value in sorted(process.environment.items()):
            if name.startswith("ROS_SECURITY_") and not name.startswith("ROS_SECURITY_LOG_"):
                yield _about(process, "security-variable-set", f"the launch file sets {name}={value}")


def secrets(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Find parameters with a text value whose name says that it is a secret; the value is not repeated."""
    for item in document.launched:
        for name, value in sorted(item.parameters.items()):
            if _SECRET.search(_CAMEL.sub("_", name)) and isinstance(value, str) and value:
                yield _about(item, "secret-in-parameters", f"parameter {name} holds what looks like a secret")


def _key(item: Item) -> tuple[str, str | None]:
    return program_of(item), item.enclave


def _subject(item: Item) -> str:
    return fqn_of(item) or (item.executable if isinstance(item, Process) else "")


def _about(item: Item, code: str, text: str) -> Diagnostic:
    return finding(code, _subject(item), text, (item.launch_file, item.line))


_OF_PROCESSES = (remaps, parameters, security_variables, secrets)
