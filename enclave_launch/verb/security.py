"""The security options of ``secure-launch`` as values of the keystore's own types."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from datetime import timedelta

from enclave_common.terminal import counted_progress
from enclave_common.words import counted, some_of
from enclave_launch.errors import UsageError, keystore_errors, translated
from enclave_launch.options import SecurityOptions
from enclave_launch.plan import LaunchPlan
from enclave_launch.policy.sharing import gains_by_sharing
from enclave_launch.secured import ProvisionedLaunch
from keystore.errors import InvalidInputError
from keystore.formats.domains import Domains
from keystore.formats.subject import SubjectScheme
from keystore.formats.validity import later, parse_duration, parse_end, utc_now
from keystore.signing.ca_access import CaAccess, Secret
from keystore.steps.expiry import expires_soon
from keystore.steps.options import ProvisionOptions
from keystore.steps.signing_process import SigningProcess

_LISTED = 8
_NAMED = 3
_NEW_KEYSTORE = "governance signed"


def security_options(options: argparse.Namespace) -> SecurityOptions:
    """Return the options of provisioning; raises ``UsageError`` for a value that an option does not take."""
    with translated(InvalidInputError, UsageError):
        parse_duration(options.warn_expiry)  # used after provisioning, refused before
        return SecurityOptions(strategy=options.strategy, keystore=_provision_options(options))


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
