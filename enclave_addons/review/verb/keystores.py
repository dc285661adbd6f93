"""Read a keystore for the verbs; every error is a ``ProvisionError`` in the keystore's own words."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

from enclave_addons.review.checks.keystore import Ending
from enclave_addons.review.document import GrantedName
from enclave_addons.review.signed import grants_of_rules
from enclave_launch.errors import ProvisionError, keystore_errors
from keystore.add_ons import zenoh_files
from keystore.disk.view import keystore_at
from keystore.formats.validity import iso, parse_duration, utc_now
from keystore.steps.expiry import status
from keystore.steps.inventory import granted
from keystore.verification.finding import Finding

DEFAULT_MARGIN = "30d"


def signed_grants(keystore: Path | str) -> Mapping[str, frozenset[GrantedName]]:
    """Map each enclave to what its signed permissions allow."""
    with keystore_errors():
        return {enclave: grants_of_rules(rules) for enclave, rules in granted(keystore).items()}


def on_zenoh(keystore: Path | str) -> frozenset[str]:
    """Return the enclaves that are on Zenoh."""
    with keystore_errors():
        return frozenset(keystore_at(keystore).zenoh_enclaves())


def zenoh_findings(keystore: Path | str, now: datetime | None = None) -> tuple[Finding, ...]:
    """Return what ``secure-keystore verify`` finds in the files for Zenoh."""
    with keystore_errors():
        view = keystore_at(keystore)
        return tuple(zenoh_files().check(view, now or utc_now())) if view.has_zenoh_router else ()


def refuse_edited_files(keystore: Path | str) -> None:
    """Raise ``ProvisionError`` if a file for Zenoh is not what follows from what is signed."""
    for found in zenoh_findings(keystore):
        if found.severity.fails:
            raise ProvisionError(f"{keystore}: {found.place} {found.message}. {found.repair}")


def endings(
    keystore: Path | str, within: str | None = None, now: datetime | None = None
) -> tuple[Ending, ...]:
    """Return everything that expires (``within`` such as ``30d``), the earliest first."""
    with keystore_errors():
        report = status(keystore, now=now)
        chosen = report.expiries if within is None else report.due(parse_duration(within))
    return tuple(
        Ending(one.subject, one.enclave, iso(one.not_after), (one.not_after - report.now).days)
        for one in chosen
    )
