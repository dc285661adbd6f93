"""The CRL in force: from when until when. Cheap: asked before a launch."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView

if TYPE_CHECKING:
    from cryptography import x509
from keystore.errors import DamagedKeystore, printable
from keystore.formats import der
from keystore.formats.role import Role
from keystore.formats.validity import Validity


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


def revoked_serials(view: KeystoreView) -> dict[int, datetime]:
    """Serial -> date of revocation, from a CRL whose signature was checked; empty without one."""
    if not view.has_crl:
        return {}
    crl = load_crl(view)
    return {entry.serial_number: entry.revocation_date_utc for entry in crl}


def load_crl(view: KeystoreView) -> x509.CertificateRevocationList:
    """Raises DamagedKeystore when it is unreadable or not signed by the identity CA."""
    from cryptography import x509
    from cryptography.exceptions import UnsupportedAlgorithm

    place = printable(view.root / layout.CRL)
    try:
        crl = x509.load_pem_x509_crl(safe_files.read(view.root, layout.CRL))
        key = x509.load_der_x509_certificate(view.ca(Role.IDENTITY).der).public_key()
        valid = crl.is_signature_valid(key)  # type: ignore[arg-type]
    except (ValueError, TypeError, UnsupportedAlgorithm):
        raise DamagedKeystore(f"{place} is no readable CRL; remove it and revoke again") from None
    if not valid:
        raise DamagedKeystore(f"{place} is not signed by the identity CA; remove it and revoke again")
    return crl
