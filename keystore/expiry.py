"""What of a keystore ends when. Reads only, without ``cryptography``: a launch asks this every time."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from keystore import certificate, der, layout, safe_files, smime
from keystore.enclave_name import validate_enclave_name
from keystore.errors import DamagedKeystore, InvalidInput, printable
from keystore.role import Role
from keystore.validity import Validity, later, parse_moment, utc_now
from keystore.view import KeystoreView, resolve_root

_DATES = re.compile(rb"<not_(before|after)>\s*([^<]{1,40}?)\s*</not_")


@dataclass(frozen=True, slots=True)
class Expiry:
    """``what``: ``identity CA``, ``permissions CA``, ``certificate``, ``permissions`` or ``CRL``; ``enclave``
    for the two that belong to one."""

    not_after: datetime
    what: str
    enclave: str | None
    not_before: datetime

    def ends_within(self, now: datetime, margin: timedelta) -> bool:
        return self.not_after <= later(now, margin)

    def is_valid(self, now: datetime) -> bool:
        return self.not_before <= now <= self.not_after

    @property
    def subject(self) -> str:
        return f"{self.what} of {self.enclave}" if self.enclave else self.what


@dataclass(frozen=True, slots=True)
class StatusReport:
    """``expiries``: everything with an end, the earliest first."""

    keystore: Path
    now: datetime
    enclaves: tuple[str, ...]
    expiries: tuple[Expiry, ...]

    def due(self, margin: timedelta) -> tuple[Expiry, ...]:
        """What has ended, has not begun, or ends within ``margin``."""
        return tuple(
            one for one in self.expiries if one.ends_within(self.now, margin) or not one.is_valid(self.now)
        )


def status(keystore: Path | str, *, now: datetime | None = None) -> StatusReport:
    """Raises NotAKeystore, DamagedKeystore for what cannot be read."""
    view = KeystoreView(resolve_root(keystore))
    view.require_complete()
    return _report(view, view.enclaves(), now or utc_now())


def expires_soon(
    keystore: Path | str,
    within: timedelta,
    *,
    enclaves: Iterable[str] | None = None,
    now: datetime | None = None,
) -> tuple[Expiry, ...]:
    """What ends within ``within`` (or has ended), for the CAs and these enclaves (None: all)."""
    view = KeystoreView(resolve_root(keystore))
    view.require_complete()
    names = view.enclaves() if enclaves is None else [validate_enclave_name(name) for name in enclaves]
    return _report(view, names, now or utc_now()).due(within)


def _report(view: KeystoreView, names: list[str], now: datetime) -> StatusReport:
    ordered = sorted(_expiries(view, names), key=lambda one: (one.not_after, one.what, one.enclave or ""))
    return StatusReport(view.root, now, tuple(names), tuple(ordered))


def _expiries(view: KeystoreView, names: Iterable[str]) -> Iterator[Expiry]:
    for role in Role:
        for ca in view.ca_bundle(role):
            yield _expiry(role.value.replace("_ca", " CA"), None, ca.validity)
    if view.has_crl:
        yield _expiry("CRL", None, crl_validity(view))
    for name in names:
        yield from _enclave_expiries(view, name)


def _enclave_expiries(view: KeystoreView, name: str) -> Iterator[Expiry]:
    directory = layout.enclave_directory(name)
    cert = safe_files.read_if_there(view.root, f"{directory}/{layout.CERT}")
    if cert is not None:
        try:
            yield _expiry("certificate", name, certificate.read_pem(cert).validity)
        except der.DerError as error:
            raise DamagedKeystore(f"{directory}/{layout.CERT}: {error}") from None
    signed = safe_files.read_if_there(view.root, f"{directory}/{layout.PERMISSIONS}")
    if signed is not None:
        yield _expiry("permissions", name, _permissions_validity(signed, f"{directory}/{layout.PERMISSIONS}"))


def _expiry(what: str, enclave: str | None, validity: Validity) -> Expiry:
    return Expiry(validity.not_after, what, enclave, validity.not_before)


def _permissions_validity(signed: bytes, place: str) -> Validity:
    """Of the first grant, the only one that implementations use."""
    found = dict(reversed(_DATES.findall(smime.read(signed, place).document)))
    try:
        return Validity(parse_moment(found[b"before"].decode()), parse_moment(found[b"after"].decode()))
    except (KeyError, UnicodeDecodeError, InvalidInput):
        raise DamagedKeystore(f"{place} states no validity") from None


def crl_validity(view: KeystoreView) -> Validity:
    """thisUpdate and nextUpdate of the CRL (RFC 5280 section 5.1)."""
    pem = safe_files.read(view.root, layout.CRL)
    place = printable(view.root / layout.CRL)
    try:
        body = pem.split(b"-----BEGIN X509 CRL-----")[1].split(b"-----END")[0]
        fields = der.parse(der.from_base64(body)).children()[0].children()
        times = [part for part in fields if part.tag in (der.UTC_TIME, der.GENERALIZED_TIME)]
        return Validity(der.time_value(times[0]), der.time_value(times[1]))
    except (IndexError, der.DerError):
        raise DamagedKeystore(f"{place} is no CRL with an end") from None
