"""Where a CA's key lives: one small interface, a file and a PKCS#11 token behind it.

    Signer.sign(data) -> signature      the only thing a CA key is ever asked

``keystore.authority`` makes certificates with it, ``keystore.smime`` signed documents. Private keys and
passphrases stay inside these objects: no ``repr``, message or attribute shows them.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from keystore.errors import InvalidInput, SigningUnavailable, printable

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric import ec, rsa

    PublicKey = ec.EllipticCurvePublicKey | rsa.RSAPublicKey
    PrivateKey = ec.EllipticCurvePrivateKey | rsa.RSAPrivateKey

_MAX_SECRET = 1023  # what OpenSSL takes for an encrypted key


class Signer(Protocol):
    """Signs with SHA-256: ECDSA in DER form, or RSA PKCS#1 v1.5, after the kind of ``public_key()``."""

    def public_key(self) -> PublicKey: ...

    def sign(self, data: bytes) -> bytes:
        """The signature over ``data``; raises SigningUnavailable."""


@dataclass(frozen=True, slots=True)
class Secret:
    """A passphrase or PIN by reference: exactly one of a file, an open descriptor or an environment variable.

    Never given on the command line, where every user of the machine could read it.
    """

    file: Path | None = None
    descriptor: int | None = None
    variable: str | None = None
    _read: list[bytes] = field(default_factory=list, repr=False, compare=False)

    def value(self) -> bytes:
        """The secret without its trailing newline, read once; raises InvalidInput."""
        if not self._read:
            self._read.append(self._fetch())
        return self._read[0]

    def _fetch(self) -> bytes:
        try:
            if self.file is not None:
                content = self.file.read_bytes()[: _MAX_SECRET + 3]
            elif self.descriptor is not None:
                content = _read_all(self.descriptor)
            else:
                content = os.fsencode(os.environ[self.variable or ""])
        except (OSError, KeyError, ValueError, OverflowError) as error:
            reason = error.strerror if isinstance(error, OSError) else "not set"
            raise InvalidInput(f"cannot read the passphrase from {self._place()}: {reason}") from None
        content = content.removesuffix(b"\n").removesuffix(b"\r")
        if not content or len(content) > _MAX_SECRET:
            raise InvalidInput(f"the passphrase in {self._place()} is empty or over {_MAX_SECRET} bytes")
        return content

    def _place(self) -> str:
        if self.file is not None:
            return printable(self.file)
        return f"descriptor {self.descriptor}" if self.descriptor is not None else f"${self.variable}"


def _read_all(descriptor: int) -> bytes:
    """To its end: a pipe may give the secret in pieces."""
    content = b""
    while len(content) <= _MAX_SECRET + 2 and (piece := os.read(descriptor, _MAX_SECRET + 3)):
        content += piece
    return content


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
        from cryptography.hazmat.primitives.asymmetric import ec

        if isinstance(self._key, ec.EllipticCurvePrivateKey):
            return self._key.sign(data, self._ec_algorithm)
        return _sign_rsa(self._key, data)


def _sign_rsa(key: rsa.RSAPrivateKey, data: bytes) -> bytes:
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import padding

    return key.sign(data, padding.PKCS1v15(), hashes.SHA256())


def load_private_key(pem: bytes, passphrase: Secret | None, place: str) -> PrivateKey:
    """The EC or RSA key of a PEM file (PKCS#8 or SEC1), encrypted or not.

    Raises SigningUnavailable with ``place`` and without any of the content.
    """
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.asymmetric import ec, rsa

    encrypted = b"ENCRYPTED" in pem
    if encrypted and passphrase is None:
        raise SigningUnavailable(
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
        raise SigningUnavailable(f"{place} {wrong}") from None
    if not isinstance(key, (ec.EllipticCurvePrivateKey, rsa.RSAPrivateKey)):
        raise SigningUnavailable(f"{place} is neither an EC nor an RSA key; DDS-Security knows only these")
    return key


def open_signer(reference: bytes, place: str, access: CaAccess) -> Signer:
    """The signer behind a key file of ``private/``: PEM, or the ``pkcs11:`` URI of a ``.p11`` file."""
    if reference.lstrip().startswith(b"pkcs11:"):
        from keystore.pkcs11_signer import Pkcs11Signer

        return Pkcs11Signer.open(
            reference.split()[0].decode("ascii", "replace"), access.pin, access.environment
        )
    return FileSigner(load_private_key(reference, access.passphrase, place))


@dataclass(frozen=True, slots=True)
class CaAccess:
    """How to get at the CA keys, for every function that signs."""

    passphrase: Secret | None = None
    pin: Secret | None = None
    environment: Mapping[str, str] = field(default_factory=lambda: os.environ, repr=False)
    """Where PKCS11_MODULE_PATH is looked up when a ``pkcs11:`` URI names no module."""
