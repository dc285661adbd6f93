"""The CRL on disk: its dates and number, and whom it lists."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from datetime import datetime
from functools import lru_cache
from typing import NamedTuple

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives.serialization import Encoding

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError
from keystore.formats.certificate import NOT_OUR_FORM, UNREADABLE, CertificateFacts, time_of
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.validity import Validity


def crl_validity(view: KeystoreView) -> Validity:
    """Return thisUpdate and nextUpdate of the CRL (RFC 5280 section 5.1). Raises DamagedKeystoreError."""
    crl = load_crl(view)
    return Validity(time_of(crl, "last_update"), time_of(crl, "next_update"))


def crl_number(view: KeystoreView) -> int:
    """Return the CRLNumber (RFC 5280 section 5.2.3), 0 without one. Raises DamagedKeystoreError."""
    return _number(load_crl(view))


def _number(crl: x509.CertificateRevocationList) -> int:
    try:
        return crl.extensions.get_extension_for_class(x509.CRLNumber).value.crl_number
    except x509.ExtensionNotFound:
        return 0


def crl_problem(view: KeystoreView, register: Register | None, now: datetime) -> str | None:
    """Return why the CRL on disk is not the one to use; None if it is, or if there should be none.

    Without a register (a host that signs nothing) it only has to be whole, signed, and of today.
    """
    if register is not None and register.crl_published != view.has_crl:
        return (
            "the CRL is missing" if register.crl_published else "there is a CRL that was not published here"
        )
    if not view.has_crl:
        return None
    try:
        if not crl_validity(view).covers(now):
            return "the CRL has expired"  # every participant would be refused
        if register is not None and crl_number(view) != register.crl_number:
            return "the CRL is not the one published last"
    except DamagedKeystoreError:
        return "the CRL cannot be read"
    return None


def revoked_serials(view: KeystoreView) -> dict[int, datetime]:
    """Return serial -> date of revocation, from a CRL whose signature was checked; empty without one."""
    if not view.has_crl:
        return {}
    return {entry.serial_number: time_of(entry, "revocation_date") for entry in load_crl(view)}


class ListedCrl(NamedTuple):
    """A CRL that one of our identity CAs signed. ``issuer``: SHA-256 of that CA's certificate."""

    place: str
    issuer: CertificateFacts
    number: int
    revoked: dict[int, datetime]


def crls_in(view: KeystoreView, issuers: Sequence[CertificateFacts] | None = None) -> list[ListedCrl]:
    """Return every CRL in the tree, whoever put it there and in whatever form.

    Args:
        view: The keystore. CRLs lie in ``public/`` and in the enclaves, where an rmw reads them.
        issuers: The identity CAs whose CRLs count. None stands for those of the trust file.
    """
    enclaves = view.enclaves() if os.path.isdir(view.root / layout.ENCLAVES) else ()
    found = []
    for place in (layout.CRL, *(layout.enclave_file(name, layout.ENCLAVE_CRL) for name in enclaves)):
        if safe_files.link_target(view.root, place) is not None:
            continue
        pem = safe_files.read_if_there(view.root, place)
        if pem is None:
            continue
        listed = listed_in(pem, view.ca_bundle(Role.IDENTITY) if issuers is None else issuers, place)
        if listed is not None:
            found.append(listed)
    return found


def listed_in(pem: bytes, issuers: Iterable[CertificateFacts], place: str) -> ListedCrl | None:
    """Return the CRL in a file if one of ``issuers`` signed it."""
    crl = _parsed(pem)
    issuer = next((ca for ca in issuers if crl is not None and _is_signed(pem, ca)), None)
    if crl is None or issuer is None:
        return None
    revoked = {entry.serial_number: time_of(entry, "revocation_date") for entry in crl}
    return ListedCrl(place, issuer, _number(crl), revoked)


def forgotten(known: ListedCrl | None, coming: ListedCrl | None) -> tuple[int, ...]:
    """Return the serial numbers of ``known`` that a later list lacks: a CA's later lists have all that it revoked."""
    later = coming.revoked if coming is not None else {}
    return tuple(sorted(set(known.revoked) - set(later))) if known is not None else ()


def load_crl(view: KeystoreView) -> x509.CertificateRevocationList:
    """Read the CRL. Raises DamagedKeystoreError unless the file is exactly a CRL that the identity CA signed."""
    return read_crl(
        safe_files.read(view.root, layout.CRL), view.ca(Role.IDENTITY), quoted(view.root / layout.CRL)
    )


def read_crl(pem: bytes, ca: CertificateFacts, place: str) -> x509.CertificateRevocationList:
    """Read a file that holds one CRL by ``ca`` with a nextUpdate, and nothing else. Raises DamagedKeystoreError."""
    crl = _parsed(pem)
    if crl is None:
        raise DamagedKeystoreError(f"{place} is not a readable CRL; remove it and revoke again")
    if not is_crl(pem):
        raise DamagedKeystoreError(f"{place} is not a CRL as it should be: {NOT_OUR_FORM}")
    if not _is_signed(pem, ca):
        raise DamagedKeystoreError(f"{place} is not signed by the identity CA; remove it and revoke again")
    return crl


def is_crl(pem: bytes) -> bool:
    """Return True if a file is exactly one CRL, by any CA."""
    crl = _parsed(pem)
    return crl is not None and crl.public_bytes(Encoding.PEM) == pem


@lru_cache(maxsize=16)  # a launch asks for the same file before each of its processes
def _parsed(pem: bytes) -> x509.CertificateRevocationList | None:
    try:
        crl = x509.load_pem_x509_crl(pem)
        _ = crl.issuer, crl.extensions, time_of(crl, "last_update"), time_of(crl, "next_update")
        _ = [time_of(entry, "revocation_date") for entry in crl]
    except (AttributeError, *UNREADABLE):
        return None
    return crl


@lru_cache(maxsize=16)
def _is_signed(pem: bytes, ca: CertificateFacts) -> bool:
    crl = _parsed(pem)
    assert crl is not None, "parsed before"
    try:
        key = ca.certificate.public_key()
        return crl.issuer == ca.certificate.subject and crl.is_signature_valid(key)  # type: ignore[arg-type]
    except (TypeError, ValueError, UnsupportedAlgorithm):
        return False
