"""Options that several verbs share, and the form of reports."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any, NamedTuple

from enclave_common.command_line import (
    FLAG,
    PATH,
    TEXT,
    TIME,
    CommandParser,
    FromProject,
    Kind,
    Option,
    one_of,
)
from enclave_common.terminal import counted_progress, json_text
from enclave_common.words import counted
from keystore.disk.lock import DEFAULT_TIMEOUT
from keystore.errors import InvalidInputError, KeystoreError
from keystore.formats.domains import Domains
from keystore.formats.subject import SubjectScheme
from keystore.formats.validity import iso, parse_duration, parse_end, utc_now
from keystore.signing.ca_access import CaAccess, Secret
from keystore.steps.options import ProvisionOptions

if TYPE_CHECKING:
    from keystore.steps.options import ProvisionReport


class SecretOptions(NamedTuple):
    """Secrets that open CA keys, by file, descriptor or environment variable: arguments can be read by others.

    Only one of its options may be given."""

    title: str
    options: tuple[Option, ...]


Table = tuple[Option | SecretOptions, ...]


KEYSTORE: Option = (
    "keystore KEYSTORE", {**PATH, "nargs": "?", "configured": FromProject("keystore")},
    "root directory of the keystore (default: ROS_SECURITY_KEYSTORE, or keystore in enclaves.yaml)",
)  # fmt: skip


def _enclaves(parsed_args: argparse.Namespace, **_: object) -> list[str]:
    """Return the names that a shell offers for ``ENCLAVES``."""
    from keystore.disk.view import keystore_at  # cryptography

    try:
        return keystore_at(parsed_args.keystore).enclaves()
    except KeystoreError:
        return []


ENCLAVES: Kind = {"metavar": "ENCLAVE", "completer": _enclaves}
"""Enclaves of the keystore."""
FORMAT: Option = ("--format", one_of("text", "json"), "how to print (text)")
LOCK: Option = (
    "--lock-timeout TIME", {**TIME, "default": DEFAULT_TIMEOUT},
    "how long to wait for another run (30s)",
)  # fmt: skip
WITHIN: Option = ("--expiring-within (--within) TIME", {"default": "30d"}, "what counts as soon (30d)")
DOMAINS: Option = ("--domain-id IDS", TEXT, "domains of the permissions (default: the governance's)")
"""Read by ``domains``."""
REVOKE_OLD: Option = ("--revoke-old", FLAG, "also revoke the certificates these enclaves had before")
ENCRYPTION: Option = ("--encrypt-ca-keys", FLAG, "make no CA key without a passphrase, which encrypts it")
VALIDITY: Option = (
    "--valid-for TIME", TEXT, "90d, 12h, 10y from now, or until an ISO date (default: the keystore's)"
)  # fmt: skip
"""How long certificates and permissions hold."""
SUBJECTS: tuple[Option, ...] = (
    ("--compatible-subjects", FLAG,
     "CN=/path as SROS2 writes it, for use with 'ros2 security create_permission'; on Cyclone DDS "
     "some enclaves could then use the permissions of others: such names are refused"),
    ("--allow-subject-overlap", FLAG, "with compatible subjects: accept such names"),
)  # fmt: skip
"""How certificate subjects are written."""
SIGNING: tuple[SecretOptions, ...] = (
    SecretOptions("passphrase of the CA keys", (
        ("--ca-passphrase-file (--passphrase-file) FILE", PATH, "file that holds it"),
        ("--ca-passphrase-fd (--passphrase-fd) N", {"type": int}, "open descriptor to read it from"),
        ("--ca-passphrase-env (--passphrase-env) NAME", TEXT, "environment variable that holds it"),
    )),
    SecretOptions("PIN of a PKCS#11 token with the CA keys", (
        ("--pin-file FILE", PATH, "file that holds it"),
        ("--pin-env NAME", TEXT, "environment variable that holds it"),
    )),
)  # fmt: skip
"""Read by ``access``."""
CLOCK: Option = (
    "--accept-clock", FLAG,
    "go on although the clock is far from the time of the keystore's last change",
)  # fmt: skip
CHANGE: Table = (*SIGNING, LOCK, CLOCK)
"""Of each verb that signs and writes; read by ``change``."""
PROVISIONING: Table = (
    VALIDITY,
    ("--no-revoke", FLAG,
     "if rights are removed or a validity is shortened: do not revoke the previous certificate (it is "
     "usable until it expires)"),
    *SUBJECTS,
    *CHANGE,
)  # fmt: skip
"""Of each verb that issues certificates for enclaves; read by ``provision_options``."""
FOLDED: tuple[Option, ...] = (
    *SUBJECTS,
    *(option for secret in SIGNING for option in secret.options),
    LOCK,
    CLOCK,
)
"""Described by ``create --help`` alone."""


def add_table(parser: CommandParser, table: Table) -> None:
    """Add the options of a verb."""
    for row in table:
        if isinstance(row, SecretOptions):
            parser.add_one_of(row.options, row.title)
        else:
            parser.add_options((row,))


def domains(arguments: argparse.Namespace) -> Domains | None:
    """Return what ``DOMAINS`` was given; raises InvalidInputError."""
    return Domains.parse(arguments.domain_id) if arguments.domain_id else None


def access(arguments: argparse.Namespace) -> CaAccess:
    """Return how CA keys are opened, from the options of ``SIGNING``."""
    given = vars(arguments)
    passphrase = Secret(given["ca_passphrase_file"], given["ca_passphrase_fd"], given["ca_passphrase_env"])
    pin = Secret(file=given["pin_file"], variable=given["pin_env"])
    return CaAccess(passphrase=passphrase if passphrase.is_given else None, pin=pin if pin.is_given else None)


def change(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return how the keystore is opened for any change, from the options of ``CHANGE``."""
    return {
        "access": access(arguments),
        "lock_timeout": arguments.lock_timeout,
        "accept_clock": arguments.accept_clock,
    }


def _span(text: str | None) -> tuple[timedelta | None, datetime | None]:
    """Return ``--valid-for`` as a lifetime or as an end; raises ``InvalidInputError``."""
    if text is None:
        return None, None
    try:
        return parse_duration(text), None
    except InvalidInputError:
        return None, parse_end(text, utc_now())


def provision_options(arguments: argparse.Namespace, **more: Any) -> ProvisionOptions:
    """Return what ``PROVISIONING`` was given."""
    lifetime, until = _span(arguments.valid_for)
    return ProvisionOptions(
        lifetime=lifetime,
        valid_until=until,
        subjects=SubjectScheme.COMPATIBLE if arguments.compatible_subjects else None,
        allow_subject_overlap=arguments.allow_subject_overlap,
        revoke=not arguments.no_revoke,
        progress=counted_progress("signing enclaves:", quiet=arguments.quiet),
        **change(arguments),
        **more,
    )


def print_json(content: Any) -> None:
    """Print one JSON document with sorted keys."""
    print(json_text(content, indent=2, sort_keys=True, default=str))


def print_answer(arguments: argparse.Namespace, content: dict[str, Any], lines: Iterable[str]) -> None:
    """Print what was requested, as ``--format`` says."""
    if arguments.format == "json":
        print_json({"version": 1, **content})
    else:
        print_lines(lines)


def print_lines(lines: Iterable[str]) -> None:
    """Print each on a line of its own."""
    for line in lines:
        print(line)


def print_report(report: ProvisionReport, arguments: argparse.Namespace) -> None:
    """Print what a provisioning run did, enclave by enclave; what it left alone as a count (``-v``: by name)."""
    warn(report.warnings, arguments)
    if arguments.quiet:
        return
    print_lines(report.created)
    changed = [enclave for enclave in report.enclaves if enclave.actions]
    for enclave in changed:
        ends = f", valid until {iso(enclave.validity.not_after)}" if enclave.validity is not None else ""
        print(f"{enclave.enclave}: {', '.join(enclave.actions)} ({'; '.join(enclave.reasons)}){ends}")
    unchanged = [enclave.enclave for enclave in report.enclaves if not enclave.actions]
    if arguments.verbose:
        print_lines(f"{path}: unchanged" for path in unchanged)
    elif unchanged:
        print(f"{counted(len(unchanged), 'enclave')} unchanged")


def warn(warnings: Iterable[str], arguments: argparse.Namespace) -> None:
    """Print them on stderr, unless ``-q`` was given."""
    for warning in () if arguments.quiet else warnings:
        print(f"secure-keystore: warning: {warning}", file=sys.stderr)
