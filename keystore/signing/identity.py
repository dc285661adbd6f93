"""An enclave's key and certificate, from an identity CA. Bytes in, bytes out; nothing is written here."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from keystore.formats.validity import Validity
from keystore.signing.authority import Curve, IdentityIssuer, key_pem, new_key, pem_certificate
from keystore.signing.signer import FileSigner, load_private_key

if TYPE_CHECKING:
    from keystore.signing.signer import PublicKey


@dataclass(frozen=True, slots=True)
class Identity:
    """The files ``cert.pem`` and ``key.pem``; ``key`` is None when an existing key was certified anew.

    ``validity`` is what the certificate got: its CA may have cut what was asked for.
    """

    common_name: str
    validity: Validity
    cert: bytes
    key: bytes | None = field(repr=False)


def new_identity(
    issuer: IdentityIssuer, common_name: str, validity: Validity, curve: Curve = Curve.P256
) -> Identity:
    """A new key pair, and a certificate for it from ``issuer``."""
    signer = new_key(curve)
    return certify(issuer, common_name, signer.public_key(), validity, key_pem(signer))


def certify(
    issuer: IdentityIssuer,
    common_name: str,
    public_key: PublicKey,
    validity: Validity,
    key: bytes | None = None,
) -> Identity:
    """A certificate for a key that exists already, as ``renew`` and interrupted runs need it."""
    granted = validity.within(issuer.validity)
    cert = pem_certificate(issuer.issue(common_name, public_key, granted))
    return Identity(common_name, granted, cert, key)


def public_half(pem: bytes, place: str) -> PublicKey:
    """The public key of an enclave's ``key.pem``, or of the request in its place; raises SigningUnavailableError
    without showing any of it."""
    if b"CERTIFICATE REQUEST" in pem:
        from keystore.signing.requests import request_key

        return request_key(pem, place).key
    return FileSigner(load_private_key(pem, None, place)).public_key()
