"""The request (PKCS#10) of a certificate for a key that was made elsewhere, and the key that it is for."""

from __future__ import annotations

from typing import NamedTuple, cast

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization

from keystore.errors import DamagedKeystoreError
from keystore.formats.certificate import UNREADABLE
from keystore.signing.private_key import PrivateKey, PublicKey, load_private_key, spki
from keystore.signing.public_key import key_kind
from keystore.signing.token_key import builder_key


def public_half(pem: bytes, place: str) -> PublicKey:
    """Return the public key of ``key.pem``, or of the request in its place. Raises SigningUnavailableError."""
    if b"CERTIFICATE REQUEST" in pem:
        return request_key(pem, place).key
    return load_private_key(pem, None, place).public_key()


USABLE_KINDS = ("P-256", "RSA-2048")
"""The kinds of DDS-Security 1.1 (section 9.3.2.1). Cyclone DDS accepts other curves of 256 bits, too."""


class RequestedKey(NamedTuple):
    """The key and name of a certificate request. ``spki``: DER of the SubjectPublicKeyInfo."""

    key: PublicKey
    spki: bytes
    common_name: str


def new_request(common_name: str, key: PrivateKey) -> bytes:
    """Make a PEM request for ``key``, signed by it."""
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, common_name)])
    builder = x509.CertificateSigningRequestBuilder().subject_name(subject)
    made = builder.sign(builder_key(key), hashes.SHA256())
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
