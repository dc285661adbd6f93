"""Signed documents of this keystore, given out only after their signature was checked.

What is about to be signed again must have been signed by us before: by the present permissions CA, by one
of the trust bundle during a roll-over, or by a retired one.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import printable
from keystore.formats.certificate import CertificateFacts, read_certificates
from keystore.formats.role import Role
from keystore.signing import smime


def trusted_document(view: KeystoreView, relative: str) -> bytes:
    """The XML inside a ``.p7s``; raises DamagedKeystoreError when none of this keystore's CAs signed it."""
    place = printable(view.root / relative)
    signed = smime.read(safe_files.read(view.root, relative), place)
    smime.check(signed, list(own_permissions_cas(view)), place)
    return signed.document


def own_permissions_cas(view: KeystoreView) -> Iterator[CertificateFacts]:
    """The permissions CAs of this keystore: those in force, a shared one, and retired ones."""
    yield from view.ca_bundle(Role.PERMISSIONS)
    names = [layout.SHARED_CA_CERT]
    if os.path.isdir(view.root / layout.RETIRED):
        names += [f"{layout.RETIRED}/{name}" for name in sorted(os.listdir(view.root / layout.RETIRED))]
    for name in names:
        pem = safe_files.read_if_there(view.root, name)
        if pem is not None and name.endswith(".cert.pem"):
            yield from read_certificates(pem, printable(view.root / name))
