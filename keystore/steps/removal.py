"""Remove enclaves: revoke their certificates, delete their files.

rmw_cyclonedds_cpp passes ``crl.pem`` as ``org.eclipse.cyclonedds.sec.auth.crl``, rmw_fastrtps_* as
``dds.sec.auth.builtin.PKI-DH.identity_crl``; both refuse a listed peer at handshake, and read the file only when a
participant starts. rmw_connextdds does not pass one. Every enclave needs the new file, so deploy after removing.
Permissions cannot be revoked, they are useless without a valid identity. A CRL past its nextUpdate makes every
participant fail: ``status`` lists it and ``renew`` renews it in time.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from enclave_common.terminal import quoted
from enclave_common.words import some_of
from keystore.add_ons import follow
from keystore.disk import layout
from keystore.disk.store import Store
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import SigningUnavailableError
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.role import Role
from keystore.formats.validity import utc_now
from keystore.signing.ca_access import CaAccess
from keystore.signing.public_key import fingerprint
from keystore.steps.crl import publish_crl, restore_crl, revocable
from keystore.steps.opening import ChangeOptions, opened_for_change
from keystore.steps.options import ProvisionOptions

# The key first, so that nothing usable remains; the certificate last, so that a repeated run can revoke it.
_DELETE_ORDER = (
    layout.KEY, layout.ENCLAVE_ZENOH, layout.PERMISSIONS, layout.PERMISSIONS_XML, layout.ENCLAVE_GOVERNANCE,
    layout.ENCLAVE_CRL,
    "identity_ca.cert.pem", "permissions_ca.cert.pem", layout.CERT,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class RemoveOptions(ChangeOptions):
    """How to remove. ``revoke`` False only deletes: copies of the enclave elsewhere stay valid until they expire."""

    revoke: bool = True


@dataclass(frozen=True, slots=True)
class RemoveReport:
    """Result of a removal."""

    removed: tuple[str, ...]
    revoked: int
    """How many certificates the CRL lists now."""
    warnings: tuple[str, ...] = ()
    gone: tuple[str, ...] = ()
    """Enclaves that an earlier run removed."""


def remove(
    keystore: Path | str, names: Iterable[str], *, options: RemoveOptions | None = None
) -> RemoveReport:
    """Revoke all certificates of these enclaves, publish the CRL to the others, then delete the enclaves.

    Repeating completes an interrupted run.

    Enclaves below a removed one stay. One whose files are lost is revoked as the register knows it; so is one that was
    removed already. Raises InvalidInputError for an enclave that was never there, SigningUnavailableError on a host: it
    revokes nothing, and the next import brings back what is only deleted.
    """
    chosen = options or RemoveOptions()
    now = chosen.now or utc_now()
    wanted = sorted({validate_enclave_name(name) for name in names})
    root = keystore_at(keystore).root
    with opened_for_change(root, now, chosen) as opened:
        if not opened.has_register:
            raise SigningUnavailableError(
                f"{quoted(root)} is a deployed copy without CA keys: {some_of(wanted, 3)} cannot be removed "
                "here; remove it where the CA keys are, then deploy"
            )
        view = KeystoreView(root)
        lost = {one.enclave for one in revocable(view, opened.register, wanted)}
        known = {name for name in wanted if opened.register.of_enclave(name)} - set(view.enclaves())
        view.require_enclaves(set(wanted) - known)
        gone = known - lost
        warnings = _strike(opened, wanted, chosen, now)
        for name in wanted:
            opened.remove(layout.shares(name))
            opened.remove(layout.request(name))
            if opened.is_directory(layout.enclave_directory(name)):
                _delete(opened, name)
        issuer = fingerprint(KeystoreView(root).ca(Role.IDENTITY).der)
        revoked = len(opened.register.revoked(issuer))
    zenoh = ProvisionOptions(
        access=chosen.access, lock_timeout=chosen.lock_timeout, durable=chosen.durable, now=chosen.now
    )
    removed = tuple(name for name in wanted if name not in gone)
    return RemoveReport(removed, revoked, (*warnings, *follow(root, zenoh)), tuple(sorted(gone)))


def _strike(opened: Store, names: list[str], options: RemoveOptions, now: datetime) -> list[str]:
    """Take the enclaves off the register; with ``revoke`` put all their certificates onto the CRL."""
    view = KeystoreView(opened.root)
    found = revocable(view, opened.register, names) if options.revoke else []
    struck = opened.register.without_enclaves(names)
    if found:
        revoked = struck.with_revoked((one.serial for one in found), now)
        publish_crl(opened, revoked, options.access, now)
    else:
        with opened.batch() as batch:
            batch.record(struck)
        if options.revoke:
            restore_crl(opened, options.access, now)
    known = {one.enclave for one in opened.register.certificates.values() if one.revoked is not None}
    return [
        f"no certificate of {name} by the present identity CA is on record, nothing to revoke"
        for name in names
        if options.revoke and name not in known
    ]


def revoke_replaced(opened: Store, names: Iterable[str], access: CaAccess, now: datetime) -> int:
    """Revoke the past certificates of these enclaves, not the present ones; return how many."""
    found = revocable(KeystoreView(opened.root), opened.register, names)
    serials = {one.serial for one in found if not one.in_force}
    if serials:
        publish_crl(opened, opened.register.with_revoked(serials, now), access, now)
    return len(serials)


def _delete(opened: Store, name: str) -> None:
    """Delete exactly the files of this enclave; the root's governance belongs to the keystore."""
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
