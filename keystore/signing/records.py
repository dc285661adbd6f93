"""What the register keeps of a certificate and of a signed document."""

from __future__ import annotations

from datetime import timedelta

from keystore.errors import DamagedKeystoreError
from keystore.formats.certificate import CertificateFacts
from keystore.formats.permissions_document import Grant, grant_for, rules_text
from keystore.formats.register import UNKNOWN, IssuedCertificate, SignedPermissions
from keystore.formats.subject import subject_name
from keystore.formats.validity import parse_time
from keystore.signing.public_key import fingerprint


def certificate_record(
    enclave: str, facts: CertificateFacts, issuer: CertificateFacts, lifetime: timedelta | None = None
) -> IssuedCertificate:
    """Return the register's entry for a certificate that ``issuer`` signed for ``lifetime``."""
    return IssuedCertificate(
        facts.serial,
        enclave,
        facts.common_name or UNKNOWN,
        fingerprint(facts.public_key),
        fingerprint(issuer.der),
        *facts.validity,
        lifetime=int(lifetime.total_seconds()) if lifetime is not None else None,
    )


def permissions_record(enclave: str, common_name: str, document: bytes) -> SignedPermissions:
    """Return the record of a signed document; raises DamagedKeystoreError, InvalidInputError."""
    grant = grant_for(document, subject_name(common_name), f"the permissions of {enclave}")
    if grant is None:
        raise DamagedKeystoreError(
            f"the permissions of {enclave} have no grant for {subject_name(common_name)}"
        )
    return SignedPermissions(
        enclave, common_name, fingerprint(document), rules_digest(grant), parse_time(grant.not_after)
    )


def rules_digest(grant: Grant) -> str:
    """Return a digest that is equal for grants that permit the same, whatever their subject and dates."""
    return fingerprint(rules_text(grant).encode())
