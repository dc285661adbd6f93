"""The security options of ``secure-launch`` as values of the keystore's own types."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from datetime import timedelta

from enclave_launch.boundary.terminal import ProgressBar, wanted
from enclave_launch.boundary.words import counted, some_of
from enclave_launch.errors import UsageError, keystore_errors, translated
from enclave_launch.options import SecurityOptions
from enclave_launch.secured import ProvisionedLaunch
from keystore.errors import InvalidInputError
from keystore.formats.domains import Domains
from keystore.formats.subject import SubjectScheme
from keystore.formats.validity import later, parse_duration, parse_end, utc_now
from keystore.signing.ca_access import CaAccess, Secret
from keystore.steps.expiry import expires_soon
from keystore.steps.options import ProvisionOptions

_LISTED = 8
_NEW_KEYSTORE = "governance signed"


def security_options(options: argparse.Namespace) -> SecurityOptions:
    """Raises ``UsageError`` for a value that is not what its option takes."""
    with translated(InvalidInputError, UsageError):
        parse_duration(options.warn_expiry)  # used after provisioning, refused before
        return SecurityOptions(strategy=options.strategy, keystore=_provision_options(options))


def _provision_options(options: argparse.Namespace) -> ProvisionOptions:
    subjects, creation = None, None
    if options.compatible_subjects:
        from keystore.steps.creation import CreateOptions  # much to import, and rarely needed

        subjects, creation = SubjectScheme.COMPATIBLE, CreateOptions(subjects=SubjectScheme.COMPATIBLE)
    now = utc_now()
    until = parse_end(options.valid_for, now) if options.valid_for else None
    return ProvisionOptions(
        # None: those that the plan finds in the environments of the processes.
        domains=Domains.parse(options.domain_id) if options.domain_id else None,
        create=not options.no_create_keystore,
        creation=creation,
        valid_until=until,
        # With short lives each start renews in time: when two thirds are over.
        renew_within=(until - now) / 3 if until is not None else timedelta(0),
        subjects=subjects,
        revoke=not options.no_revoke,
        access=CaAccess(passphrase=_passphrase(options)),
        progress=ProgressBar("enclaves") if wanted(options.quiet) else None,
    )


def _passphrase(options: argparse.Namespace) -> Secret | None:
    if options.ca_passphrase_file is not None:
        return Secret(file=options.ca_passphrase_file)
    if options.ca_passphrase_env is not None:
        return Secret(variable=options.ca_passphrase_env)
    return None


def created_notices(launch: ProvisionedLaunch) -> Iterator[str]:
    """What of the keystore is new, in a few lines."""
    report = launch.report
    if _NEW_KEYSTORE in report.created:
        yield f"keystore {report.keystore} created"
    new = [enclave.enclave for enclave in report.enclaves if "created" in enclave.actions]
    if new:
        yield f"{counted(len(new), 'enclave')} created: {some_of(new, _LISTED, ' ')}"


def repair_notices(launch: ProvisionedLaunch) -> Iterator[str]:
    """What of the keystore was not as it should be and was repaired, one line each; new things are not repairs."""
    report = launch.report
    if _NEW_KEYSTORE not in report.created:
        yield from (f"keystore {report.keystore}: {text}" for text in report.created)
    for enclave in report.enclaves:
        if enclave.actions and "created" not in enclave.actions:
            yield f"enclave {enclave.enclave}: {', '.join(enclave.actions)} ({'; '.join(enclave.reasons)})"


def expiry_notices(launch: ProvisionedLaunch, margin: str) -> Iterator[str]:
    """What of ``launch`` ends within ``margin`` (a duration such as ``30d``), one line each."""
    within, ends = parse_duration(margin), launch.report.ends
    if ends is not None and later(utc_now(), within) < ends:
        return

    keystore, known = launch.settings.keystore, launch.report.validities
    enclaves = [enclave.path for enclave in launch.plan.derived.policy.enclaves]
    with keystore_errors(), translated(InvalidInputError, UsageError):
        due = expires_soon(keystore, within, enclaves=enclaves, known=known)
    for one in due:
        yield f"{one.subject} ends {one.not_after:%Y-%m-%d %H:%M} UTC; renew with: secure-keystore renew {keystore}"
