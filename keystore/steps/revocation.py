"""Enclaves taken out for good: their certificates revoked, their files deleted.

Which implementations look at the CRL (``crl.pem`` in each enclave directory, there only after a
revocation): rmw_cyclonedds_cpp passes it as ``org.eclipse.cyclonedds.sec.auth.crl``, rmw_fastrtps_* as
``dds.sec.auth.builtin.PKI-DH.identity_crl``; both refuse a listed peer at handshake, and read the file
only when a participant starts. rmw_connextdds does not pass one. Every enclave needs the new file, so
deploy after removing. Permissions cannot be revoked, they are useless without a valid identity.

A CRL past its nextUpdate makes every participant fail: ``status`` lists it and ``renew`` renews it in time.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from keystore.disk import layout, lock, safe_files, store
from keystore.disk.crl_file import crl_validity, load_crl, revoked_serials
from keystore.disk.safe_files import resolve_root
from keystore.disk.store import Link, Store
from keystore.disk.superseded import serials_of
from keystore.disk.view import KeystoreView
from keystore.errors import InvalidInput, printable
from keystore.formats import certificate
from keystore.formats.der import DerError
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.role import Role
from keystore.formats.validity import later, utc_now
from keystore.signing.authority import IdentityIssuer
from keystore.signing.ca_access import CaAccess

if TYPE_CHECKING:
    pass

# Nobody fetches CRLs in a DDS system: a short life would buy nothing and risk an outage.
CRL_LIFETIME = timedelta(days=365)
_BACKDATE = timedelta(days=1)
# The key first, so that nothing usable remains; the certificate last, so that a repeated run can revoke it.
_DELETE_ORDER = (
    layout.KEY, layout.PERMISSIONS, layout.PERMISSIONS_XML, layout.ENCLAVE_GOVERNANCE, layout.ENCLAVE_CRL,
    "identity_ca.cert.pem", "permissions_ca.cert.pem", layout.CERT,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class RemoveOptions:
    """``revoke`` False only deletes: copies of the enclave elsewhere stay valid until they expire."""

    revoke: bool = True
    access: CaAccess = field(default_factory=CaAccess)
    lock_timeout: float = lock.DEFAULT_TIMEOUT
    durable: bool = True
    now: datetime | None = None


@dataclass(frozen=True, slots=True)
class RemoveReport:
    removed: tuple[str, ...]
    revoked: int
    """How many certificates the CRL lists now."""
    warnings: tuple[str, ...] = ()


def remove(
    keystore: Path | str, names: Iterable[str], *, options: RemoveOptions | None = None
) -> RemoveReport:
    """Revoke what they have and had, publish the CRL to all remaining enclaves, then delete. Repeating completes an
    interrupted run.

    Enclaves below a removed one stay. Raises InvalidInput for an enclave that is not there.
    """
    chosen = options or RemoveOptions()
    wanted = sorted({validate_enclave_name(name) for name in names})
    root = resolve_root(keystore)
    KeystoreView(root).require_complete()
    with store.opened(root, timeout=chosen.lock_timeout, durable=chosen.durable) as opened:
        view = KeystoreView(root)
        unknown = sorted(set(wanted) - set(view.enclaves()))
        if unknown:
            raise InvalidInput(
                f"no enclave {', '.join(unknown)} in {printable(root)}; secure-keystore list shows all"
            )
        warnings: list[str] = []
        if chosen.revoke:
            _revoke(opened, view, wanted, chosen, warnings)
        for name in wanted:
            _delete(opened, name)
    listed = len(revoked_serials(KeystoreView(root)))
    return RemoveReport(tuple(wanted), listed, tuple(warnings))


def _revoke(
    opened: Store, view: KeystoreView, names: list[str], options: RemoveOptions, warnings: list[str]
) -> None:
    now = options.now or utc_now()
    serials = dict(revoked_serials(view))
    ca = view.ca(Role.IDENTITY)
    for serial in serials_of(view, names):
        serials.setdefault(serial, now)
    for name in names:
        pem = safe_files.read_if_there(view.root, f"{layout.enclave_directory(name)}/{layout.CERT}")
        try:
            facts = certificate.read_pem(pem or b"")
        except DerError:
            warnings.append(f"{name} has no readable certificate, nothing to revoke")
            continue
        if facts.names_issuer(ca):
            serials.setdefault(facts.serial, now)
        else:
            warnings.append(f"the certificate of {name} is not by the present identity CA, nothing to revoke")
    if serials:
        publish_crl(opened, serials, options.access, now)
        link_crl(opened, [name for name in view.enclaves() if name not in names])


def publish_crl(opened: Store, serials: dict[int, datetime], access: CaAccess, now: datetime) -> None:
    """Write ``public/crl.pem`` anew; raises InvalidInput when the CA may not sign CRLs."""
    view = KeystoreView(opened.root)
    issuer = view.authority(Role.IDENTITY, access)
    _refuse_without_crl_sign(issuer.facts.der)
    end = min(now + CRL_LIFETIME, issuer.validity.not_after)
    number = max(int(now.timestamp()), _present_number(view) + 1)  # RFC 5280 section 5.2.3: only has to grow
    crl = IdentityIssuer(issuer).revocation_list(serials, now - _BACKDATE, end, number)
    with opened.batch() as batch:
        batch.file(layout.CRL, crl)


def _present_number(view: KeystoreView) -> int:
    """Of the CRL in force, 0 without one or without a number."""
    from cryptography import x509

    if not view.has_crl:
        return 0
    try:
        return load_crl(view).extensions.get_extension_for_class(x509.CRLNumber).value.crl_number
    except x509.ExtensionNotFound:
        return 0


def _refuse_without_crl_sign(ca_der: bytes) -> None:
    from cryptography import x509

    try:
        usage = x509.load_der_x509_certificate(ca_der).extensions.get_extension_for_class(x509.KeyUsage)
    except x509.ExtensionNotFound:
        return
    if not usage.value.crl_sign:
        raise InvalidInput(
            "the identity CA may not sign CRLs (key usage lacks cRLSign), participants would refuse one; "
            "replace the CA (renew --ca start), or only delete with --no-revoke"
        )


def link_crl(opened: Store, names: Iterable[str]) -> None:
    """Give each enclave its ``crl.pem``; copies of it are refreshed."""
    with opened.batch() as batch:
        for name in names:
            target = f"{layout.enclave_directory(name)}/{layout.ENCLAVE_CRL}"
            if safe_files.link_target(opened.root, target) != layout.crl_link(name):
                batch.link(target, Link(layout.crl_link(name), layout.CRL))


def revoke_replaced(opened: Store, names: Iterable[str], access: CaAccess, now: datetime) -> int:
    """Revoke what these enclaves had before, not what they have now; how many certificates that adds."""
    view = KeystoreView(opened.root)
    present = {_serial(view, name) for name in view.enclaves()}
    known = revoked_serials(view)
    added = serials_of(view, names) - present - known.keys()
    if added:
        publish_crl(opened, {**known, **dict.fromkeys(added, now)}, access, now)
        link_crl(opened, view.enclaves())
    return len(added)


def _serial(view: KeystoreView, name: str) -> int | None:
    pem = safe_files.read_if_there(view.root, f"{layout.enclave_directory(name)}/{layout.CERT}")
    try:
        return certificate.read_pem(pem or b"").serial
    except DerError:
        return None


def renew_crl(opened: Store, access: CaAccess, now: datetime, within: timedelta) -> bool:
    """Publish the CRL again if it ends within ``within``; whether it did."""
    view = KeystoreView(opened.root)
    if not view.has_crl or crl_validity(view).not_after > later(now, within):
        return False
    publish_crl(opened, revoked_serials(view), access, now)
    link_crl(opened, view.enclaves())
    return True


def drop_crl(opened: Store) -> None:
    """After a change of the identity CA: what the old one revoked is not trusted any more."""
    for name in KeystoreView(opened.root).enclaves():
        opened.remove(f"{layout.enclave_directory(name)}/{layout.ENCLAVE_CRL}")
    opened.remove(layout.CRL)


def _delete(opened: Store, name: str) -> None:
    """Exactly the files of this enclave; the root's governance belongs to the keystore."""
    directory = layout.enclave_directory(name)
    for file in _DELETE_ORDER:
        if not (name == "/" and file == layout.ENCLAVE_GOVERNANCE):
            opened.remove(f"{directory}/{file}")
    if name == "/":
        opened.sync_directories({directory})
        return
    while directory != layout.ENCLAVES and opened.remove_empty_directory(directory):
        directory = os.path.dirname(directory)
    opened.sync_directories({directory})
