"""Start a launch from the command line: plainly, secured, watched, recorded or audited."""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import Protocol

from enclave_common.terminal import counted_progress, printable, warn
from enclave_common.words import counted, some_of
from enclave_launch.add_ons import zenoh_start
from enclave_launch.errors import UsageError, keystore_errors, translated
from enclave_launch.evaluation.programs import check_programs
from enclave_launch.expiry_watch import renewal_deadline
from enclave_launch.flow import launch_source, provision, run, run_unsecured
from enclave_launch.options import RunSettings, SecurityOptions
from enclave_launch.plan import LaunchPlan, on_zenoh
from enclave_launch.policy.sharing import gains_by_sharing
from enclave_launch.runtime.companion import LaunchCompanion
from enclave_launch.runtime.ros_services import require_rclpy
from enclave_launch.secured import ProvisionedLaunch
from enclave_launch.verb.modes import chosen_mode
from enclave_launch.verb.options import resolve_options
from enclave_launch.verb.planning import planned
from enclave_launch.verb.target import LaunchTarget
from enclave_launch.verb.usage import PERMISSIVE_NOTICE, unsecured_notice
from keystore.errors import InvalidInputError
from keystore.formats.domains import Domains
from keystore.formats.subject import SubjectScheme
from keystore.formats.validity import later, parse_duration, parse_end, utc_now
from keystore.signing.ca_access import CaAccess, Secret
from keystore.steps.expiry import expires_soon
from keystore.steps.options import ProvisionOptions
from keystore.steps.signing_process import SigningProcess


class Watch(LaunchCompanion, Protocol):
    """A companion whose findings change the exit status of the launch."""

    def status(self, of_launch: int) -> int:
        """Return the exit status of the launch, or that of the findings."""


def _nothing_to_check(plan: LaunchPlan) -> None:
    pass


def _nothing_to_watch(launch: ProvisionedLaunch) -> Watch | None:
    return None


@dataclass(frozen=True)
class Company:
    """The companions of a launch in a mode.

    Attributes:
        check: Called with the plan before keys are made. It raises an ``EnclaveLaunchError``.
        companion: Takes the place of what explains denials.
        watch: Makes a further companion of the provisioned launch.
    """

    check: Callable[[LaunchPlan], None] = _nothing_to_check
    companion: LaunchCompanion | None = None
    watch: Callable[[ProvisionedLaunch], Watch | None] = _nothing_to_watch


ALONE = Company()


def launch_target(target: LaunchTarget, options: argparse.Namespace, keystore: str | None) -> int:
    """Run ``target`` in the mode that the options choose, or just start it. Return the exit status."""
    mode = chosen_mode(options)
    return start(target, options, keystore) if mode is None else mode.launch(target, options, keystore)


def start(
    target: LaunchTarget,
    options: argparse.Namespace,
    keystore: str | None,
    company: Company = ALONE,
) -> int:
    """Launch ``target``, secured if ``keystore`` is given, wait until it is over, and return the exit status."""
    if keystore is None:
        return _launch_plainly(target, options, company.companion)
    sign_elsewhere(options, keystore)
    while (status := _launch(planned(target, options, keystore), options, keystore, company)) is None:
        pass  # what it used was about to end: planned, renewed and started once more
    return status


def _launch_plainly(
    target: LaunchTarget, options: argparse.Namespace, companion: LaunchCompanion | None
) -> int:
    """Launch without enclaves. The interfaces of the nodes need not be known."""
    launch = launch_source(target.launch_file, target.arguments, options=resolve_options(options))
    print(f"secure-launch: {unsecured_notice(os.environ)}", file=sys.stderr)
    return run_unsecured(launch, options=replace(run_settings(options), companion=companion))


def _launch(plan: LaunchPlan, options: argparse.Namespace, keystore: str, company: Company) -> int | None:
    """Provision and run; return the exit status, None to renew and start again (``--restart-expiring``)."""
    warn(*(() if options.quiet else plan.warnings))
    if not options.provision_only:
        _check_before_keys_are_made(plan, keystore)
        if not plan.problems:
            company.check(plan)
    if options.strategy == "Permissive":
        print(f"secure-launch: {PERMISSIVE_NOTICE}", file=sys.stderr)
    launch = provision(plan, keystore, options=security_options(options))
    if not options.quiet:
        for text in (*created_notices(launch), *sharing_notices(plan)):
            print(f"secure-launch: {printable(text)}", file=sys.stderr)
    repaired = (*repair_notices(launch), *launch.report.warnings, *launch.handshakes)
    gaps = launch.zenoh.gaps if launch.zenoh is not None else ()
    warn(*repaired, *gaps, *expiry_notices(launch, options.expiring_within))
    if options.provision_only:
        return 0
    deadline = renewal_deadline(launch, utc_now()) if options.restart_expiring else None
    watch = company.watch(launch)
    settings = replace(run_settings(options), companion=company.companion, deadline=deadline, watch=watch)
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


def run_settings(options: argparse.Namespace) -> RunSettings:
    """Return the options of a run."""
    return RunSettings(
        noninteractive=options.noninteractive,
        debug=options.debug,
        allow_late=options.allow_late,
        secrets=frozenset(filter(None, [options.ca_passphrase_env])),
        record=False if options.no_explain_denials else None,
        log_limit=options.log_limit,
    )


_LISTED = 8
_NAMED = 3
_NEW_KEYSTORE = "governance signed"


def security_options(options: argparse.Namespace) -> SecurityOptions:
    """Return the options of provisioning; raises ``UsageError`` for a value that an option does not take."""
    with translated(InvalidInputError, UsageError):
        parse_duration(options.expiring_within)  # used after provisioning, refused before
        keystore = _provision_options(options)
    folder = options.log_security
    if folder is not None:
        with translated(OSError, UsageError, f"--log-security {folder}: "):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return SecurityOptions(strategy=options.strategy, keystore=keystore, log_folder=folder)


def _provision_options(options: argparse.Namespace) -> ProvisionOptions:
    now = utc_now()
    until = parse_end(options.valid_for, now) if options.valid_for else None
    return ProvisionOptions(
        # None: those that the plan finds in the environments of the processes.
        domains=Domains.parse(options.domain_id) if options.domain_id else None,
        create=not options.no_create_keystore,
        valid_until=until,
        # With short lives each start renews in time: when two thirds are over.
        renew_within=(until - now) / 3 if until is not None else timedelta(0),
        subjects=SubjectScheme.COMPATIBLE if options.compatible_subjects else None,
        revoke=not options.no_revoke,
        access=CaAccess(passphrase=_passphrase(options)),
        signing=vars(options).get("signing"),
        progress=counted_progress("signing enclaves:", quiet=options.quiet),
    )


def sign_elsewhere(options: argparse.Namespace, keystore: str) -> None:
    """Start a signing process if a passphrase is given; call it before launch files run in this process."""
    if _passphrase(options) is None or vars(options).get("signing") is not None:
        return

    with translated(InvalidInputError, UsageError):
        options.signing = SigningProcess.start(keystore, _provision_options(options))


def _passphrase(options: argparse.Namespace) -> Secret | None:
    if options.ca_passphrase_file is not None:
        return Secret(file=options.ca_passphrase_file)
    if options.ca_passphrase_env is not None:
        return Secret(variable=options.ca_passphrase_env)
    return None


def created_notices(launch: ProvisionedLaunch) -> Iterator[str]:
    """Yield a few lines about what is new in the keystore."""
    report = launch.report
    if _NEW_KEYSTORE in report.created:
        yield f"keystore {report.keystore} created"
    new = [enclave.enclave for enclave in report.enclaves if "created" in enclave.actions]
    if new:
        yield f"{counted(len(new), 'enclave')} created: {some_of(new, _LISTED, ' ')}"


def sharing_notices(plan: LaunchPlan) -> Iterator[str]:
    """Yield, for each enclave that several processes share, permissions only because of that."""
    processes = Counter(process.enclave.path for process in plan.processes if process.enclave is not None)
    gains: dict[str, list[str]] = {}
    for gain in gains_by_sharing(plan.derived):
        rules = (f"{rule.operation.verb} {rule.expression}" for rule in gain.gained)
        gains.setdefault(gain.enclave, []).append(f"{gain.node} may also {some_of(rules, _NAMED)}")
    for enclave, number in sorted(processes.items()):
        if number > 1 and enclave in gains:
            yield (
                f"enclave {enclave} is shared by {number} processes: {some_of(gains[enclave], _NAMED, '; ')}; "
                "--enclave-scope node gives each node its own"
            )


def repair_notices(launch: ProvisionedLaunch) -> Iterator[str]:
    """Yield a line for each part of the keystore that was repaired; new parts are not repairs."""
    report = launch.report
    if _NEW_KEYSTORE not in report.created:
        yield from (f"keystore {report.keystore}: {text}" for text in report.created)
    for enclave in report.enclaves:
        if enclave.actions and "created" not in enclave.actions:
            yield f"enclave {enclave.enclave}: {', '.join(enclave.actions)} ({'; '.join(enclave.reasons)})"


def expiry_notices(launch: ProvisionedLaunch, margin: str) -> Iterator[str]:
    """Yield a line for each part of ``launch`` that expires within ``margin``, a duration such as ``30d``."""
    within, ends = parse_duration(margin), launch.report.ends
    if ends is not None and later(utc_now(), within) < ends:
        return

    keystore, known = launch.settings.keystore, launch.report.validities
    enclaves = [enclave.path for enclave in launch.plan.derived.policy.enclaves]
    with keystore_errors(), translated(InvalidInputError, UsageError):
        due = expires_soon(keystore, within, enclaves=enclaves, known=known)
    for one in due:
        yield f"{one.subject} expires {one.not_after:%Y-%m-%d %H:%M} UTC; renew with: secure-keystore renew {keystore}"
