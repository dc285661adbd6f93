"""The governance document of a keystore: signed, mirrored in plain text, signed again where domains or signer changed.

Writes the keystore.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

from keystore.disk import layout, safe_files
from keystore.disk.governance_file import covers, governance_stands
from keystore.disk.store import Store
from keystore.disk.trusted_documents import trusted_document
from keystore.disk.view import KeystoreView
from keystore.errors import printable
from keystore.formats.domains import Domains
from keystore.formats.governance import governance_document, parse_governance
from keystore.formats.role import Role
from keystore.signing.authority import Authority
from keystore.signing.ca_access import CaAccess
from keystore.signing.smime import sign_document


def mirror_governance(opened: Store) -> bool:
    """Rewrite ``governance.xml`` from the signed document if it differs. Returns whether it did."""
    present = safe_files.read_if_there(opened.root, layout.GOVERNANCE_XML)
    document = trusted_document(KeystoreView(opened.root), layout.GOVERNANCE)
    if present is None or present.replace(b"\r\n", b"\n") == document:
        return False
    with opened.batch() as batch:
        batch.file(layout.GOVERNANCE_XML, document)
    return True


def write_governance(opened: Store, document: bytes, permissions_ca: Authority, now: datetime) -> None:
    """Record, sign and publish it."""
    signed = sign_document(document, permissions_ca, now)
    with opened.batch() as batch:
        batch.record(replace(opened.register, governance=document))
        batch.file(layout.GOVERNANCE_XML, document)
        batch.file(layout.GOVERNANCE, signed)


def renew_governance(opened: Store, domains: Domains, access: CaAccess, now: datetime) -> bool:
    """Sign the governance again if it is not the one signed last, or its domains or signer no longer fit.

    Returns whether it did.

    Raises InvalidInputError when it has several rules and none for a domain: then a person must decide.
    """
    view = KeystoreView(opened.root)
    if governance_stands(view, domains, opened.register):
        return False
    document = opened.register.governance or trusted_document(view, layout.GOVERNANCE)
    governance = parse_governance(document, printable(view.root / layout.GOVERNANCE))
    if not covers(governance.domains(), domains):
        document = governance_document(governance.extended_to(domains))
    write_governance(opened, document, view.authority(Role.PERMISSIONS, access), now)
    return True
