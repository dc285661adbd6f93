"""Where a CA's key lives: ``Signer.sign`` is the only use of a CA key, in a file or a PKCS#11 token.

Private keys and passphrases stay inside these objects: no ``repr``, message or attribute shows them."""

from __future__ import annotations

from typing import Any, NoReturn, Protocol

import cryptography
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, padding, rsa
from cryptography.hazmat.primitives.asymmetric.utils import Prehashed

from keystore.errors import SigningUnavailableError
from keystore.signing.ca_access import Secret

PublicKey = ec.EllipticCurvePublicKey | rsa.RSAPublicKey
PrivateKey = ec.EllipticCurvePrivateKey | rsa.RSAPrivateKey
TOKENS_SINCE = 41
"""The release of ``cryptography`` from which on its builders sign with a key that is not its own."""


class Signer(Protocol):
    """Signs with SHA-256: ECDSA in DER form, or RSA PKCS#1 v1.5, after the kind of ``public_key()``."""

    def public_key(self) -> PublicKey: ...

    def sign(self, data: bytes) -> bytes:
        """Returns the signature over ``data``; raises SigningUnavailableError."""


class FileSigner:
    """A key in memory, loaded from a PEM file of the keystore or just generated."""

    __slots__ = ("_key",)

    def __init__(self, key: PrivateKey):
        self._key = key

    @property
    def private_key(self) -> PrivateKey:
        """Return the key itself, for the builders of ``cryptography``."""
        return self._key

    def public_key(self) -> PublicKey:
        return self._key.public_key()

    def sign(self, data: bytes) -> bytes:
        if isinstance(self._key, ec.EllipticCurvePrivateKey):
            return self._key.sign(data, ec.ECDSA(hashes.SHA256()))
        return self._key.sign(data, padding.PKCS1v15(), hashes.SHA256())


class _TokenKey:
    """A token's key in the shape of a ``cryptography`` private key.

    The builders ask it for ``sign`` and ``public_key``; everything else refuses, because there is no key material here.
    """

    def __init__(self, signer: Signer):
        self._signer = signer

    def public_key(self) -> Any:
        return self._signer.public_key()

    @property
    def key_size(self) -> int:
        return self._signer.public_key().key_size

    def sign(self, data: Any, *parameters: Any) -> bytes:
        if not any(isinstance(getattr(part, "algorithm", part), hashes.SHA256) for part in parameters):
            raise SigningUnavailableError("a token signs with SHA-256 only")
        if any(isinstance(part, Prehashed) for part in parameters):
            raise SigningUnavailableError("a token is given data, not digests")
        return self._signer.sign(bytes(data))

    def _refuse(self, *_arguments: Any, **_named: Any) -> NoReturn:
        raise SigningUnavailableError("a key in a token can sign, nothing else")

    exchange = decrypt = private_numbers = private_bytes = _refuse

    def __copy__(self) -> Any:
        return self

    def __deepcopy__(self, _memo: dict[int, Any]) -> Any:
        return self


class _EcTokenKey(_TokenKey, ec.EllipticCurvePrivateKey):
    @property
    def curve(self) -> ec.EllipticCurve:
        key: ec.EllipticCurvePublicKey = self.public_key()
        return key.curve


class _RsaTokenKey(_TokenKey, rsa.RSAPrivateKey):
    pass


def builder_key(signer: Signer) -> PrivateKey:
    """Returns what ``cryptography``'s builders sign with: its own key, or a token's in the shape of one.

    Raises SigningUnavailableError for a token where ``cryptography`` is too old.
    """
    if isinstance(signer, FileSigner):
        return signer.private_key
    if int(cryptography.__version__.split(".")[0]) < TOKENS_SINCE:
        raise SigningUnavailableError(
            f"a CA key in a token needs cryptography {TOKENS_SINCE} or newer, this is {cryptography.__version__}: "
            f"pip install 'cryptography>={TOKENS_SINCE}'"
        )
    is_ec = isinstance(signer.public_key(), ec.EllipticCurvePublicKey)
    return _EcTokenKey(signer) if is_ec else _RsaTokenKey(signer)


def spki(key: PublicKey) -> bytes:
    """Returns the DER of a public key (SubjectPublicKeyInfo, RFC 5280 section 4.1)."""
    return key.public_bytes(serialization.Encoding.DER, serialization.PublicFormat.SubjectPublicKeyInfo)


def key_pem(signer: FileSigner, passphrase: Secret | None = None) -> bytes:
    """Returns the key as PKCS#8 PEM, encrypted when a passphrase is given."""
    protection: serialization.KeySerializationEncryption = serialization.NoEncryption()
    if passphrase is not None:
        protection = serialization.BestAvailableEncryption(passphrase.value())
    return signer.private_key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, protection
    )


def load_private_key(pem: bytes, passphrase: Secret | None, place: str) -> PrivateKey:
    """Load the EC or RSA key of a PEM file, encrypted or not. Raises SigningUnavailableError without its content."""
    encrypted = b"ENCRYPTED" in pem
    if encrypted and passphrase is None:
        raise SigningUnavailableError(
            f"{place} is encrypted; give its passphrase with --passphrase-file, -fd or -env"
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
