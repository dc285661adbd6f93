"""``secure-launch --learn DIR`` and ``--audit``: run a launch recorded, to write manifests of its nodes, or to compare
what they request with its plan.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path

from enclave_common.dependencies import installed
from enclave_common.files import write_text
from enclave_common.terminal import warn
from enclave_common.words import counted, some_of
from enclave_launch.errors import ManifestError, RuntimeFailure, translated
from enclave_launch.flow import run
from enclave_launch.options import RunSettings
from enclave_launch.plan import LaunchPlan
from enclave_launch.recording.audit import Audit, audit_json, audit_text
from enclave_launch.recording.isolation import DEVICES_STAY_REAL, isolate
from enclave_launch.recording.learning import (
    RECORDS,
    LearntFolder,
    QuietWatch,
    keep_record,
    new_run,
    prepare_folder,
    write_manifests,
)
from enclave_launch.recording.markers import MarkerRun, questions
from enclave_launch.recording.recording import Recording
from enclave_launch.runtime.companion import LaunchCompanion
from enclave_launch.verb.target import LaunchTarget
from nodl.errors import NoDLError

_NAMES = 6  # named in a message

Start = Callable[["LaunchCompanion"], int]
"""Run the launch with a companion; gives the exit status."""


def learn_launch(target: LaunchTarget, options: argparse.Namespace, start: Start) -> int:
    """Record one run (two for ``--learn-parameters``), write what was learnt, return the status of the launch."""
    patience: float | None = options.learn_for
    folder = Path(options.learn).absolute()
    prepare_folder(folder)
    isolation = isolate(options.learn_isolation)
    unsecured = "" if options.secure else ", unsecured"
    _say(f"learning: every process runs as ever{unsecured}; {DEVICES_STAY_REAL}")
    _say(f"isolated by: {isolation.value}")

    def record(patience: float | None, markers: MarkerRun | None = None) -> int:
        distro = options.distro or os.environ.get("ROS_DISTRO", "")
        run = new_run(target.launch_file, distro, isolation.value, secured=options.secure)
        recording = Recording(run, [QuietWatch(patience)], markers)
        status = start(recording)
        keep_record(folder, run, recording.data)
        return status

    status = record(patience)
    if options.learn_parameters and (found := questions(folder)):
        _say(f"a second run, with marker values for {found.shown}")
        status = max(status, record(patience or 5.0, MarkerRun(found)))
    _report(write_manifests(folder), folder)
    if installed("nodl.infer") and options.missing_nodl == "infer":
        _report_unseen(folder, options)
    return status


def _report_unseen(folder: Path, options: argparse.Namespace) -> None:
    """Report what other descriptions of the recorded nodes have: some names exist only while another is read."""
    from nodl.verb.check_record import never_seen  # an add-on: inference

    _say("comparing the records with sources and the library")
    with translated(NoDLError, ManifestError):
        found = never_seen([folder / RECORDS], options.prefix, options.source)
    for about, names in found.items():
        _say(f"warning: {about}: never seen: {some_of(names, _NAMES, '; ')}")
    if found:
        _say(
            "record again while these are used, or grant them with --also unseen (--explain shows which description "
            "has them)"
        )


def _report(learnt: LearntFolder, folder: Path) -> None:
    for path, node in learnt.files.items():
        runs = counted(len(node.runs), "run")
        print(
            f"{path}: node {node.key.node} of {node.program}, {counted(len(node.entries), 'endpoint')}, {runs}"
        )
    for note in learnt.notes:
        _say(f"warning: {note}")
    if not learnt.files:
        _say(f"warning: no node was recorded; {folder} has no manifest")


def _say(text: str) -> None:
    print(f"secure-launch: {text}", file=sys.stderr)


def audit_launch(plan: LaunchPlan, options: argparse.Namespace, settings: RunSettings) -> int:
    """Run the launch and report what the plan would refuse; return 1 then, or if not everything was visible."""
    warn(*plan.problems)
    audit = Audit(plan)
    recording = Recording(new_run(plan.launch_file, plan.distro, "none"), [audit])
    status = run(plan, options=settings._replace(companion=recording))
    report = audit.report()
    sys.stdout.write(audit_text(report))
    if options.audit_report is not None:
        with translated(
            OSError, RuntimeFailure, f"--audit-report {options.audit_report}: cannot be written: "
        ):
            write_text(options.audit_report, audit_json(report))
    return status or report.exit_status
