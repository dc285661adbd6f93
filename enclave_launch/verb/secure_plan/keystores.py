"""What the verbs ask of a keystore. Reads only; every error is a ``ProvisionError`` in the keystore's own words."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

from enclave_launch.errors import keystore_errors
from enclave_launch.review.checks.keystore import Ending
from enclave_launch.review.document import GrantedName
from enclave_launch.review.signed import grants_of_rules
from keystore.formats.validity import iso, parse_duration, utc_now
from keystore.steps.expiry import status
from keystore.steps.inventory import enforced, granted
from keystore.verification.finding import Finding
from keystore.verification.zenoh import check_zenoh_files

DEFAULT_MARGIN = "30d"


def signed_grants(keystore: Path | str) -> Mapping[str, frozenset[GrantedName]]:
    """Enclave -> what its signed permissions allow."""
    with keystore_errors():
        return {enclave: grants_of_rules(found.allowed) for enclave, found in granted(keystore).items()}


def enforced_grants(keystore: Path | str) -> Mapping[str, frozenset[GrantedName]]:
    """Enclave -> what the configuration of the keystore's Zenoh router allows; empty without one."""
    with keystore_errors():
        return {enclave: grants_of_rules(rules) for enclave, rules in enforced(keystore).items()}


def zenoh_findings(keystore: Path | str, now: datetime | None = None) -> tuple[Finding, ...]:
    """Return what ``secure-keystore verify`` finds in the files for Zenoh."""
    with keystore_errors():
        return check_zenoh_files(keystore, now or utc_now())


def endings(
    keystore: Path | str, within: str | None = None, now: datetime | None = None
) -> tuple[Ending, ...]:
    """Return everything that expires, the earliest first.

    :param within: only what expires within a duration such as ``30d``"""
    with keystore_errors():
        report = status(keystore, now=now)
        chosen = report.expiries if within is None else report.due(parse_duration(within))
    return tuple(
        Ending(one.subject, one.enclave, iso(one.not_after), (one.not_after - report.now).days)
        for one in chosen
    )
