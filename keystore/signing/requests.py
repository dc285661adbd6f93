"""Certificate requests (PKCS#10, RFC 2986): made with a host's key, checked where the CA is. Bytes in, bytes out."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from keystore.errors import DamagedKeystoreError
from keystore.signing.authority import signing_key, spki
from keystore.signing.public_key import key_kind
from keystore.signing.signer import Signer

if TYPE_CHECKING:
    from keystore.signing.signer import PublicKey

USABLE_KINDS = frozenset({"P-256", "P-384", "RSA-2048"})


class RequestedKey(NamedTuple):
    """``spki``: DER of the SubjectPublicKeyInfo."""

    key: PublicKey
    spki: bytes
    common_name: str


def new_request(common_name: str, signer: Signer) -> bytes:
    """A PEM request for the key of ``signer``, signed by it."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization

    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, common_name)])
    builder = x509.CertificateSigningRequestBuilder().subject_name(subject)
    made = builder.sign(signing_key(signer), hashes.SHA256())
    return made.public_bytes(serialization.Encoding.PEM)


def request_key(pem: bytes, place: str) -> RequestedKey:
    """The key that a request asks for; raises DamagedKeystoreError unless the request is signed by that very key."""
    from cryptography import x509
    from cryptography.exceptions import UnsupportedAlgorithm

    try:
        found = x509.load_pem_x509_csr(pem)
        if not found.is_signature_valid:
            raise DamagedKeystoreError(f"{place} is not signed by the key that it is for")
        key = found.public_key()
        names = found.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)
        common_name = str(names[0].value) if len(names) == 1 else ""
        der = spki(key)  # type: ignore[arg-type]
    except (ValueError, TypeError, UnsupportedAlgorithm):
        raise DamagedKeystoreError(f"{place} is not a certificate request") from None
    if key_kind(der) not in USABLE_KINDS:
        raise DamagedKeystoreError(
            f"{place} is for a {key_kind(der)} key; DDS-Security takes P-256 and RSA-2048"
        )
    return RequestedKey(key, der, common_name)  # type: ignore[arg-type]
