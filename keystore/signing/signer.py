"""Where a CA's key lives: one small interface, a file and a PKCS#11 token behind it.

    Signer.sign(data) -> signature      the only thing a CA key is ever asked

``keystore.signing.authority`` makes certificates with it, ``keystore.signing.smime`` signed documents. Private keys and
passphrases stay inside these objects: no ``repr``, message or attribute shows them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from keystore.errors import SigningUnavailableError

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric import ec, rsa

    from keystore.signing.ca_access import CaAccess, Secret

    PublicKey = ec.EllipticCurvePublicKey | rsa.RSAPublicKey
    PrivateKey = ec.EllipticCurvePrivateKey | rsa.RSAPrivateKey


class Signer(Protocol):
    """Signs with SHA-256: ECDSA in DER form, or RSA PKCS#1 v1.5, after the kind of ``public_key()``."""

    def public_key(self) -> PublicKey: ...

    def sign(self, data: bytes) -> bytes:
        """The signature over ``data``; raises SigningUnavailableError."""


class FileSigner:
    """A key in memory, loaded from a PEM file of the keystore or just generated."""

    __slots__ = ("_ec_algorithm", "_key")

    def __init__(self, key: PrivateKey):
        from cryptography.hazmat.primitives import hashes
        from cryptography.hazmat.primitives.asymmetric import ec

        self._key = key
        self._ec_algorithm = ec.ECDSA(hashes.SHA256())

    @property
    def private_key(self) -> PrivateKey:
        """For ``cryptography``'s certificate builder, which signs faster with its own key objects."""
        return self._key

    def public_key(self) -> PublicKey:
        return self._key.public_key()

    def sign(self, data: bytes) -> bytes:
        from cryptography.hazmat.primitives import hashes
        from cryptography.hazmat.primitives.asymmetric import ec, padding

        if isinstance(self._key, ec.EllipticCurvePrivateKey):
            return self._key.sign(data, self._ec_algorithm)
        return self._key.sign(data, padding.PKCS1v15(), hashes.SHA256())


def load_private_key(pem: bytes, passphrase: Secret | None, place: str) -> PrivateKey:
    """The EC or RSA key of a PEM file (PKCS#8 or SEC1), encrypted or not.

    Raises SigningUnavailableError with ``place`` and without any of the content.
    """
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.asymmetric import ec, rsa

    encrypted = b"ENCRYPTED" in pem
    if encrypted and passphrase is None:
        raise SigningUnavailableError(
            f"{place} is encrypted; give its passphrase with --passphrase-file, -fd or -env"
        )
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


def is_token_uri(reference: bytes) -> bool:
    """Whether a key file holds the ``pkcs11:`` URI of a key in a token instead of a key."""
    return reference.lstrip().startswith(b"pkcs11:")


def open_signer(reference: bytes, place: str, access: CaAccess) -> Signer:
    """The signer behind a key file of ``private/``: PEM, or the ``pkcs11:`` URI of a ``.p11`` file."""
    if is_token_uri(reference):
        from keystore.signing.pkcs11_signer import Pkcs11Signer

        return Pkcs11Signer.open(
            reference.split()[0].decode("ascii", "replace"), access.pin, access.environment
        )
    return FileSigner(load_private_key(reference, access.passphrase, place))
