"""Questions about keys: is this signature valid, of which kind is it, is this the private key of a certificate."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, padding, rsa
from cryptography.hazmat.primitives.serialization import load_der_public_key

from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError, SigningUnavailableError
from keystore.formats.certificate import CertificateFacts
from keystore.signing.private_key import key_pem, load_private_key, spki

_CURVES = {"secp224r1": "P-224", "secp256r1": "P-256", "secp384r1": "P-384", "secp521r1": "P-521"}


def fingerprints(named: Iterable[str]) -> frozenset[str]:
    """Return SHA-256 fingerprints, which openssl writes with colons, in the form of ``fingerprint``.

    Raises:
        InvalidInputError: A text is not a fingerprint.
    """
    return frozenset(map(_fingerprint, named))


def _fingerprint(text: str) -> str:
    plain = text.rpartition("=")[2].replace(":", "").lower()
    if re.fullmatch("[0-9a-f]{64}", plain) is None:
        raise InvalidInputError(
            f"{quoted(text)} is not the SHA-256 fingerprint of a CA: 64 hex digits, with or without colons\n"
            "try: openssl x509 -noout -fingerprint -sha256 -in KEYSTORE/public/permissions_ca.cert.pem"
        )
    return plain


def signature_is_valid(key: Any, signature: bytes, data: bytes, digest: hashes.HashAlgorithm) -> bool:
    """Checks ECDSA or RSA PKCS#1 v1.5; a signature by another kind of key is not valid."""
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


def key_kind(public_key: bytes) -> str:
    """Returns ``P-256``, ``P-384``, ``RSA-2048`` and so on, of a SubjectPublicKeyInfo in DER."""
    key = _loaded(public_key)
    if isinstance(key, ec.EllipticCurvePublicKey):
        return _CURVES.get(key.curve.name, key.curve.name)
    if key is None:
        return "damaged"
    return f"RSA-{key.key_size}" if isinstance(key, rsa.RSAPublicKey) else type(key).__name__


def cyclone_takes(public_key: bytes) -> bool:
    """Returns whether Cyclone DDS takes the key for an identity or its CA: it goes by the size. Fast DDS takes any,
    and for a permissions CA both do."""
    key = _loaded(public_key)
    if isinstance(key, rsa.RSAPublicKey):
        return key.key_size == 2048
    return isinstance(key, ec.EllipticCurvePublicKey) and key.key_size == 256


def is_weak(public_key: bytes) -> bool:
    """Returns whether the key has less than the 112 bits of security of NIST SP 800-57, or a curve below P-256."""
    key = _loaded(public_key)
    if isinstance(key, rsa.RSAPublicKey):
        return key.key_size < 2048
    return isinstance(key, ec.EllipticCurvePublicKey) and key.key_size < 256


def _loaded(public_key: bytes) -> Any:
    try:
        return load_der_public_key(public_key)
    except (ValueError, UnsupportedAlgorithm):
        return None


@lru_cache(maxsize=2048)  # a launch asks of the same certificates before each of its processes
def issued_by(facts: CertificateFacts, ca: CertificateFacts) -> bool:
    """Returns whether ``ca`` signed this certificate: name and signature."""
    digest = facts.certificate.signature_hash_algorithm
    if facts.issuer != ca.subject or digest is None:
        return False
    signed = facts.certificate.tbs_certificate_bytes
    return signature_is_valid(ca.certificate.public_key(), facts.certificate.signature, signed, digest)


def fingerprint(der_bytes: bytes) -> str:
    """Returns the SHA-256 in hex: of a certificate, a public key or a document, as the register names them."""
    return hashlib.sha256(der_bytes).hexdigest()


def is_our_form(pem: bytes) -> bool:
    """Returns whether a ``key.pem`` is exactly a private key as it is written here."""
    try:
        return key_pem(load_private_key(pem, None, "the key")) == pem
    except SigningUnavailableError:
        return False


def key_matches(pem: bytes, facts: CertificateFacts) -> bool:
    """Returns whether the file is exactly the private key of the certificate."""
    if not is_our_form(pem):
        return False
    key = load_private_key(pem, None, "the key")
    if isinstance(key, ec.EllipticCurvePrivateKey):
        # From the private half: a file may state another public half beside it.
        key = ec.derive_private_key(key.private_numbers().private_value, key.curve)
    return spki(key.public_key()) == facts.public_key
