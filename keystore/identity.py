"""An enclave's key and certificate, from an identity CA. Bytes in, bytes out; nothing is written here."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from keystore import certificate
from keystore.authority import Curve, IdentityIssuer, key_pem, new_key, pem_certificate
from keystore.certificate import CertificateFacts
from keystore.signer import FileSigner, load_private_key
from keystore.validity import Validity

if TYPE_CHECKING:
    from keystore.signer import PublicKey


@dataclass(frozen=True, slots=True)
class Identity:
    """The files ``cert.pem`` and ``key.pem``; ``key`` is None when an existing key was certified anew."""

    facts: CertificateFacts
    cert: bytes
    key: bytes | None = field(repr=False)


def new_identity(
    issuer: IdentityIssuer, common_name: str, validity: Validity, curve: Curve = Curve.P256
) -> Identity:
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
    facts = certificate.read_der(issuer.issue(common_name, public_key, validity))
    return Identity(facts, pem_certificate(facts.der), key)


def public_half(pem: bytes, place: str) -> PublicKey:
    """The public key of an enclave's ``key.pem``; raises SigningUnavailable without showing any of it."""
    return FileSigner(load_private_key(pem, None, place)).public_key()
