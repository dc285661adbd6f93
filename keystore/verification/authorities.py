"""The CAs, the governance they signed, and the CRL."""

from __future__ import annotations

import os
from collections.abc import Iterator
from datetime import datetime

from keystore.disk import layout, safe_files
from keystore.disk.crl_file import crl_validity, load_crl
from keystore.disk.register_file import describe, needs_register
from keystore.disk.signed_documents import foreign_document
from keystore.disk.view import KeystoreView
from keystore.errors import KeystoreError, OtherFormError, SigningUnavailableError, UnsafeKeystoreError
from keystore.formats.certificate import CertificateFacts
from keystore.formats.governance import Governance, parse_governance
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.validity import why_not_valid
from keystore.signing import smime
from keystore.signing.authority import check_can_serve
from keystore.signing.ca_access import CaAccess
from keystore.signing.public_key import cyclone_takes, is_weak, issued_by, key_kind
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity
from keystore.verification.governance import check_strength


def check_authorities(
    view: KeystoreView,
    register: Register | None,
    access: CaAccess,
    now: datetime,
    required: Governance | None,
) -> Iterator[Finding]:
    """Check both CAs (certificates, keys, bundles), the governance and the CRL."""
    for role in Role:
        for facts in view.ca_bundle(role):
            yield from _check_certificate(view, role, facts, now)
    yield from _check_governance(view, register, required)
    if view.has_crl:
        yield from _check_crl(view, now)
    for role in Role:
        yield from _check_key(view, role, access)
        if register is not None and len(view.ca_bundle(role)) > 1:
            step = "switch" if os.path.isdir(view.root / layout.NEXT / role.value) else "finish"
            yield Finding(
                Severity.NOTE, "roll-over", layout.ca_cert(role),
                "a CA roll-over is under way (two CAs in the file)",
                repair.renew(view.root, "--ca", step, note="once this state is deployed"),
            )  # fmt: skip
    if view.shares_one_ca:
        yield Finding(
            Severity.EXPOSURE, "shared-ca", layout.PUBLIC,
            "one CA for identities and permissions: with Cyclone DDS before 11.0 and Fast DDS before 2.6.5, "
            "2.9.2 and 2.10.1 any enclave can sign permissions and governance for itself (CVE-2023-24010, -24011)",
            repair.renew(view.root, note="then deploy all enclaves together"),
        )  # fmt: skip


def _check_certificate(
    view: KeystoreView, role: Role, facts: CertificateFacts, now: datetime
) -> Iterator[Finding]:
    place = layout.ca_cert(role)
    try:
        check_can_serve(facts, role, now, place)
    except KeystoreError as error:
        fix = repair.replace_ca(view.root, role)
        yield Finding(Severity.ERROR, "ca-unfit", place, str(error), fix)
    if facts.issuer == facts.subject and not issued_by(facts, facts):
        yield Finding(Severity.ERROR, "ca-signature", place, "its self-signature is wrong", repair.BACKUP)
    kind = key_kind(facts.public_key)
    if role is Role.IDENTITY and not cyclone_takes(facts.public_key):
        text = f"a {kind} key: Cyclone DDS refuses it, Fast DDS accepts it"
        yield Finding(Severity.WARNING, "ca-key-kind", place, text)
    if is_weak(facts.public_key):
        text = f"a {kind} key, which is weak: who breaks it can sign what this CA signs"
        fix = repair.replace_ca(view.root, role)
        yield Finding(Severity.EXPOSURE, "weak-key", place, text, fix)


def _check_key(view: KeystoreView, role: Role, access: CaAccess) -> Iterator[Finding]:
    name = view.key_file(role)
    if name is None:
        what = "nothing can be signed on this machine"
        if view.key_file(Role.PERMISSIONS) is not None:
            what = "certificates are requested from its owner, and taken with sign --issued"
        text = f"not here: {what}; trusted is {describe(view.ca(role))}"
        yield Finding(Severity.NOTE, "no-ca-key", layout.ca_key(role), text)
        return
    try:
        reference = safe_files.read_private(view.root, name)
    except UnsafeKeystoreError:
        return  # the check of all files names it, with what to do about it
    locked = b"ENCRYPTED" in reference and access.passphrase is None
    if locked or (name.endswith(".p11") and access.pin is None):
        text = "not checked against its certificate: it needs a passphrase or PIN"
        yield Finding(Severity.NOTE, "ca-key-locked", name, text)
        return
    try:
        view.authority(role, access)
    except SigningUnavailableError as error:
        is_locked = b"ENCRYPTED" in reference or name.endswith(".p11")
        fix = (
            f"give the passphrase or PIN that belongs to it, or {repair.BACKUP}"
            if is_locked
            else repair.BACKUP
        )
        yield Finding(Severity.ERROR, "ca-key", name, str(error), fix)


def _check_governance(
    view: KeystoreView, register: Register | None, required: Governance | None
) -> Iterator[Finding]:
    place = layout.GOVERNANCE
    again = repair.sign_governance(view.root)
    try:
        p7s = safe_files.read(view.root, place)
        signed = smime.read(p7s, place)
        smime.check(signed, view.ca_bundle(Role.PERMISSIONS), place)
        governance = parse_governance(signed.document, place)
    except OtherFormError as error:
        yield _foreign_governance(view, register, error)
        return
    except KeystoreError as error:
        yield Finding(Severity.ERROR, "governance", place, str(error), again)
        return
    if not signed.embeds(view.ca(Role.PERMISSIONS).der):
        yield Finding(
            Severity.ERROR, "embedded-differs", place,
            "carries another certificate than that of the permissions CA: older DDS versions refuse it", again,
        )  # fmt: skip
    yield from check_strength(view.root, governance, required)
    if register is not None and register.governance and signed.document != register.governance:
        yield Finding(
            Severity.ERROR, "governance-not-last", place, "signed here, but not the governance that was signed last",
            repair.renew(view.root, note="signs the last one again"),
        )  # fmt: skip
    twin = safe_files.read_if_there(view.root, layout.GOVERNANCE_XML)
    if twin is not None and twin.replace(b"\r\n", b"\n") != signed.document:
        yield Finding(
            Severity.ERROR, "twin-differs", layout.GOVERNANCE_XML,
            "differs from the signed governance.p7s in force", repair.renew(view.root),
        )  # fmt: skip


def _foreign_governance(view: KeystoreView, register: Register | None, error: OtherFormError) -> Finding:
    place, fix = layout.GOVERNANCE, repair.sign_governance(view.root)
    try:
        foreign_document(view, place)
    except KeystoreError as worse:
        return Finding(Severity.ERROR, "governance", place, str(worse), fix)
    if needs_register(view) or (register is not None and register.governance):
        fix = repair.renew(view.root, note="writes it again, or takes the keystore over")
    return Finding(Severity.ERROR, "other-form", place, str(error), fix)


def _check_crl(view: KeystoreView, now: datetime) -> Iterator[Finding]:
    try:
        load_crl(view)
        validity = crl_validity(view)
    except KeystoreError as error:
        fix = f"{repair.BACKUP}: without it the revoked certificates are unknown"
        yield Finding(Severity.ERROR, "crl", layout.CRL, str(error), fix)
        return
    if not validity.covers(now):
        yield Finding(
            Severity.ERROR, "crl-expired", layout.CRL,
            f"{why_not_valid(validity, now)}: all participants are refused",
            repair.renew(view.root, note="then deploy"),
        )  # fmt: skip
