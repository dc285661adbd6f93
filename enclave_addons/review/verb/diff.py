"""Compare two plans: enclaves, nodes, permissions and flows that were added and removed.

  secure-plan diff before.json PACKAGE LAUNCH_FILE [name:=value ...]
  secure-plan diff before.json after.json --format markdown
  secure-plan diff main: PACKAGE LAUNCH_FILE                 the same launch in a revision of its git repository
  secure-plan diff v1.0:launch/robot.launch.xml launch/robot.launch.xml
  secure-plan diff KEYSTORE PACKAGE LAUNCH_FILE              what a keystore has signed, and what the plan asks for
  secure-plan diff KEYSTORE OTHER_KEYSTORE                   what two keystores let each enclave do
  secure-plan diff --distro humble --against jazzy PACKAGE LAUNCH_FILE     what another release of ROS changes

With a revision, the packages of the repository are planned from their sources, in the revision and in the work tree;
with --build COMMAND the revision is built instead, and compared with what is installed. Other packages are taken as
they are installed now; the answer names them. name:=value is for both launch files.

--against compares one launch file with itself, under another distribution (jazzy), the versions of a day
(jazzy@2025-03), or those of a robot (a file as --versions takes it). It lists what every node has, too.

exit status: 0 no enclave may do more than before, 1 rights grew, 2 wrong usage
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from enclave_addons.review.changes import Changes, EnclaveChange, changes
from enclave_addons.review.document import PlanDocument, plan_from_document
from enclave_addons.review.signed import keystore_as_plan, plan_as_signed
from enclave_addons.review.verb import plans, revisions
from enclave_addons.review.verb.keystores import on_zenoh, refuse_edited_files, signed_grants
from enclave_addons.review.verb.plans import is_saved_plan, read_plan, read_saved
from enclave_common.command_line import TEXT, Option, one_of
from enclave_common.terminal import json_text, warn
from enclave_launch.diagnostics import Code
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import UsageError, translated
from enclave_launch.verb.options import distribution

WORDS: tuple[Option, ...] = (
    ("before BEFORE", TEXT, "PLAN.json | PATH | REVISION: | REVISION:PATH | KEYSTORE"),
    ("words", {**plans.WORDS, "nargs": "*"}, "what it is compared with"),
)
OPTIONS = {
    "": (
        ("--format", one_of("text", "json", "markdown"), "how to print (text)"),
        ("--build COMMAND", TEXT, "build the revision with it, in a copy; leaves install/"),
        (
            "--against NAME[@DATE]|FILE",
            TEXT,
            "another release of ROS, or the versions of a robot, for the same launch file",
        ),
    )
}


_HIDDEN = (Code.MANIFEST_LACKS, Code.MANIFEST_OUTDATED)


def run(options: argparse.Namespace) -> int:
    """Print the difference. Returns 1 when rights grew."""
    if options.against is not None:
        changed = _against(options)
    elif options.words:
        before, after, as_installed = _both(options)
        changed = changes(before, after)._replace(as_installed=as_installed)
    else:
        raise UsageError(
            "name what it is compared with: a launch file, a plan, a keystore, or --against a release"
        )
    if options.format == "json":
        sys.stdout.write(json_text(changes_document(changed), indent=2) + "\n")
    else:
        sys.stdout.write((changes_markdown if options.format == "markdown" else changes_text)(changed))
    return 1 if changed.rights_grew else 0


def _both(options: argparse.Namespace) -> tuple[PlanDocument, PlanDocument, tuple[str, ...]]:
    if len(options.words) == 1 and os.path.isdir(options.before) and os.path.isdir(options.words[0]):
        before, after = _keystore(options.before), _keystore(options.words[0])
        if before.on_zenoh or after.on_zenoh:
            warn("files for Zenoh are not compared: secure-keystore verify finds those that were edited")
        return before, after, ()
    if not os.path.isdir(options.before) and revisions.names_revision(options.before):
        both = revisions.plans_of(options.before, options.words, options)
        return plan_from_document(both.before), _wanted(both.after), both.as_installed
    if options.build:
        raise UsageError("--build has no effect: it is for comparing with REVISION: or REVISION:PATH")
    after = _wanted(read_plan(options.words, options))
    if os.path.isdir(options.before):
        return (*_keystore_and(after, options.before), ())
    if is_saved_plan([options.before]):
        return plan_from_document(read_saved(Path(options.before))), after, ()
    arguments = [word for word in options.words if ":=" in word]
    return plan_from_document(read_plan([options.before, *arguments], options)), after, ()


def _against(options: argparse.Namespace) -> Changes:
    """Compare a launch file with itself under another release."""
    words = [options.before, *options.words]
    if options.build or is_saved_plan(words) or revisions.names_revision(options.before):
        raise UsageError("--against compares one launch file, planned now: PACKAGE LAUNCH_FILE or PATH")
    other = argparse.Namespace(**vars(options))
    if os.path.exists(options.against):
        other.distro, other.versions = None, Path(options.against)
    else:
        with translated(argparse.ArgumentTypeError, UsageError, "--against: "):
            other.distro, other.versions = distribution(options.against), None
    before, after = (read_plan(words, each) for each in (options, other))
    changed = changes(plan_from_document(before), plan_from_document(after))
    named_before, named_after = ({each.fqn for each in plan.launched if each.fqn} for plan in (before, after))
    return changed._replace(
        enclaves=tuple(each._replace(built_in=frozenset()) for each in changed.enclaves),
        nodes_added=tuple(sorted({*changed.nodes_added, *(named_after - named_before)})),
        nodes_removed=tuple(sorted({*changed.nodes_removed, *(named_before - named_after)})),
    )


def _wanted(plan: DryRun) -> PlanDocument:
    """Return the second plan of a comparison. Report a manifest that hides what the source does: no right differs."""
    warn(*(f"{each.place}: {each.text}; {each.remedy}" for each in plan.diagnostics if each.code in _HIDDEN))
    return plan_from_document(plan)


def _keystore_and(plan: PlanDocument, keystore: str) -> tuple[PlanDocument, PlanDocument]:
    """Return the keystore's plan and the wanted one; enclaves of other launches are none of this plan's business."""
    refuse_edited_files(keystore)
    before, wanted = _keystore(keystore), plan_as_signed(plan)
    signed = {path: grants for path, grants in before.enclaves.items() if path in plan.enclaves}
    return keystore_as_plan(signed, plan, before.on_zenoh), wanted


def _keystore(keystore: str) -> PlanDocument:
    return PlanDocument(signed_grants(keystore), (), (), on_zenoh(keystore))


_NONE = "no enclave, node, permission or flow differs"


def changes_text(changed: Changes) -> str:
    """Format changes as the lines of a diff, ``+`` and ``-``; ends with a newline."""
    return "\n".join([*([*_lines(changed)] or [_NONE]), *_not_compared(changed)]) + "\n"


def changes_markdown(changed: Changes) -> str:
    """Format changes for the description or a comment of a pull request."""
    verdict = "**Rights grew.**" if changed.rights_grew else "No enclave may do more than before."
    note = "".join(f"\n{line}.\n" for line in _not_compared(changed))
    if changed.is_empty:
        return f"### Security review\n\n{_NONE.capitalize()}.\n{note}"
    body = "\n".join(_lines(changed))
    return f"### Security review\n\n{verdict}\n\n```diff\n{body}\n```\n{note}"


def changes_document(changed: Changes) -> dict[str, object]:
    """Return changes as plain values for programs; every list is sorted."""
    return {
        "version": 1,
        "rights_grew": changed.rights_grew,
        "enclaves": [
            {
                "enclave": change.enclave,
                "new": change.is_new,
                "gone": change.is_gone,
                "added": [grant._asdict() for grant in change.added],
                "removed": [grant._asdict() for grant in change.removed],
            }
            for change in changed.enclaves
        ],
        "nodes_added": list(changed.nodes_added),
        "nodes_removed": list(changed.nodes_removed),
        "moved": [move._asdict() for move in changed.moved],
        "flows_added": [list(flow) for flow in changed.flows_added],
        "flows_removed": [list(flow) for flow in changed.flows_removed],
        "middlewares": [
            {"enclave": move.node, "before": move.before, "after": move.after} for move in changed.middlewares
        ],
        "as_installed": list(changed.as_installed),
        "unknown": list(changed.unknown),
    }


def _not_compared(changed: Changes) -> Iterator[str]:
    if changed.as_installed:
        yield f"Not compared, taken as installed now on both sides: {', '.join(changed.as_installed)}"
    if changed.unknown:
        yield f"Not compared, interfaces not completely known: {', '.join(changed.unknown)}"


def _lines(changed: Changes) -> Iterator[str]:
    yield from (f"+ node {node}" for node in changed.nodes_added)
    yield from (f"- node {node}" for node in changed.nodes_removed)
    yield from (
        f"! node {move.node} moves from enclave {move.before} to {move.after}" for move in changed.moved
    )
    yield from (
        f"! enclave {move.node} moves from {move.before} to {move.after}" for move in changed.middlewares
    )
    for change in changed.enclaves:
        yield from _enclave(change)
    yield from (f"+ flow {source} -> {target}" for source, target in changed.flows_added)
    yield from (f"- flow {source} -> {target}" for source, target in changed.flows_removed)


def _enclave(change: EnclaveChange) -> Iterator[str]:
    sign = "+" if change.is_new else "-" if change.is_gone else " "
    yield f"{sign} enclave {change.enclave}"
    for mark, grants in (("+", change.added), ("-", change.removed)):
        yield from (f"{mark}   {grant}" for grant in grants if grant not in change.built_in)
        hidden = sum(grant in change.built_in for grant in grants)
        if hidden:
            yield f"{mark}   and {hidden} that every node has"
