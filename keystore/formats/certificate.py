"""Facts about a certificate, and the one form that a certificate file may have.

Everything is read by ``cryptography``. A file of a keystore is PEM exactly as ``cryptography`` writes it: whatever else
stands in such a file, another reader may take for the certificate.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import cached_property, lru_cache
from typing import Any, TypeVar

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from cryptography.x509.oid import ExtendedKeyUsageOID

from keystore.errors import DamagedKeystoreError
from keystore.formats.validity import Validity

_BLOCK = re.compile(rb"-----BEGIN CERTIFICATE-----\r?\n.*?-----END CERTIFICATE-----\r?\n?", re.DOTALL)
_Extension = TypeVar("_Extension", bound=x509.ExtensionType)
NOT_OUR_FORM = (
    "it is not in the form that secure-keystore writes, so DDS implementations may read something else"
)

UNREADABLE = (
    ValueError,
    TypeError,
    UnsupportedAlgorithm,
    x509.DuplicateExtension,
    x509.InvalidVersion,
    x509.UnsupportedGeneralNameType,
)
"""Exceptions of ``cryptography`` for a certificate, a request or a CRL that it cannot read."""


@dataclass(frozen=True)
class CertificateFacts:
    """A certificate whose fields can all be read; ``read_der`` makes it."""

    certificate: x509.Certificate = field(repr=False)

    def __repr__(self) -> str:
        return f"CertificateFacts({self.common_name!r}, serial={self.serial})"

    @cached_property
    def der(self) -> bytes:
        return self.certificate.public_bytes(Encoding.DER)

    @property
    def pem(self) -> bytes:
        """Return the certificate in PEM."""
        return self.certificate.public_bytes(Encoding.PEM)

    @property
    def serial(self) -> int:
        return self.certificate.serial_number

    @cached_property
    def issuer(self) -> bytes:
        """Return the issuer's name in DER."""
        return self.certificate.issuer.public_bytes()

    @cached_property
    def subject(self) -> bytes:
        """Return the subject's name in DER."""
        return self.certificate.subject.public_bytes()

    @cached_property
    def common_name(self) -> str | None:
        """Return the common name; None unless there is exactly one."""
        found = self.certificate.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)
        return str(found[0].value) if len(found) == 1 else None

    @property
    def name_parts(self) -> int:
        return len(list(self.certificate.subject))

    @cached_property
    def validity(self) -> Validity:
        return Validity(
            time_of(self.certificate, "not_valid_before"), time_of(self.certificate, "not_valid_after")
        )

    @cached_property
    def public_key(self) -> bytes:
        """Return the SubjectPublicKeyInfo in DER."""
        return self.certificate.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)

    def extension(self, kind: type[_Extension]) -> _Extension | None:
        """Return the extension of that class; None without one."""
        try:
            return self.certificate.extensions.get_extension_for_class(kind).value
        except x509.ExtensionNotFound:
            return None

    @property
    def can_sign_mail(self) -> bool:
        """Return True if OpenSSL's S/MIME purpose accepts it: then, below a shared CA, its key can sign permissions."""
        extended, usage = self.extension(x509.ExtendedKeyUsage), self.extension(x509.KeyUsage)
        signs_mail = {ExtendedKeyUsageOID.EMAIL_PROTECTION, ExtendedKeyUsageOID.ANY_EXTENDED_KEY_USAGE}
        if extended is not None and not signs_mail & set(extended):
            return False
        return usage is None or usage.digital_signature or usage.content_commitment

    @property
    def can_certify(self) -> bool:
        """Return True for a CA, and for a certificate whose key may sign certificates or CRLs."""
        constraints, usage = self.extension(x509.BasicConstraints), self.extension(x509.KeyUsage)
        signs = usage is not None and (usage.key_cert_sign or usage.crl_sign)
        return signs or (constraints is not None and constraints.ca)

    @property
    def names_hosts(self) -> bool:
        """Return True if it has alternative names: a TLS client accepts its holder as a server of these hosts."""
        return self.extension(x509.SubjectAlternativeName) is not None


def time_of(value: Any, name: str) -> datetime:
    """Return a date of a certificate or CRL as UTC; cryptography before 42 gives those of RFC 5280 without a zone."""
    if hasattr(value, f"{name}_utc"):
        found: datetime = getattr(value, f"{name}_utc")
        return found
    plain: datetime = getattr(value, name)
    return plain.replace(tzinfo=timezone.utc)


def read_der(data: bytes) -> CertificateFacts:
    """Reads a certificate with all its fields; raises ValueError where one cannot be read."""
    try:
        return _complete(x509.load_der_x509_certificate(data))
    except UNREADABLE as error:
        raise ValueError(str(error)) from error


def _complete(certificate: x509.Certificate) -> CertificateFacts:
    """Read every field: ``cryptography`` reads each only when it is requested."""
    facts = CertificateFacts(certificate)
    _ = facts.issuer, facts.subject, facts.validity, facts.public_key
    _ = certificate.extensions, certificate.signature_hash_algorithm
    return facts


def read_certificate(pem: bytes, place: str = "the certificate") -> CertificateFacts:
    """Reads a file that holds one certificate; raises DamagedKeystoreError for any other content."""
    found = read_certificates(pem, place)
    if len(found) != 1:
        raise DamagedKeystoreError(f"{place} holds {len(found)} certificates, one belongs there")
    return found[0]


def read_certificates(pem: bytes, place: str) -> list[CertificateFacts]:
    """Read a file of certificates; raises DamagedKeystoreError for anything that is not exactly their PEM."""
    found = _read_all(pem)
    if not found:
        raise DamagedKeystoreError(f"{place} is not a usable certificate, or is damaged")
    if b"".join(one.pem for one in found) != pem:
        raise DamagedKeystoreError(f"{place} is not a usable certificate: {NOT_OUR_FORM}")
    return list(found)


@lru_cache(maxsize=2048)  # a launch asks for the same files before each of its processes
def _read_all(pem: bytes) -> tuple[CertificateFacts, ...]:
    """Read every certificate of ``pem``; none if one of them cannot be read."""
    try:
        return tuple(_complete(x509.load_pem_x509_certificate(block)) for block in _BLOCK.findall(pem))
    except UNREADABLE:
        return ()


def given_certificates(pem: bytes, place: str) -> list[CertificateFacts]:
    """Read the certificates of a file that the user names, such as a chain with comments between the blocks.

    It is never used as it stands: what is taken from it is written in the keystore's own form.
    Raises DamagedKeystoreError for a file without any.
    """
    found = _read_all(pem)
    if not found:
        raise DamagedKeystoreError(f"{place} is not a usable certificate in PEM")
    return list(found)
