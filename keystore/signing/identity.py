"""An enclave's key, its certificate from an identity CA, and the request (PKCS#10) of a key made elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, cast

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization

from keystore.errors import DamagedKeystoreError
from keystore.formats.certificate import UNREADABLE, CertificateFacts
from keystore.formats.validity import Validity
from keystore.signing.authority import IdentityIssuer, new_key
from keystore.signing.public_key import key_kind
from keystore.signing.signer import (
    FileSigner,
    PublicKey,
    Signer,
    builder_key,
    key_pem,
    load_private_key,
    spki,
)


@dataclass(frozen=True, slots=True)
class Identity:
    """A certificate, and the key file that was made for it; None when an existing key was certified."""

    facts: CertificateFacts
    key: bytes | None = field(default=None, repr=False)

    @property
    def cert(self) -> bytes:
        """Return the content of ``cert.pem``."""
        return self.facts.pem


def new_identity(issuer: IdentityIssuer, common_name: str, validity: Validity) -> Identity:
    """Make a key pair, and a certificate for it from ``issuer``."""
    signer = new_key()
    return Identity(issuer.issue(common_name, signer.public_key(), validity), key_pem(signer))


def public_half(pem: bytes, place: str) -> PublicKey:
    """Return the public key of ``key.pem``, or of the request in its place. Raises SigningUnavailableError."""
    if b"CERTIFICATE REQUEST" in pem:
        return request_key(pem, place).key
    return FileSigner(load_private_key(pem, None, place)).public_key()


USABLE_KINDS = frozenset({"P-256", "P-384", "RSA-2048"})


class RequestedKey(NamedTuple):
    """The key and name of a certificate request. ``spki``: DER of the SubjectPublicKeyInfo."""

    key: PublicKey
    spki: bytes
    common_name: str


def new_request(common_name: str, signer: Signer) -> bytes:
    """Make a PEM request for the key of ``signer``, signed by it."""
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, common_name)])
    builder = x509.CertificateSigningRequestBuilder().subject_name(subject)
    made = builder.sign(builder_key(signer), hashes.SHA256())
    return made.public_bytes(serialization.Encoding.PEM)


def request_key(pem: bytes, place: str) -> RequestedKey:
    """Return the key that a request is for; raises DamagedKeystoreError unless that very key signed the request."""
    try:
        found = x509.load_pem_x509_csr(pem)
        if not found.is_signature_valid:
            raise DamagedKeystoreError(f"{place} is not signed by the key that it is for")
        key = cast(PublicKey, found.public_key())  # any other kind is refused below
        names = found.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)
        common_name = str(names[0].value) if len(names) == 1 else ""
        der = spki(key)
    except UNREADABLE:
        raise DamagedKeystoreError(f"{place} is not a certificate request") from None
    if key_kind(der) not in USABLE_KINDS:
        raise DamagedKeystoreError(
            f"{place} is for a {key_kind(der)} key; DDS-Security takes P-256 and RSA-2048"
        )
    return RequestedKey(key, der, common_name)
