"""Questions about public keys in DER: is this signature valid, which kind of key is it."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.types import PublicKeyTypes


@lru_cache(maxsize=16)
def _load(spki: bytes) -> PublicKeyTypes:
    from cryptography.hazmat.primitives.serialization import load_der_public_key

    return load_der_public_key(spki)


def signature_is_valid(spki: bytes, signature: bytes, data: bytes) -> bool:
    """SHA-256 with ECDSA or RSA PKCS#1 v1.5; ``spki`` is the DER SubjectPublicKeyInfo."""
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec, padding, rsa

    key = _load(spki)
    try:
        if isinstance(key, ec.EllipticCurvePublicKey):
            key.verify(signature, data, ec.ECDSA(hashes.SHA256()))
        elif isinstance(key, rsa.RSAPublicKey):
            key.verify(signature, data, padding.PKCS1v15(), hashes.SHA256())
        else:
            return False
    except InvalidSignature:
        return False
    return True


def key_kind(spki: bytes) -> str:
    """``P-256``, ``P-384``, ``RSA-2048`` and so on."""
    from cryptography.hazmat.primitives.asymmetric import ec, rsa

    key = _load(spki)
    if isinstance(key, ec.EllipticCurvePublicKey):
        return {"secp256r1": "P-256", "secp384r1": "P-384"}.get(key.curve.name, key.curve.name)
    return f"RSA-{key.key_size}" if isinstance(key, rsa.RSAPublicKey) else type(key).__name__
