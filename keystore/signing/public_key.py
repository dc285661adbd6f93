"""Questions about public keys in DER: is this signature valid, of which kind is it, is this its private key."""

from __future__ import annotations

import binascii
import hashlib
from collections.abc import Iterable
from functools import lru_cache
from typing import TYPE_CHECKING

from keystore.errors import SigningUnavailableError
from keystore.formats import der
from keystore.formats.certificate import CertificateFacts
from keystore.signing.authority import spki

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.types import PublicKeyTypes


# Imported CAs may certify themselves with more than SHA-256.
_ECDSA_SHA384 = der.encode(der.SEQUENCE, der.object_identifier("1.2.840.10045.4.3.3"))
_RSA_SHA384, _RSA_SHA512 = (
    der.encode(der.SEQUENCE, der.object_identifier(f"1.2.840.113549.1.1.{arc}"), der.encode(der.NULL))
    for arc in (12, 13)
)


CYCLONE_KINDS = ("P-256", "RSA-2048")
"""The keys that Cyclone DDS takes; Fast DDS takes any."""


@lru_cache(maxsize=16)
def _load(spki: bytes) -> PublicKeyTypes:
    from cryptography.hazmat.primitives.serialization import load_der_public_key

    return load_der_public_key(spki)


def _loaded(spki: bytes) -> PublicKeyTypes | None:
    """None for what is not a public key, or one of a kind that nobody knows."""
    from cryptography.exceptions import UnsupportedAlgorithm

    try:
        return _load(spki)
    except (ValueError, UnsupportedAlgorithm):
        return None


def fingerprints(named: Iterable[str]) -> frozenset[str]:
    """SHA-256 as somebody wrote them, such as openssl does with colons, in the form of ``fingerprint``."""
    return frozenset(one.replace(":", "").lower() for one in named)


def signature_is_valid(spki: bytes, signature: bytes, data: bytes, algorithm: bytes | None = None) -> bool:
    """ECDSA or RSA PKCS#1 v1.5; ``spki`` is the DER SubjectPublicKeyInfo.

    ``algorithm`` is the DER AlgorithmIdentifier of a certificate; None and unknown ones count as SHA-256.
    """
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec, padding, rsa

    key = _loaded(spki)
    larger = {_ECDSA_SHA384: hashes.SHA384(), _RSA_SHA384: hashes.SHA384(), _RSA_SHA512: hashes.SHA512()}
    digest = larger.get(algorithm or b"", hashes.SHA256())
    try:
        if isinstance(key, ec.EllipticCurvePublicKey):
            key.verify(signature, data, ec.ECDSA(digest))
        elif isinstance(key, rsa.RSAPublicKey):
            key.verify(signature, data, padding.PKCS1v15(), digest)
        else:
            return False
    except InvalidSignature:
        return False
    return True


def key_kind(spki: bytes) -> str:
    """``P-256``, ``P-384``, ``RSA-2048`` and so on."""
    from cryptography.hazmat.primitives.asymmetric import ec, rsa

    key = _loaded(spki)
    if isinstance(key, ec.EllipticCurvePublicKey):
        return {"secp256r1": "P-256", "secp384r1": "P-384"}.get(key.curve.name, key.curve.name)
    if key is None:
        return "damaged"
    return f"RSA-{key.key_size}" if isinstance(key, rsa.RSAPublicKey) else type(key).__name__


def issued_by(facts: CertificateFacts, ca: CertificateFacts) -> bool:
    """Whether ``ca`` signed this certificate: name and signature."""
    parts = der.parse(facts.der).children()
    if len(parts) != 3 or not facts.names_issuer(ca):
        return False
    body, algorithm, signature = parts
    # A BIT STRING starts with the count of unused bits.
    return signature_is_valid(ca.public_key, signature.content[1:], body.whole, algorithm.whole)


def fingerprint(der_bytes: bytes) -> str:
    """SHA-256 in hex: of a certificate, a public key or a document, as the register names them."""
    return hashlib.sha256(der_bytes).hexdigest()


def key_matches(key_pem: bytes, facts: CertificateFacts) -> bool:
    """Whether the private key is that of the certificate. A launch asks it of every enclave.

    Mostly the key's file carries the certificate's public point (PKCS#8 and SEC1 files of OpenSSL do).

    Only when it does not, or for RSA, ``cryptography`` has to load the key.
    """
    point = facts.public_key[-65:]
    try:
        body = key_pem.split(b"-----", 4)[2]
        if point[0] == 4 and point in binascii.a2b_base64(body):
            return True
    except (IndexError, binascii.Error):
        pass
    return _key_matches_slowly(key_pem, facts)


def _key_matches_slowly(key_pem: bytes, facts: CertificateFacts) -> bool:
    from keystore.signing.identity import public_half

    try:
        return spki(public_half(key_pem, "the enclave's key")) == facts.public_key
    except SigningUnavailableError:
        return False
