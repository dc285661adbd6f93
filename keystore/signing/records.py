"""Entries of the register for a certificate and for a signed document."""

from __future__ import annotations

from datetime import timedelta

from keystore.errors import DamagedKeystoreError
from keystore.formats.certificate import CertificateFacts
from keystore.formats.permissions import Permissions
from keystore.formats.permissions_document import parse_permissions
from keystore.formats.register import UNKNOWN, IssuedCertificate, SignedPermissions
from keystore.formats.subject import subject_name
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
    """Return the record of a document of ours; raises DamagedKeystoreError for one that is not for this subject."""
    permissions = parse_permissions(document, f"the permissions of {enclave}")
    if permissions.subject != subject_name(common_name):
        raise DamagedKeystoreError(f"the permissions of {enclave} are not for {subject_name(common_name)}")
    return SignedPermissions(
        enclave, common_name, fingerprint(document), rules_digest(permissions), permissions.validity.not_after
    )


def rules_digest(permissions: Permissions) -> str:
    """Return a digest that is equal for documents that permit the same, whatever their subject and dates."""
    return fingerprint(f"{permissions.domains} {permissions.rules[:3]}".encode())
