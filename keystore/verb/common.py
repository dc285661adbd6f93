"""Options that several verbs share, and how reports look."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from enclave_launch.boundary.terminal import ProgressBar, json_text, wanted
from enclave_launch.boundary.words import counted
from keystore.disk.lock import DEFAULT_TIMEOUT
from keystore.errors import InvalidInputError
from keystore.formats.validity import DEFAULT_BACKDATE, parse_duration, parse_end, utc_now

if TYPE_CHECKING:
    from keystore.formats.domains import Domains
    from keystore.signing.ca_access import CaAccess
    from keystore.steps.options import ProvisionOptions, ProvisionReport


def add_keystore(parser: argparse.ArgumentParser) -> None:
    """The keystore that the verb works on."""
    parser.add_argument("keystore", metavar="KEYSTORE", type=Path, help="root directory of the keystore")


def add_format(parser: argparse.ArgumentParser) -> None:
    """Text for a person or JSON for a program."""
    parser.add_argument("--format", choices=("text", "json"), default="text", help="how to print (text)")


def add_signing(parser: argparse.ArgumentParser) -> None:
    """Passphrase and PIN by file, descriptor or environment variable: arguments can be read by others."""
    group = parser.add_argument_group("CA keys")
    passphrase = group.add_mutually_exclusive_group()
    passphrase.add_argument(
        "--passphrase-file", metavar="FILE", type=Path, help="file with the CA keys' passphrase"
    )
    passphrase.add_argument("--passphrase-fd", metavar="N", type=int, help="open descriptor to read it from")
    passphrase.add_argument("--passphrase-env", metavar="NAME", help="environment variable that holds it")
    pin = group.add_mutually_exclusive_group()
    pin.add_argument("--pin-file", metavar="FILE", type=Path, help="file with the PIN of the PKCS#11 token")
    pin.add_argument("--pin-env", metavar="NAME", help="environment variable that holds the PIN")


def add_lock(parser: argparse.ArgumentParser) -> None:
    """How long to wait for others that change the keystore."""
    parser.add_argument(
        "--lock-timeout", metavar="SECONDS", type=_seconds, default=DEFAULT_TIMEOUT,
        help="how long to wait for another run (30)",
    )  # fmt: skip


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 0 <= seconds < math.inf:
        raise ValueError
    return seconds


def add_domains(parser: argparse.ArgumentParser) -> None:
    """The DDS domains of the permissions; read by ``domains``."""
    parser.add_argument(
        "--domain-id", metavar="IDS", help="domains of the permissions (default: the governance's)"
    )


def domains(arguments: argparse.Namespace) -> Domains | None:
    """What ``add_domains`` was given. Raises InvalidInputError."""
    from keystore.formats.domains import Domains

    return Domains.parse(arguments.domain_id) if arguments.domain_id else None


def add_revocation(parser: argparse.ArgumentParser) -> None:
    """Whether what was issued before is revoked when rights are taken away."""
    parser.add_argument(
        "--no-revoke", action="store_true",
        help="where rights are taken away or a life is shortened: do not revoke the certificate of before; copies "
        "of it can then be used until it ends",
    )  # fmt: skip


def add_validity(parser: argparse.ArgumentParser) -> None:
    """How long certificates and permissions hold; read by ``span``."""
    parser.add_argument(
        "--valid-for",
        metavar="TIME",
        help="90d, 12h, 10y from now, or until an ISO date (default: the keystore's)",
    )
    parser.add_argument(
        "--backdate", metavar="TIME", help="begin this much earlier, for clocks that lag (1d)"
    )


def add_subjects(parser: argparse.ArgumentParser) -> None:
    """How certificate subjects are written."""
    parser.add_argument(
        "--compatible-subjects", action="store_true",
        help="CN=/path as SROS2 writes it, for use with 'ros2 security create_permission'; on Cyclone DDS "
        "some enclaves could then use the permissions of others: such names are refused",
    )  # fmt: skip
    parser.add_argument(
        "--allow-subject-overlap", action="store_true", help="with compatible subjects: accept such names"
    )


def add_change(parser: argparse.ArgumentParser) -> None:
    """Of each verb that signs and writes."""
    add_signing(parser)
    add_lock(parser)


def add_provisioning(parser: argparse.ArgumentParser) -> None:
    """Of each verb that issues certificates for enclaves; ``provision_options`` reads them."""
    add_validity(parser)
    add_revocation(parser)
    add_subjects(parser)
    add_change(parser)


def access(arguments: argparse.Namespace) -> CaAccess:
    """How CA keys are opened, from the arguments of ``add_signing``."""
    from keystore.signing.ca_access import CaAccess, Secret

    given = vars(arguments)
    passphrase = Secret(given["passphrase_file"], given["passphrase_fd"], given["passphrase_env"])
    pin = Secret(file=given["pin_file"], variable=given["pin_env"])
    return CaAccess(passphrase=passphrase if passphrase.is_given else None, pin=pin if pin.is_given else None)


def change(arguments: argparse.Namespace) -> dict[str, Any]:
    """How the keystore is opened, from the arguments of ``add_change``: for the options of any change."""
    return {"access": access(arguments), "lock_timeout": arguments.lock_timeout}


@dataclass(frozen=True, slots=True)
class Span:
    """``--valid-for`` and ``--backdate`` as the functions want them."""

    lifetime: timedelta | None
    until: datetime | None
    backdate: timedelta


def span(arguments: argparse.Namespace) -> Span:
    """From the arguments of ``add_validity``. Raises ``InvalidInputError``."""
    text: str | None = arguments.valid_for
    backdate = parse_duration(arguments.backdate) if arguments.backdate else DEFAULT_BACKDATE
    if text is None:
        return Span(None, None, backdate)
    try:
        return Span(parse_duration(text), None, backdate)
    except InvalidInputError:
        return Span(None, parse_end(text, utc_now()), backdate)


def provision_options(arguments: argparse.Namespace, **more: Any) -> ProvisionOptions:
    """What ``add_provisioning`` was given."""
    from keystore.formats.subject import SubjectScheme
    from keystore.steps.options import ProvisionOptions

    validity = span(arguments)
    return ProvisionOptions(
        lifetime=validity.lifetime,
        valid_until=validity.until,
        backdate=validity.backdate,
        subjects=SubjectScheme.COMPATIBLE if arguments.compatible_subjects else None,
        allow_subject_overlap=arguments.allow_subject_overlap,
        revoke=not arguments.no_revoke,
        progress=ProgressBar("enclaves") if wanted(arguments.quiet) else None,
        **change(arguments),
        **more,
    )


def print_json(content: Any) -> None:
    """One JSON document with sorted keys."""
    print(json_text(content, indent=2, sort_keys=True, default=str))


def print_answer(arguments: argparse.Namespace, content: dict[str, Any], lines: Iterable[str]) -> None:
    """What was asked for, as ``--format`` says."""
    if arguments.format == "json":
        print_json({"version": 1, **content})
    else:
        print_lines(lines)


def print_lines(lines: Iterable[str]) -> None:
    """Each on a line of its own."""
    for line in lines:
        print(line)


def print_report(report: ProvisionReport, arguments: argparse.Namespace) -> None:
    """What a provisioning run did, enclave by enclave; what it left alone as a count (``-v``: by name)."""
    warn(report.warnings, arguments)
    if arguments.quiet:
        return
    print_lines(report.created)
    changed = [enclave for enclave in report.enclaves if enclave.actions]
    for enclave in changed:
        print(f"{enclave.enclave}: {', '.join(enclave.actions)} ({'; '.join(enclave.reasons)})")
    unchanged = [enclave.enclave for enclave in report.enclaves if not enclave.actions]
    if arguments.verbose:
        print_lines(f"{path}: unchanged" for path in unchanged)
    elif unchanged:
        print(f"{counted(len(unchanged), 'enclave')} unchanged")


def warn(warnings: Iterable[str], arguments: argparse.Namespace) -> None:
    """Print them on stderr, unless ``-q`` was given."""
    for warning in () if arguments.quiet else warnings:
        print(f"secure-keystore: warning: {warning}", file=sys.stderr)
