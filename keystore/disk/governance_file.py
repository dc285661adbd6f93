"""The governance in force: which domains it covers, whether it stands. Cheap: asked before a launch."""

from __future__ import annotations

import re

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, printable
from keystore.formats.domains import Domains
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.signing import smime

_IDS = re.compile(rb"<id>\s*(\d{1,3})\s*</id>|<min>\s*(\d{1,3})\s*</min>\s*<max>\s*(\d{1,3})\s*</max>")


def signed_governance(view: KeystoreView) -> smime.SignedDocument:
    """What is in force (``governance.p7s``), not checked."""
    place = printable(view.root / layout.GOVERNANCE)
    return smime.read(safe_files.read(view.root, layout.GOVERNANCE), place)


def governance_domains(view: KeystoreView) -> Domains:
    """The domains the governance in force lists, read cheaply; raises DamagedKeystoreError when there are none."""
    return _listed_domains(signed_governance(view), view)


def _listed_domains(signed: smime.SignedDocument, view: KeystoreView) -> Domains:
    found = _IDS.findall(signed.document)
    if not found:
        raise DamagedKeystoreError(f"{printable(view.root / layout.GOVERNANCE)} lists no domain")
    return Domains(tuple((int(one or low), int(one or high)) for one, low, high in found))


def governance_stands(view: KeystoreView, domains: Domains | None, register: Register | None = None) -> bool:
    """Cheaply: signed by the present permissions CA, the one signed last as far as the register is here to say so,
    and each of ``domains`` is listed in it."""
    signed = signed_governance(view)
    if not signed.embeds(view.ca(Role.PERMISSIONS).der):
        return False
    if register is not None and register.governance and signed.document != register.governance:
        return False
    return domains is None or covers(_listed_domains(signed, view), domains)


def covers(outer: Domains, inner: Domains) -> bool:
    """Whether ``outer`` has every domain of ``inner``."""
    return all(
        any(low <= first and last <= high for low, high in outer.ranges) for first, last in inner.ranges
    )
