"""A ``Signer`` in the shape of a ``cryptography`` private key, so that its builders can sign with a token.

``cryptography`` accepts any implementation of its abstract key classes and asks it only for ``sign`` and
``public_key``; everything else refuses, because there is no key material here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.asymmetric.utils import Prehashed

from keystore.errors import SigningUnavailableError

if TYPE_CHECKING:
    from keystore.signing.signer import Signer


class _TokenKey:
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


def builder_key(signer: Signer) -> ec.EllipticCurvePrivateKey | rsa.RSAPrivateKey:
    """``signer`` in the shape of a private key, for the builders of ``cryptography``."""
    if isinstance(signer.public_key(), ec.EllipticCurvePublicKey):
        return _EcTokenKey(signer)
    return _RsaTokenKey(signer)
