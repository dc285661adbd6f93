"""A keystore given another governance: signed when it differs, copies in enclaves kept in step."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from keystore.disk import layout, lock, safe_files
from keystore.disk.copies import refresh_copies
from keystore.disk.governance_file import governance_stands, signed_governance
from keystore.disk.safe_files import resolve_root
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError
from keystore.formats.governance import Governance, governance_document
from keystore.formats.role import Role
from keystore.formats.validity import utc_now
from keystore.signing.ca_access import CaAccess
from keystore.steps.governance_signing import write_governance
from keystore.steps.opening import opened_for_change


@dataclass(frozen=True, slots=True)
class GovernanceOptions:
    """How ``set_governance`` signs, waits for the lock, and syncs to the disk."""

    access: CaAccess = field(default_factory=CaAccess)
    lock_timeout: float = lock.DEFAULT_TIMEOUT
    durable: bool = True


def set_governance(
    keystore: Path | str, governance: Governance, *, options: GovernanceOptions | None = None
) -> bool:
    """Sign ``governance`` and put it in force; whether it differs from before.

    It must be deployed to all participants at once: those with different protection kinds do not talk.
    """
    chosen = options or GovernanceOptions()
    root = resolve_root(keystore)
    KeystoreView(root).require_complete()
    document = governance_document(governance)
    now = utc_now()
    with opened_for_change(root, now, timeout=chosen.lock_timeout, durable=chosen.durable) as opened:
        view = KeystoreView(root)
        changed = not _stands(view, document) or opened.register.governance != document
        if changed:
            write_governance(opened, document, view.authority(Role.PERMISSIONS, chosen.access), now)
        refresh_copies(opened)
    return changed


def _stands(view: KeystoreView, document: bytes) -> bool:
    """Whether exactly ``document`` is in force; what cannot be read is not."""
    try:
        signed = signed_governance(view)
    except DamagedKeystoreError:
        return False
    twin = safe_files.read_if_there(view.root, layout.GOVERNANCE_XML)
    return signed.document == document == twin and governance_stands(view, None)
