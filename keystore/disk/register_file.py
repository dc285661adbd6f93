"""Read the register from disk, and compare the trusted CAs with it: cheap, before each launch. ``store`` writes it."""

from __future__ import annotations

import hashlib
import os
from functools import lru_cache
from pathlib import Path

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import UnsafeKeystoreError
from keystore.formats.certificate import CertificateFacts
from keystore.formats.register import Register, parse_register
from keystore.formats.role import Role

_parsed = lru_cache(maxsize=2)(parse_register)
"""By content: a launch asks before each of its processes."""


def read_register(root: Path) -> Register | None:
    """Read the register, None without one. Raises DamagedKeystoreError, UnsafeKeystoreError if others can write it."""
    if not os.path.lexists(f"{root}/{layout.REGISTER}"):
        return None
    text = safe_files.read_private(root, layout.REGISTER)
    return _parsed(text, quoted(root / layout.REGISTER))


def needs_register(view: KeystoreView) -> bool:
    """Return whether this keystore issues but has no register: SROS2 made it, or the file was lost."""
    return (
        not os.path.lexists(view.root / layout.REGISTER)
        and all(os.path.isfile(view.root / layout.ca_cert(role)) for role in Role)
        and any(view.key_file(role) is not None for role in Role)
    )


def foreign_authorities(view: KeystoreView, register: Register | None) -> list[tuple[Role, CertificateFacts]]:
    """Return trusted CAs that this keystore neither made nor was given, or has retired; none without a register."""
    if register is None:
        return []
    return [
        (role, ca)
        for role in Role
        for ca in view.ca_bundle(role)
        if not register.trusts_authority(role, ca.der)
    ]


def refuse_foreign_authorities(view: KeystoreView, register: Register | None) -> None:
    """Raise UnsafeKeystoreError for a trusted CA that this keystore did not make.

    Whoever holds the key of such a CA can make enclaves that Fast DDS lets in.
    """
    for role, ca in foreign_authorities(view, register):
        place = quoted(view.root / layout.ca_cert(role))
        raise UnsafeKeystoreError(
            f"{place} holds a CA that this keystore did not make, or has retired: {describe(ca)}. Find out who put it "
            f"there; to remove it: secure-keystore renew {quoted(view.root)}"
        )


def describe(ca: CertificateFacts) -> str:
    """Return its name and the SHA-256 fingerprint that openssl and browsers show."""
    digest = hashlib.sha256(ca.der).hexdigest().upper()
    pairs = ":".join(digest[at : at + 2] for at in range(0, len(digest), 2))
    return f"{quoted(ca.common_name or 'without a common name')}, SHA-256 {pairs}"
