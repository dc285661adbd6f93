"""The governance of a keystore on disk: which domains it covers, whether it stands, signing it again."""

from __future__ import annotations

import re
from datetime import datetime

from keystore import layout, safe_files, smime
from keystore.authority import Role
from keystore.creation import write_governance
from keystore.domains import Domains
from keystore.errors import DamagedKeystore, printable
from keystore.governance import covers, governance_document, parse_governance
from keystore.signer import CaAccess
from keystore.store import Store
from keystore.trusted_documents import trusted_document
from keystore.view import KeystoreView

_IDS = re.compile(rb"<id>\s*(\d{1,3})\s*</id>|<min>\s*(\d{1,3})\s*</min>\s*<max>\s*(\d{1,3})\s*</max>")


def signed_governance(view: KeystoreView) -> smime.SignedDocument:
    """What is in force (``governance.p7s``), not checked."""
    place = printable(view.root / layout.GOVERNANCE)
    return smime.read(safe_files.read(view.root, layout.GOVERNANCE), place)


def governance_domains(view: KeystoreView) -> Domains:
    """The domains the governance in force lists, read cheaply; raises DamagedKeystore when there are none."""
    found = _IDS.findall(signed_governance(view).document)
    if not found:
        raise DamagedKeystore(f"{printable(view.root / layout.GOVERNANCE)} lists no domain")
    return Domains(tuple((int(one or low), int(one or high)) for one, low, high in found))


def governance_stands(view: KeystoreView, domains: Domains | None) -> bool:
    """Cheaply: signed by the present permissions CA, and each of ``domains`` is listed in it."""
    if not signed_governance(view).embeds(view.ca(Role.PERMISSIONS).der):
        return False
    return domains is None or covers(governance_domains(view), domains)


def renew_governance(opened: Store, domains: Domains, access: CaAccess, now: datetime) -> bool:
    """Sign the governance again if its domains or its signer no longer fit; whether that was needed.

    Raises InvalidInput when it has several rules and none for a domain: then a person must decide.
    """
    view = KeystoreView(opened.root)
    if governance_stands(view, domains):
        return False
    document = trusted_document(view, layout.GOVERNANCE)
    governance = parse_governance(document, printable(view.root / layout.GOVERNANCE))
    if not covers(governance.domains(), domains):
        document = governance_document(governance.extended_to(domains))
    write_governance(opened, document, view.authority(Role.PERMISSIONS, access), now)
    return True
