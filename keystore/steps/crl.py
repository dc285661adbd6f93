"""The CRL, made from the register. Which implementations read it, and when: see ``keystore.steps.removal``.

A CRL names one CA, and both implementations read only the first of a file: it lists what the identity CA in use
issued. Its number only grows; one with another number than the register's was put back and is replaced.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime, timedelta

from cryptography import x509

from keystore.disk import layout, safe_files
from keystore.disk.crl_file import crl_problem, crl_validity
from keystore.disk.store import PRIVATE_MODE, Link, Store
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, InvalidInputError
from keystore.formats.register import IssuedCertificate, Register
from keystore.formats.role import Role
from keystore.formats.validity import BACKDATE, later
from keystore.signing.ca_access import CaAccess
from keystore.signing.public_key import fingerprint

# Nobody fetches CRLs in a DDS system: a short life would buy nothing and risk an outage.
CRL_LIFETIME = timedelta(days=365)


def can_revoke(view: KeystoreView) -> bool:
    """Return True if participants would accept a CRL of the identity CA: its key usage has cRLSign, or is absent."""
    usage = view.ca(Role.IDENTITY).extension(x509.KeyUsage)
    return usage is None or usage.crl_sign


def revocable(view: KeystoreView, register: Register, enclaves: Iterable[str]) -> list[IssuedCertificate]:
    """Return the certificates of these enclaves, past ones too, by the identity CA in use that are not revoked yet."""
    issuer = fingerprint(view.ca(Role.IDENTITY).der)
    return [
        one
        for enclave in enclaves
        for one in register.of_enclave(enclave)
        if one.issuer == issuer and one.revoked is None
    ]


def publish_crl(opened: Store, register: Register, access: CaAccess, now: datetime) -> None:
    """Record ``register``, write ``public/crl.pem`` as it has it and give it to every enclave.

    Before anything is recorded: raises InvalidInputError when the CA may not sign CRLs, DamagedKeystoreError when it is
    not valid now, SigningUnavailableError without its key.
    """
    view = KeystoreView(opened.root)
    if not can_revoke(view):
        raise InvalidInputError(
            "the identity CA may not sign CRLs (key usage lacks cRLSign), participants would refuse one; "
            "replace the CA (renew --ca start), or only delete with --no-revoke"
        )
    view.refuse_ended(now, Role.IDENTITY)
    issuer = view.authority(Role.IDENTITY, access)
    in_force = (one.not_after for one in register.certificates.values() if one.in_force)
    end = min(max([now + CRL_LIFETIME, *in_force]), issuer.validity.not_after)
    revoked = register.revoked(fingerprint(issuer.facts.der))
    crl = issuer.revocation_list(revoked, now - BACKDATE, end, register.crl_number)
    with opened.batch() as batch:
        batch.record(register)
        batch.file(layout.CRL_UNLINKED, b"", PRIVATE_MODE)
        batch.file(layout.CRL, crl)
    _link_all(opened)


def _link_all(opened: Store) -> None:
    """Give each enclave its ``crl.pem``; copies of it are refreshed."""
    with opened.batch() as batch:
        for name in KeystoreView(opened.root).enclaves():
            target = layout.enclave_file(name, layout.ENCLAVE_CRL)
            if safe_files.link_target(opened.root, target) != layout.crl_link(name):
                batch.link(target, Link(layout.crl_link(name), layout.CRL))
    opened.remove(layout.CRL_UNLINKED)


def restore_crl(
    opened: Store, access: CaAccess, now: datetime, within: timedelta = timedelta(0)
) -> list[str]:
    """Publish the CRL again if it is not the one to use, or expires within ``within``; return what was done, in words.

    Raises DamagedKeystoreError for a CRL that this keystore did not publish: it may be all that says who was revoked.
    """
    view = KeystoreView(opened.root)
    problem = crl_problem(view, opened.register if opened.has_register else None, now)
    if problem is not None and opened.has_register and not opened.register.crl_published:
        raise DamagedKeystoreError(
            f"{layout.CRL} was not published by this keystore; look at it, remove it, and revoke with "
            "secure-keystore remove or renew --revoke-old"
        )
    if problem is None:
        if not view.has_crl:
            return []
        if crl_validity(view).not_after > later(now, within):
            _link_all(opened)  # an interrupted run may have left some without
            return []
        problem = "the CRL expires soon" if within else "the CRL has expired"
    publish_crl(opened, opened.register.with_next_crl(now), access, now)
    return [f"CRL published again: {problem}"]


def drop_crl(opened: Store) -> None:
    """Remove the CRL after a change of the identity CA: what the old one revoked is not trusted any more."""
    for name in KeystoreView(opened.root).enclaves():
        opened.remove(layout.enclave_file(name, layout.ENCLAVE_CRL))
    opened.remove(layout.CRL)
    with opened.batch() as batch:
        batch.record(replace(opened.register, crl_published=False))
