"""Private keys, as ``cryptography`` has them: made, loaded and written. Those in a token are ``token_key``'s.

No message shows a key or a passphrase."""

from __future__ import annotations

from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, padding, rsa

from keystore.errors import SigningUnavailableError
from keystore.signing.ca_access import Secret

PublicKey = ec.EllipticCurvePublicKey | rsa.RSAPublicKey
PrivateKey = ec.EllipticCurvePrivateKey | rsa.RSAPrivateKey


def new_key() -> ec.EllipticCurvePrivateKey:
    """Make a private key, in memory; P-256, since Cyclone DDS takes no other elliptic curve."""
    return ec.generate_private_key(ec.SECP256R1())


def signature(key: PrivateKey, data: bytes) -> bytes:
    """Sign with SHA-256: ECDSA in DER form, or RSA PKCS#1 v1.5, after the kind of ``key``.

    Raises SigningUnavailableError if a token refuses.
    """
    if isinstance(key, ec.EllipticCurvePrivateKey):
        return key.sign(data, ec.ECDSA(hashes.SHA256()))
    return key.sign(data, padding.PKCS1v15(), hashes.SHA256())


def spki(key: PublicKey) -> bytes:
    """Returns the DER of a public key (SubjectPublicKeyInfo, RFC 5280 section 4.1)."""
    return key.public_bytes(serialization.Encoding.DER, serialization.PublicFormat.SubjectPublicKeyInfo)


def key_pem(key: PrivateKey, passphrase: Secret | None = None) -> bytes:
    """Returns the key as PKCS#8 PEM, encrypted when a passphrase is given."""
    protection: serialization.KeySerializationEncryption = serialization.NoEncryption()
    if passphrase is not None:
        protection = serialization.BestAvailableEncryption(passphrase.value())
    return key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, protection)


def load_private_key(pem: bytes, passphrase: Secret | None, place: str) -> PrivateKey:
    """Load the EC or RSA key of a PEM file, encrypted or not. Raises SigningUnavailableError without its content."""
    encrypted = b"ENCRYPTED" in pem
    if encrypted and passphrase is None:
        raise SigningUnavailableError(
            f"{place} is encrypted; give its passphrase with --ca-passphrase-file, -fd or -env"
        )
    if encrypted and passphrase is not None:
        passphrase.value()  # reports what is wrong with it
    try:
        key = serialization.load_pem_private_key(
            pem, passphrase.value() if encrypted and passphrase else None
        )
    except (ValueError, TypeError, UnsupportedAlgorithm):
        wrong = (
            "cannot be decrypted; is the passphrase right?" if encrypted else "holds no usable private key"
        )
        raise SigningUnavailableError(f"{place} {wrong}") from None
    if not isinstance(key, (ec.EllipticCurvePrivateKey, rsa.RSAPrivateKey)):
        raise SigningUnavailableError(
            f"{place} is neither an EC nor an RSA key; DDS-Security knows only these"
        )
    return key
