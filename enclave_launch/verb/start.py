"""Start a launch from the command line: plainly, secured, watched, recorded or audited."""

from __future__ import annotations

import argparse
import os
import sys

from enclave_common.terminal import printable, warn
from enclave_launch.add_ons import zenoh_start
from enclave_launch.evaluation.programs import check_programs
from enclave_launch.expiry_watch import renewal_deadline
from enclave_launch.flow import launch_source, provision, run
from enclave_launch.options import RunSettings
from enclave_launch.plan import LaunchPlan, on_zenoh
from enclave_launch.runtime.companion import LaunchCompanion
from enclave_launch.runtime.ros_services import require_rclpy
from enclave_launch.verb.options import resolve_options
from enclave_launch.verb.planning import planned, resolve_target
from enclave_launch.verb.security import (
    created_notices,
    expiry_notices,
    repair_notices,
    security_options,
    sharing_notices,
    sign_elsewhere,
)
from enclave_launch.verb.target import LaunchTarget
from enclave_launch.verb.usage import PERMISSIVE_NOTICE, unsecured_notice
from keystore.formats.validity import utc_now


def launch_target(target: LaunchTarget, options: argparse.Namespace, keystore: str | None) -> int:
    """Learn from, audit or start ``target``, as the options say. Return the exit status."""
    if options.learn is not None:
        from enclave_launch.verb.recorded import learn_launch  # an add-on: recording

        return learn_launch(target, options, lambda companion: start(target, options, keystore, companion))
    if options.audit:
        from enclave_launch.verb.recorded import audit_launch  # an add-on: recording

        return audit_launch(resolve_target(target, options), options, _run_settings(options))
    return start(target, options, keystore)


def start(
    target: LaunchTarget,
    options: argparse.Namespace,
    keystore: str | None,
    companion: LaunchCompanion | None = None,
) -> int:
    """Launch ``target``, secured if ``keystore`` is given, wait until it is over, and return the exit status."""
    if keystore is None:
        if options.watch:
            from enclave_launch.verb.watch import watch_plain_launch  # an add-on: observation

            plan = resolve_target(target, options)
            warn(*plan.problems, *plan.warnings)
            print(f"secure-launch: {unsecured_notice(os.environ)}", file=sys.stderr)
            return watch_plain_launch(plan, options, _run_settings(options))
        return _launch_plainly(target, options, companion)
    sign_elsewhere(options, keystore)
    while (status := _launch(planned(target, options, keystore), options, keystore, companion)) is None:
        pass  # what it used was about to end: planned, renewed and started once more
    return status


def _launch_plainly(
    target: LaunchTarget, options: argparse.Namespace, companion: LaunchCompanion | None = None
) -> int:
    """Launch without enclaves: nobody has to know what the nodes say to each other."""
    launch = launch_source(target.launch_file, target.arguments, options=resolve_options(options))
    print(f"secure-launch: {unsecured_notice(os.environ)}", file=sys.stderr)
    return run(launch, options=_run_settings(options)._replace(companion=companion))


def _launch(
    plan: LaunchPlan, options: argparse.Namespace, keystore: str, companion: LaunchCompanion | None = None
) -> int | None:
    """Provision and run; return the exit status, None to renew and start again (``--restart-expiring``)."""
    warn(*(() if options.quiet else plan.warnings))
    if not options.provision_only:
        _check_before_keys_are_made(plan, keystore)
        if options.watch and not plan.problems:
            from enclave_launch.verb.watch import check_watch  # an add-on: observation

            check_watch(plan)
    if options.strategy == "Permissive":
        print(f"secure-launch: {PERMISSIVE_NOTICE}", file=sys.stderr)
    launch = provision(plan, keystore, options=security_options(options))
    if not options.quiet:
        for text in (*created_notices(launch), *sharing_notices(plan)):
            print(f"secure-launch: {printable(text)}", file=sys.stderr)
    repaired = (*repair_notices(launch), *launch.report.warnings, *launch.handshakes)
    gaps = launch.zenoh.gaps if launch.zenoh is not None else ()
    warn(*repaired, *gaps, *expiry_notices(launch, options.warn_expiry))
    if options.provision_only:
        return 0
    deadline = watch = None
    if options.restart_expiring:
        deadline = renewal_deadline(launch, utc_now())
    if options.watch:
        from enclave_launch.verb.watch import watch_of_secured_launch  # an add-on: observation

        watch = watch_of_secured_launch(launch, options)
    settings = _run_settings(options)._replace(companion=companion, deadline=deadline, watch=watch)
    status = run(launch, options=settings)
    if watch is not None:
        status = watch.status(status)
    return None if deadline is not None and deadline.reached else status


def _check_before_keys_are_made(plan: LaunchPlan, keystore: str) -> None:
    if plan.problems:
        return  # ``provision`` reports them
    check_programs(plan.evaluation.processes)
    if on_zenoh(plan, os.environ):
        zenoh_start().check(plan, keystore)
    if plan.launcher is not None:
        require_rclpy()


def _run_settings(options: argparse.Namespace) -> RunSettings:
    return RunSettings(
        noninteractive=options.noninteractive,
        debug=options.debug,
        allow_late=options.allow_late,
        secrets=frozenset(filter(None, [options.ca_passphrase_env])),
        record=False if options.no_explain_denials else None,
        log_limit=options.log_limit,
    )
