"""List what of a keystore expires when. Reads only; each launch does this."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout, safe_files
from keystore.disk.crl_file import crl_validity
from keystore.disk.view import KeystoreView, keystore_at
from keystore.formats.certificate import read_certificate
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.permissions_document import parse_permissions
from keystore.formats.role import Role
from keystore.formats.validity import Validity, later, utc_now
from keystore.signing import smime


class Expiry(NamedTuple):
    """The end of a validity. ``what``: ``identity CA``, ``permissions CA``, ``certificate``, ``permissions`` or
    ``CRL``; ``enclave`` for the two that belong to one."""

    not_after: datetime
    what: str
    enclave: str | None
    not_before: datetime

    def is_valid(self, now: datetime) -> bool:
        return self.not_before <= now <= self.not_after

    def is_due(self, now: datetime, limit: datetime) -> bool:
        """Return whether it has expired or has not begun at ``now``, or expires by ``limit``."""
        return self.not_after <= limit or not self.is_valid(now)

    @property
    def subject(self) -> str:
        return f"{self.what} of {self.enclave}" if self.enclave else self.what


class StatusReport(NamedTuple):
    """The expiries of a keystore. ``expiries``: everything with an end, the earliest first."""

    keystore: Path
    now: datetime
    enclaves: tuple[str, ...]
    expiries: tuple[Expiry, ...]

    def due(self, margin: timedelta) -> tuple[Expiry, ...]:
        """Return what has expired, has not begun, or expires within ``margin``."""
        limit = later(self.now, margin)
        return tuple(one for one in self.expiries if one.is_due(self.now, limit))


def status(keystore: Path | str, *, now: datetime | None = None) -> StatusReport:
    """List what expires when; raises NotAKeystoreError, DamagedKeystoreError for what cannot be read."""
    view = keystore_at(keystore)
    names = view.enclaves()
    ordered = sorted(_expiries(view, names, {}), key=_order)
    return StatusReport(view.root, now or utc_now(), tuple(names), tuple(ordered))


def expires_soon(
    keystore: Path | str,
    within: timedelta,
    *,
    enclaves: Iterable[str] | None = None,
    known: Mapping[str, Validity] | None = None,
    now: datetime | None = None,
) -> tuple[Expiry, ...]:
    """Return what expires within ``within`` (or has expired), for the CAs and these enclaves (None: all).

    ``known``: enclaves that need not be read again, with the validity of their certificate and permissions, as
    ``ProvisionReport.validities`` gives them.
    """
    view = keystore_at(keystore)
    names = view.enclaves() if enclaves is None else [validate_enclave_name(name) for name in enclaves]
    at = now or utc_now()
    limit = later(at, within)
    due = [one for one in _expiries(view, names, known or {}) if one.is_due(at, limit)]
    return tuple(sorted(due, key=_order))


def _order(one: Expiry) -> tuple[datetime, str, str]:
    return one.not_after, one.what, one.enclave or ""


def _expiries(view: KeystoreView, names: Iterable[str], known: Mapping[str, Validity]) -> Iterator[Expiry]:
    for role in Role:
        for ca in view.ca_bundle(role):
            yield _expiry(role.label, None, ca.validity)
    if view.has_crl:
        yield _expiry("CRL", None, crl_validity(view))
    for name in names:
        if name in known:
            yield from (_expiry(what, name, known[name]) for what in ("certificate", "permissions"))
        else:
            yield from _enclave_expiries(view, name)


def _enclave_expiries(view: KeystoreView, name: str) -> Iterator[Expiry]:
    directory = layout.enclave_directory(name)
    cert = safe_files.read_if_there(view.root, f"{directory}/{layout.CERT}")
    if cert is not None:
        yield _expiry("certificate", name, read_certificate(cert, f"{directory}/{layout.CERT}").validity)
    signed = safe_files.read_if_there(view.root, f"{directory}/{layout.PERMISSIONS}")
    if signed is not None:
        place = f"{directory}/{layout.PERMISSIONS}"
        yield _expiry(
            "permissions", name, parse_permissions(smime.read(signed, place).document, place).validity
        )


def _expiry(what: str, enclave: str | None, validity: Validity) -> Expiry:
    return Expiry(validity.not_after, what, enclave, validity.not_before)
