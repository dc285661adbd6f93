"""``secure-launch --audit``: run a launch unsecured and hold what its nodes ask for against its plan."""

from __future__ import annotations

import argparse
import sys

from enclave_common.new_file import write_text
from enclave_common.terminal import warn
from enclave_launch.errors import RuntimeFailure, translated
from enclave_launch.flow import run
from enclave_launch.options import RunSettings
from enclave_launch.plan import LaunchPlan
from enclave_launch.recording.audit import Audit, audit_json, audit_text
from enclave_launch.recording.learning import new_run
from enclave_launch.recording.recording import Recording


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
