"""Judge a plan for ``check``: each finding with the reason why the repository accepts it, if it does."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Sequence
from datetime import datetime
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

from enclave_addons.review.checks import MEANINGS, check_plan
from enclave_addons.review.checks.keystore import against_keystore, against_router
from enclave_addons.review.checks.rules import finding
from enclave_addons.review.document import PlanDocument, plan_from_document
from enclave_addons.review.information_flow import FlowGraph, FlowStep, Hop, flow_graph, shortest_paths
from enclave_addons.review.verb.keystores import (
    DEFAULT_MARGIN,
    endings,
    on_zenoh,
    signed_grants,
    zenoh_findings,
)
from enclave_common.command_line import PATH, Option
from enclave_common.files import text_or_nothing
from enclave_common.project import Project
from enclave_common.project_file import ReviewRules, read_review_rules
from enclave_common.strict_yaml import YamlFileError, line_at
from enclave_common.words import did_you_mean
from enclave_launch.dry_run import Diagnostic, DryRun
from enclave_launch.errors import UsageError, translated
from keystore.formats.permissions_patterns import can_meet

EXPECTATIONS = "enclaves.review.yaml"
EXPECT: Option = (
    "--expect FILE",
    PATH,
    f"rules beside those of enclaves.yaml (default: {EXPECTATIONS}, if it exists)",
)
WITHIN: Option = ("--expiring-within (--within) TIME", {"default": DEFAULT_MARGIN}, "what expires soon (30d)")


def judged(
    document: DryRun,
    expect: Path | None,
    keystore: Path | str | None = None,
    within: str = DEFAULT_MARGIN,
    now: datetime | None = None,
    project: Project | None = None,
) -> list[tuple[Diagnostic, str | None]]:
    """Return findings of a dry run, of the rules in ``project`` and ``expect``, and of ``keystore``, if one is given.

    Raises ``UsageError`` for rules that are missing or not understood, ``ProvisionError`` for the keystore.
    """
    expected = expectations(expect, project)
    findings = [*check_plan(document), *rule_findings(document, expected.never)]
    if keystore is not None:
        findings += _of_keystore(document, keystore, within, now)
    return [(finding, expected.reason_to_accept(finding)) for finding in findings]


def _of_keystore(
    document: DryRun, keystore: Path | str, within: str, now: datetime | None
) -> list[Diagnostic]:
    plan = plan_from_document(document)
    found = against_keystore(plan, signed_grants(keystore), endings(keystore, within, now))
    if plan.on_zenoh:
        found += against_router(plan, on_zenoh(keystore), zenoh_findings(keystore, now))
    return found


def expectations(file: Path | None, project: Project | None = None) -> Expectations:
    """Read the rules of ``enclaves.yaml`` and of a file of their own.

    Args:
        file: The file that was named, by default ``enclaves.review.yaml`` in the working directory, if it exists.
        project: The ``enclaves.yaml`` in use.

    Raises:
        UsageError: The file does not exist or is not understood.
    """
    found = _read_rules(project.content, project.file) if project is not None else Expectations()
    if file is None and not os.path.exists(EXPECTATIONS):
        return found
    file = file or Path(EXPECTATIONS)
    with translated(YamlFileError, UsageError):
        own = _read_rules(read_review_rules(file), file)
    return Expectations((*found.never, *own.never), (*found.accept, *own.accept))


def _read_rules(rules: ReviewRules, file: Path) -> Expectations:
    text = text_or_nothing(file)
    return Expectations(
        tuple(
            Never(rule.source, rule.target, rule.why, (str(file), line_at(text, ("never", at))))
            for at, rule in enumerate(rules.never or ())
        ),
        tuple(
            Accepted(
                _known_code(rule.code, f"{file}:{line_at(text, ('accept', at))}"), rule.subject, rule.why
            )
            for at, rule in enumerate(rules.accept or ())
        ),
    )


_TAKES = ("subscribe", "serve_services", "serve_actions")
_SENDS = ("publish", "call_services", "call_actions")


class Never(NamedTuple):
    """No influence from ``source`` to ``target``, over any number of enclaves; ``place``: file and line of the rule."""

    source: str
    target: str
    why: str
    place: tuple[str, int]


class Accepted(NamedTuple):
    """Findings with this code about a subject that matches (shell wildcards), and why they are accepted."""

    code: str
    subject: str
    why: str

    def covers(self, diagnostic: Diagnostic) -> bool:
        return diagnostic.code == self.code and fnmatchcase(diagnostic.subject, self.subject)


class Expectations(NamedTuple):
    """All that an ``enclaves.review.yaml`` says; empty without one."""

    never: tuple[Never, ...] = ()
    accept: tuple[Accepted, ...] = ()

    def reason_to_accept(self, diagnostic: Diagnostic) -> str | None:
        """Return why a finding was accepted, None if it was not."""
        return next((accepted.why for accepted in self.accept if accepted.covers(diagnostic)), None)


def _known_code(code: str, place: str) -> str:
    if code not in MEANINGS:
        raise UsageError(
            f"{place}: accept: there is no finding with the code {code!r}{did_you_mean(code, MEANINGS)}"
        )
    return code


def rule_findings(document: DryRun, rules: Iterable[Never]) -> list[Diagnostic]:
    """Return an error for each forbidden flow, with one shortest way, then a warning for each rule that names nothing
    in this plan."""
    plan = plan_from_document(document)
    graph = flow_graph(plan)
    broken, idle = [], []
    for rule in rules:
        sources = _enclaves_named(plan, rule.source)
        named = _enclaves_named(plan, rule.target)
        targets = named or list(_with_grant(plan, _TAKES, rule.target))
        # The receiver of a name may be in another launch.
        senders = {} if named else _with_grant(plan, _SENDS, rule.target)
        if not sources or not (targets or senders):
            text = f"no {rule.source} or no {rule.target} in this plan"
            idle.append(finding("rule-idle", rule.source, text, rule.place))
            continue
        received, sent = _ways(graph, sources, targets), _ways(graph, sources, senders)
        if possible := received or sent:
            source, target, steps = min(possible, key=lambda way: (len(way[2]), way))
            text = _broken_text(rule, source, steps, None if received else senders[target])
            broken.append(finding("flow-forbidden", source, text, rule.place, fails=True))
    return [*broken, *idle]


def _broken_text(rule: Never, source: str, steps: Sequence[FlowStep], sent: Hop | None) -> str:
    ways = [f"{step.source} -> {step.target} by {step.hops[0]}" for step in steps]
    if sent is not None:
        ways.append(f"{steps[-1].target if steps else source} may send on {sent}, whoever receives it")
    how = "; ".join(ways) or f"both are in enclave {source}"
    return f"{rule.source} must never reach {rule.target}{f' ({rule.why})' if rule.why else ''}: {how}"


def _ways(
    graph: FlowGraph, sources: Iterable[str], targets: Collection[str]
) -> list[tuple[str, str, tuple[FlowStep, ...]]]:
    """Return a shortest way from each source to each target that it reaches; without steps to itself."""
    pairs = [(source, target) for source in sources for target in targets]
    paths = [(pair, [()] if pair[0] == pair[1] else shortest_paths(graph, *pair)) for pair in pairs]
    return [(*pair, found[0]) for pair, found in paths if found]


def _enclaves_named(plan: PlanDocument, pattern: str) -> list[str]:
    of_nodes = {node.enclave for node in plan.nodes if fnmatchcase(node.fqn, pattern)}
    return sorted(of_nodes | {path for path in plan.enclaves if fnmatchcase(path, pattern)})


def _with_grant(plan: PlanDocument, operations: Collection[str], pattern: str) -> dict[str, Hop]:
    """Return the enclaves that have one of these operations on a matching name, each with the first such grant.

    What every node has does not count.
    """
    granted = {
        path: sorted(
            each
            for each in grants - plan.built_in(path)
            if each.operation in operations and can_meet(each.name, pattern)
        )
        for path, grants in sorted(plan.enclaves.items())
    }
    return {path: Hop(*each[0]) for path, each in granted.items() if each}
