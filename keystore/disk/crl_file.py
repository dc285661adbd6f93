"""The CRL on disk: its dates and number (cheap: asked before a launch), and whom it lists."""

from __future__ import annotations

from datetime import datetime, timezone
from typing import TYPE_CHECKING

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, printable
from keystore.formats import der
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.validity import Validity

if TYPE_CHECKING:
    from cryptography import x509

_CRL_NUMBER = der.object_identifier("2.5.29.20")
_EXTENSIONS = 0xA0


def crl_validity(view: KeystoreView) -> Validity:
    """thisUpdate and nextUpdate of the CRL (RFC 5280 section 5.1). Raises DamagedKeystoreError."""
    try:
        times = [part for part in _fields(view) if part.tag in (der.UTC_TIME, der.GENERALIZED_TIME)]
        return Validity(der.time_value(times[0]), der.time_value(times[1]))
    except (IndexError, der.DerError):
        raise DamagedKeystoreError(f"{printable(view.root / layout.CRL)} is not a CRL with an end") from None


def crl_number(view: KeystoreView) -> int:
    """CRLNumber (RFC 5280 section 5.2.3), 0 without one. The signature is not checked. Raises DamagedKeystoreError."""
    try:
        holder = next((part for part in _fields(view) if part.tag == _EXTENSIONS), None)
        extensions = holder.children()[0].children() if holder is not None else []
        for extension in extensions:
            name, *_, value = extension.children()
            if name.whole == _CRL_NUMBER:
                return int.from_bytes(der.parse(value.content).content, "big")
        return 0
    except (IndexError, ValueError):
        raise DamagedKeystoreError(f"{printable(view.root / layout.CRL)} is not a readable CRL") from None


def _fields(view: KeystoreView) -> list[der.Element]:
    """Of TBSCertList."""
    body = safe_files.read(view.root, layout.CRL).split(b"-----BEGIN X509 CRL-----")[1].split(b"-----END")[0]
    return der.parse(der.from_base64(body)).children()[0].children()


def crl_problem(view: KeystoreView, register: Register | None, now: datetime) -> str | None:
    """Why the CRL on disk is not the one to use; None when it is, or when there is rightly none.

    Without a register (a host that signs nothing) only its dates count. Reads dates and number, not the signature.
    """
    if register is not None and register.crl_published != view.has_crl:
        return (
            "the CRL is missing" if register.crl_published else "there is a CRL that was not published here"
        )
    if not view.has_crl:
        return None
    try:
        if not crl_validity(view).covers(now):
            return "the CRL has ended"  # every participant would be refused
        if register is not None and crl_number(view) != register.crl_number:
            return "the CRL is not the one published last"
    except DamagedKeystoreError:
        return "the CRL cannot be read"
    return None


def revoked_serials(view: KeystoreView) -> dict[int, datetime]:
    """Serial -> date of revocation, from a CRL whose signature was checked; empty without one."""
    if not view.has_crl:
        return {}
    crl = load_crl(view)
    return {entry.serial_number: _revoked_at(entry) for entry in crl}


def _revoked_at(entry: x509.RevokedCertificate) -> datetime:
    """cryptography before 42 gives the time of RFC 5280, which is UTC, without a zone."""
    if hasattr(entry, "revocation_date_utc"):
        return entry.revocation_date_utc
    return entry.revocation_date.replace(tzinfo=timezone.utc)


def load_crl(view: KeystoreView) -> x509.CertificateRevocationList:
    """Raises DamagedKeystoreError when it is unreadable or not signed by the identity CA."""
    from cryptography import x509
    from cryptography.exceptions import UnsupportedAlgorithm

    place = printable(view.root / layout.CRL)
    try:
        crl = x509.load_pem_x509_crl(safe_files.read(view.root, layout.CRL))
        key = x509.load_der_x509_certificate(view.ca(Role.IDENTITY).der).public_key()
        valid = crl.is_signature_valid(key)  # type: ignore[arg-type]
    except (ValueError, TypeError, UnsupportedAlgorithm):
        raise DamagedKeystoreError(f"{place} is not a readable CRL; remove it and revoke again") from None
    if not valid:
        raise DamagedKeystoreError(f"{place} is not signed by the identity CA; remove it and revoke again")
    return crl
