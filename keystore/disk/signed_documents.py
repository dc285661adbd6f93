"""Documents that this keystore signed: the governance in force, and what may be signed again.

What is in force has exactly the form that we write. What is about to be signed again may have another one, such as
SROS2's, but must have been signed by us before: by the present permissions CA, by one of the trust bundle during a
roll-over, or by a retired one.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, KeystoreError, OtherFormError, printable
from keystore.formats.certificate import CertificateFacts, read_certificates
from keystore.formats.domains import Domains
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.signing import smime

_IDS = re.compile(rb"<id>\s*(\d{1,3})\s*</id>|<min>\s*(\d{1,3})\s*</min>\s*<max>\s*(\d{1,3})\s*</max>")


def signed_governance(view: KeystoreView) -> smime.SignedDocument:
    """Reads what is in force (``governance.p7s``); its signature is not checked. Raises DamagedKeystoreError."""
    place = printable(view.root / layout.GOVERNANCE)
    return smime.read(safe_files.read(view.root, layout.GOVERNANCE), place)


def governance_domains(view: KeystoreView) -> Domains:
    """Return the domains that the governance lists; raises DamagedKeystoreError if there are none."""
    place = printable(view.root / layout.GOVERNANCE)
    return _listed_domains(
        smime.read_any(safe_files.read(view.root, layout.GOVERNANCE), place).document, view
    )


def _listed_domains(document: bytes, view: KeystoreView) -> Domains:
    found = _IDS.findall(document)
    if not found:
        raise DamagedKeystoreError(f"{printable(view.root / layout.GOVERNANCE)} lists no domain")
    return Domains(tuple((int(one or low), int(one or high)) for one, low, high in found))


def governance_stands(view: KeystoreView, domains: Domains | None, register: Register | None = None) -> bool:
    """Returns whether the present permissions CA signed the governance, it is the one signed last as far as the
    register is here to say so, and it lists each of ``domains``."""
    try:
        signed = signed_governance(view)
        smime.check(signed, [view.ca(Role.PERMISSIONS)], layout.GOVERNANCE)
    except DamagedKeystoreError:
        return False
    if not signed.embeds(view.ca(Role.PERMISSIONS).der):
        return False
    if register is not None and register.governance and signed.document != register.governance:
        return False
    return domains is None or _listed_domains(signed.document, view).covers(domains)


def trusted_document(view: KeystoreView, relative: str) -> bytes:
    """Return the XML inside a ``.p7s`` of any form; raises DamagedKeystoreError if none of our CAs signed it."""
    place = printable(view.root / relative)
    signed = smime.read_any(safe_files.read(view.root, relative), place)
    smime.check(signed, list(own_permissions_cas(view)), place)
    return signed.document


def is_to_be_written_again(view: KeystoreView, relative: str, error: KeystoreError) -> bool:
    """Return whether only the form of a document is wrong: one of our CAs signed it, so a renewal writes it again."""
    if not isinstance(error, OtherFormError):
        return False
    try:
        trusted_document(view, relative)
    except KeystoreError:
        return False
    return True


def own_permissions_cas(view: KeystoreView) -> Iterator[CertificateFacts]:
    """Return the permissions CAs of this keystore: those in force, a shared one, and retired ones."""
    yield from view.ca_bundle(Role.PERMISSIONS)
    names = [layout.SHARED_CA_CERT]
    if os.path.isdir(view.root / layout.RETIRED):
        names += [f"{layout.RETIRED}/{name}" for name in sorted(os.listdir(view.root / layout.RETIRED))]
    for name in names:
        pem = safe_files.read_if_there(view.root, name)
        if pem is not None and name.endswith(".cert.pem"):
            yield from read_certificates(pem, printable(view.root / name))
