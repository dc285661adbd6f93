"""A keystore opened for a change: under the lock, with its register, which is made for a keystore without one."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from pathlib import Path

from enclave_common.terminal import quoted
from enclave_common.words import counted
from keystore.disk import layout, lock, safe_files, store
from keystore.disk.crl_file import ListedCrl, crls_in, load_crl
from keystore.disk.register_file import needs_register
from keystore.disk.signed_documents import foreign_document, foreign_governance, own_document
from keystore.disk.store import Store
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, KeystoreError, OtherFormError, WrongClockError
from keystore.formats.certificate import CertificateFacts, given_certificates, read_certificates, read_der
from keystore.formats.governance import governance_document, parse_governance
from keystore.formats.permissions_document import parse_permissions, read_foreign_permissions
from keystore.formats.register import UNKNOWN, AuthorityState, IssuedCertificate, Register, SignedPermissions
from keystore.formats.role import Role
from keystore.formats.validity import iso
from keystore.signing.ca_access import CaAccess
from keystore.signing.public_key import fingerprint, issued_by
from keystore.signing.records import certificate_record, permissions_record
from keystore.steps.options import ProvisionOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeOptions:
    """How a keystore is changed. ``lock_timeout``: seconds to wait for the lock. ``durable``: wait until it is on the
    disk. ``now``: None for the clock's."""

    access: CaAccess = field(default_factory=CaAccess)
    lock_timeout: float = lock.DEFAULT_TIMEOUT
    durable: bool = True
    now: datetime | None = None
    accept_clock: bool = False
    """Go on though the clock is far from the last time that the register knows."""


@contextmanager
def opened_for_change(
    root: Path, now: datetime, options: ChangeOptions | ProvisionOptions
) -> Iterator[Store]:
    """Open as ``store.opened``; a complete keystore without a register gets one made from its contents.

    It is written with the first change, so that a change which is refused leaves the keystore as it was.
    Raises WrongClockError if the clock cannot be right, unless that is accepted or the caller gave the time.
    """
    with store.opened(root, timeout=options.lock_timeout, durable=options.durable) as opened:
        if options.now is None:
            _check_clock(opened, now, accepted=options.accept_clock)
            opened.clock = now
        if needs_register(KeystoreView(root)):
            take_over(opened)
        elif opened.has_register:
            _adopt_crls(opened)
            _restore_settings(opened)
        yield opened
        opened.keep_adopted()


_BACK, _AHEAD = timedelta(days=1), timedelta(days=366)


def _check_clock(opened: Store, now: datetime, *, accepted: bool) -> None:
    """Refuse a wrong clock: certificates would expire at the wrong time, and revocations could be forgotten."""
    last = opened.register.written
    if last is None:
        return
    if last - _BACK <= now <= last + _AHEAD:
        return
    if not accepted:
        raise WrongClockError(
            f"the clock says {iso(now)}, and the register was written at {iso(last)}: set the clock, or, if it is "
            f"right, accept it with secure-keystore renew {quoted(opened.root)} --accept-clock"
        )
    opened.clock = now
    with opened.batch() as batch:
        batch.record(opened.register)


def _adopt_crls(opened: Store) -> None:
    """Take over what any CRL in the tree lists and the register does not, as after ``private/`` was restored from a
    backup, or after a revocation with openssl. A revoked certificate stays revoked.
    """
    view = KeystoreView(opened.root)
    # The register's CAs count: a trust file that is damaged is repaired only later.
    issuers = [read_der(ca) for ca in opened.register.trusted_authorities(Role.IDENTITY)]
    newer = with_crls(opened, crls_in(view, issuers))
    if newer != opened.register:
        with opened.batch() as batch:
            batch.record(newer)


def with_crls(opened: Store, found: Iterable[ListedCrl]) -> Register:
    """Return the register with all that these CRLs list, and report additions."""
    register = opened.register
    for crl in found:
        issuer, end = fingerprint(crl.issuer.der), crl.issuer.validity.not_after
        known = dict(register.certificates)
        fresh = {
            serial: at
            for serial, at in crl.revoked.items()
            if serial not in known or not known[serial].revoked
        }
        for serial, at in fresh.items():
            unknown = IssuedCertificate(serial, UNKNOWN, UNKNOWN, UNKNOWN, issuer, at, end, replaced=True)
            known[serial] = known.get(serial, unknown)._replace(revoked=at)
        if fresh:
            listed = ", ".join(f"{serial:X}" for serial in sorted(fresh))
            opened.notes.append(f"{crl.place} lists revoked serial numbers that were not on record: {listed}")
        if fresh or crl.number > register.crl_number or not register.crl_published:
            number = max(register.crl_number, crl.number) + bool(fresh)
            register = replace(register, certificates=known, crl_number=number, crl_published=True)
    return register


def _restore_settings(opened: Store) -> None:
    """Go by the settings that are on record: what another hand wrote decides about nothing that is signed."""
    present, recorded = safe_files.read_if_there(opened.root, layout.SETTINGS), opened.register.settings
    if (present or b"") == recorded:
        return
    if recorded:
        with opened.batch() as batch:
            batch.file(layout.SETTINGS, recorded)
    else:
        opened.remove(layout.SETTINGS)
    opened.notes.append(f"{layout.SETTINGS} made what it was")


def take_over(opened: Store) -> None:
    """Record what can be known of a keystore that SROS2 made, or whose register was lost: all that its CAs really
    signed.

    Raises DamagedKeystoreError for a CRL that cannot be trusted: the revoked certificates are then unknown.
    """
    view = KeystoreView(opened.root)
    settings = safe_files.read_if_there(opened.root, layout.SETTINGS) or b""
    register = replace(_authorities(view), settings=settings)
    lost: list[str] = []
    with suppress(KeystoreError):  # signed by another CA: the next governance is recorded
        register = replace(register, governance=_governance(view, lost))
    register = register.with_certificates(_issued(view))
    register = register.with_documents(_documents(view, register, lost))
    if view.has_crl:
        load_crl(view)
    opened.adopt(register)
    opened.adopt(with_crls(opened, crls_in(view)))
    opened.notes.append(
        f"register made from the files in this keystore: {counted(len(opened.register.certificates), 'certificate')}"
    )
    opened.notes += [f"not taken over: {one}" for one in lost]


def _authorities(view: KeystoreView) -> Register:
    """Register the CAs that the keystore made; of a trust file with several, only those count.

    A switch keeps the old one among the retired, a start the new one among those that wait.
    """
    register = Register()
    for role in Role:
        register = register.with_authority(role, view.ca(role).der, AuthorityState.IN_USE)
        for facts in _certificates_in(view, f"{layout.NEXT}/{role.value}", ""):
            register = register.with_authority(role, facts.der, AuthorityState.WAITING)
        for facts in _certificates_in(view, layout.RETIRED, f"{role.value}-"):
            leaving = any(ca.der == facts.der for ca in view.ca_bundle(role))
            state = AuthorityState.LEAVING if leaving else AuthorityState.RETIRED
            if not register.trusts_authority(role, facts.der):
                register = register.with_authority(role, facts.der, state)
    return register


def _certificates_in(view: KeystoreView, directory: str, prefix: str) -> Iterator[CertificateFacts]:
    try:
        names = sorted(os.listdir(view.root / directory))
    except (FileNotFoundError, NotADirectoryError):
        return
    for name in names:
        if name.startswith(prefix) and name.endswith(layout.CERT):
            pem = safe_files.read(view.root, f"{directory}/{name}")
            yield from read_certificates(pem, quoted(view.root / directory / name))


def _issued(view: KeystoreView) -> Iterator[IssuedCertificate]:
    for enclave in view.enclaves():
        pem = view.enclave_file(enclave, layout.CERT)
        try:
            facts = given_certificates(pem or b"", enclave)[0]
        except DamagedKeystoreError:
            continue
        issuer = next((ca for ca in view.ca_bundle(Role.IDENTITY) if issued_by(facts, ca)), None)
        if issuer is not None:
            yield certificate_record(enclave, facts, issuer)


def _governance(view: KeystoreView, lost: list[str]) -> bytes:
    try:
        document = own_document(view, layout.GOVERNANCE)
        parse_governance(document, layout.GOVERNANCE)
    except OtherFormError:
        governance, missing = foreign_governance(view)
        lost += [f"of the governance: {one}" for one in missing]
        return governance_document(governance)
    return document


def _documents(view: KeystoreView, register: Register, lost: list[str]) -> Iterator[SignedPermissions]:
    """Record the permissions as they are, or of another tool's document as they will be written here."""
    for one in register.certificates.values():
        if not one.in_force or view.enclave_file(one.enclave, layout.PERMISSIONS) is None:
            continue
        try:
            document, missing = taken_over(view, one.enclave)
            yield permissions_record(one.enclave, one.subject, document)
        except KeystoreError as error:
            missing = (str(error),)
        lost += [f"of the permissions of {one.enclave}: {what}" for what in missing]


def taken_over(view: KeystoreView, enclave: str) -> tuple[bytes, tuple[str, ...]]:
    """Return the permissions that one of our CAs signed, as they are written here, and what of them is lost.

    Raises a KeystoreError for what none of our CAs signed, or DDS implementations read in different ways.
    """
    place = layout.enclave_file(enclave, layout.PERMISSIONS)
    try:
        document = own_document(view, place)
        parse_permissions(document, quoted(view.root / place))
    except OtherFormError:
        foreign, where = foreign_document(view, place), quoted(view.root / place)
        found = read_foreign_permissions(foreign, enclave, where)
        return found.permissions.document(), found.lost
    return document, ()
