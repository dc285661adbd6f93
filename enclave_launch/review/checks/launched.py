"""What a launch file gives to its processes and components: rules, parameters, variables. Performs no I/O."""

from __future__ import annotations

import re
from collections.abc import Iterator

from enclave_launch.dry_run import Component, DryRun, Process
from enclave_launch.review.checks.rules import finding
from enclave_launch.review.document import PlanDocument, PlanFinding, fqn_of, program_of

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


def remaps(plan: PlanDocument, document: DryRun) -> Iterator[PlanFinding]:
    """Yield remap rules that change no name.

    A rule is used if any node that gets it has a name that it changes. It may be used by a program that is not
    wholly known."""
    used, unknown = _used_rules(document), _not_wholly_known(document)
    dead: dict[tuple[str, str], Item] = {}
    alive: set[tuple[str, str]] = set()
    for item in document.launched:
        for source, target in item.remaps:
            rule = (source, target)
            if source in _BY_CONVENTION:
                continue
            if f"{source}:={target}" in used.get(_key(item), ()) or _key(item) in unknown or source == target:
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


def parameters(plan: PlanDocument, document: DryRun) -> Iterator[PlanFinding]:
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


def security_variables(plan: PlanDocument, document: DryRun) -> Iterator[PlanFinding]:
    """Yield ``ROS_SECURITY_*`` variables that the launch file sets itself."""
    for process in document.processes:
        for name, value in sorted(process.environment.items()):
            if name.startswith("ROS_SECURITY_"):
                yield _about(process, "security-variable-set", f"the launch file sets {name}={value}")


def secrets(plan: PlanDocument, document: DryRun) -> Iterator[PlanFinding]:
    """Find parameters with a text value whose name says that it is a secret; the value is not repeated."""
    for item in document.launched:
        for name, value in sorted(item.parameters.items()):
            if _SECRET.search(_CAMEL.sub("_", name)) and isinstance(value, str) and value:
                yield _about(item, "secret-in-parameters", f"parameter {name} holds what looks like a secret")


def _key(item: Item) -> tuple[str, str | None]:
    return program_of(item), item.enclave


def _subject(item: Item) -> str:
    return fqn_of(item) or (item.executable if isinstance(item, Process) else "")


def _about(item: Item, code: str, text: str) -> PlanFinding:
    return finding(code, _subject(item), text, (item.launch_file, item.line))


CHECKS = (remaps, parameters, security_variables, secrets)
