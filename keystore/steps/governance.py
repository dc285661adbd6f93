"""The governance document of a keystore: signed, mirrored in plain text, replaced by another. Writes the keystore."""

from __future__ import annotations

import shlex
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.disk.signed_documents import (
    governance_domains,
    governance_stands,
    own_document,
    signed_governance,
)
from keystore.disk.store import Store, refresh_copies
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import DamagedKeystoreError, KeystoreError, SigningUnavailableError
from keystore.formats.domains import Domains
from keystore.formats.governance import Governance, governance_document, parse_governance
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.validity import utc_now
from keystore.signing.authority import Authority
from keystore.signing.ca_access import CaAccess
from keystore.signing.smime import sign_document
from keystore.steps.opening import ChangeOptions, opened_for_change


def mirror_governance(opened: Store) -> bool:
    """Rewrite ``governance.xml`` from the signed document if it differs. Returns whether it did."""
    present, document = (
        safe_files.read_if_there(opened.root, layout.GOVERNANCE_XML),
        opened.register.governance,
    )
    if present is None or not document or present == document:
        return False
    with opened.batch() as batch:
        batch.file(layout.GOVERNANCE_XML, document)
    return True


def write_governance(opened: Store, document: bytes, permissions_ca: Authority, now: datetime) -> None:
    """Record, sign and publish it."""
    signed = sign_document(document, permissions_ca)
    with opened.batch() as batch:
        batch.record(replace(opened.register, governance=document))
        batch.file(layout.GOVERNANCE_XML, document)
        batch.file(layout.GOVERNANCE, signed)


def renew_governance(opened: Store, domains: Domains, access: CaAccess, now: datetime) -> bool:
    """Sign the governance again unless it fits; return whether it did. Raises InvalidInputError without a rule."""
    view = KeystoreView(opened.root)
    if governance_stands(view, domains, opened.register):
        return False
    _refuse_other_domains(view, domains)
    document = governance_for(view, opened.register, domains)
    write_governance(opened, document, view.authority(Role.PERMISSIONS, access), now)
    return True


def _refuse_other_domains(view: KeystoreView, domains: Domains) -> None:
    """Raise SigningUnavailableError with both cures, if the CA's key is not here and other domains are the reason."""
    if view.key_file(Role.PERMISSIONS) is not None:
        return
    governed = domains
    with suppress(KeystoreError):  # of a damaged governance, which is reported where it would be signed
        governed = governance_domains(view)
    if not governed.covers(domains):
        raise SigningUnavailableError(
            f"{quoted(view.root)} is for domain {governed}, and domain {domains} is asked for (ROS_DOMAIN_ID or "
            f"--domain-id); start in its domain (ROS_DOMAIN_ID={governed.ranges[0][0]}), or start once in domain "
            f"{domains} where the CA keys are, then export and import again"
        )


def governance_for(view: KeystoreView, register: Register, domains: Domains) -> bytes:
    """Return the governance signed last, extended to ``domains``.

    Raises DamagedKeystoreError if no CA of this keystore signed it, InvalidInputError without a rule.
    """
    try:
        document = register.governance or own_document(view, layout.GOVERNANCE)
        governance = parse_governance(document, quoted(view.root / layout.GOVERNANCE))
    except DamagedKeystoreError as error:
        raise DamagedKeystoreError(
            f"{error}; put yours in force: secure-keystore governance {shlex.quote(str(view.root))} FILE.yaml"
        ) from None
    if not governance.domains().covers(domains):
        document = governance_document(governance.extended_to(domains))
    return document


def set_governance(
    keystore: Path | str, governance: Governance, *, options: ChangeOptions | None = None
) -> bool:
    """Sign ``governance`` and put it in force; whether it differs from before.

    It must be deployed to all participants at once: those with different protection kinds do not talk.
    """
    chosen = options or ChangeOptions()
    root = keystore_at(keystore).root
    document = governance_document(governance)
    now = chosen.now or utc_now()
    with opened_for_change(root, now, chosen) as opened:
        view = KeystoreView(root)
        changed = not _stands(view, document) or opened.register.governance != document
        if changed:
            write_governance(opened, document, view.authority(Role.PERMISSIONS, chosen.access), now)
        refresh_copies(opened)
    return changed


def _stands(view: KeystoreView, document: bytes) -> bool:
    try:
        signed = signed_governance(view)
    except DamagedKeystoreError:
        return False
    twin = safe_files.read_if_there(view.root, layout.GOVERNANCE_XML)
    return signed.document == document == twin and governance_stands(view, None)
