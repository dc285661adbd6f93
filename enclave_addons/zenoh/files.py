"""Expected files for Zenoh, derived from the rest of the keystore. Reads only.

Everything follows from certificates in force and permissions as signed, so that whatever changes these (a launch, a
renewal, a revocation, another CA) changes the router's rules too. An enclave is on Zenoh where it has ``zenoh.json5``.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Iterable
from datetime import datetime
from typing import NamedTuple

from enclave_addons.zenoh.configuration import (
    ROUTER_NAME,
    RouterAddress,
    Subject,
    TlsFiles,
    router_configuration,
    session_configuration,
)
from enclave_addons.zenoh.grants import grants_of_topics
from enclave_addons.zenoh.rules import access_rules
from enclave_addons.zenoh.types import types_of_shares
from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.disk.crl_file import revoked_serials
from keystore.disk.register_file import read_register
from keystore.disk.share_files import read_shares
from keystore.disk.signed_documents import own_document
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, InvalidInputError, KeystoreError
from keystore.formats.certificate import CertificateFacts, read_certificate
from keystore.formats.compact import expanded
from keystore.formats.permissions_document import parse_permissions
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.subject import subject_name
from keystore.formats.validity import iso
from keystore.signing.public_key import issued_by, key_matches

_WRITTEN_BY = "secure-keystore"


class RouterFile(NamedTuple):
    """The configuration of a router. ``subjects``: the enclaves that the router lets in. ``gaps``: what of their
    permissions Zenoh cannot grant, and enclaves that are shut out, in words."""

    content: bytes
    subjects: tuple[Subject, ...]
    gaps: tuple[str, ...]

    @property
    def served(self) -> tuple[str, ...]:
        """Return the enclaves with rules."""
        return tuple(one.enclave for one in self.subjects if one.rules)


def session_content(view: KeystoreView, enclave: str, address: RouterAddress) -> bytes:
    """Return the session configuration for a process in ``enclave``, whose files it names by their path."""
    directory = f"{view.root}/{layout.enclave_directory(enclave)}"
    authorities = f"{directory}/{Role.IDENTITY.value}.cert.pem"
    files = TlsFiles(authorities, f"{directory}/{layout.CERT}", f"{directory}/{layout.KEY}")
    return session_configuration([address.endpoint], files)


def present_address(view: KeystoreView) -> RouterAddress | None:
    """Return the address in the router's file; None without one. Raises DamagedKeystoreError for a file that is not
    ours.
    """
    text = safe_files.read_if_there(view.root, layout.ZENOH_ROUTER)
    if text is None:
        return None
    try:
        return RouterAddress.parse(str(json.loads(text)["metadata"]["address"]))
    except (ValueError, KeyError, TypeError, RecursionError, InvalidInputError):
        raise DamagedKeystoreError(
            f"{quoted(view.root / layout.ZENOH_ROUTER)} was not written by secure-keystore; remove it, and run "
            "secure-keystore zenoh"
        ) from None


def router_file(view: KeystoreView, enclaves: Iterable[str], address: RouterAddress) -> RouterFile:
    """Return the router's configuration for these enclaves; raises a KeystoreError for what concerns all of them."""
    register = read_register(view.root)
    revoked = frozenset(revoked_serials(view))
    subjects: list[Subject] = []
    gaps: list[str] = []
    for enclave in enclaves:
        try:
            subject, missing = _subject(view, register, revoked, enclave)
        except KeystoreError as error:
            gaps.append(f"enclave {enclave} is shut out on Zenoh: {error}")
            continue
        subjects.append(subject)
        gaps += [f"enclave {enclave}: not granted on Zenoh: {one}" for one in missing]
    root = view.root
    files = TlsFiles(
        f"{root}/{layout.ca_cert(Role.IDENTITY)}", f"{root}/{layout.ZENOH_ROUTER_CERT}",
        f"{root}/{layout.ZENOH_ROUTER_KEY}",
    )  # fmt: skip
    metadata = {"written_by": _WRITTEN_BY, "address": str(address), "trusts": _trust(view)}
    content = router_configuration([address.listens], files, subjects, metadata)
    return RouterFile(content, tuple(subjects), tuple(gaps))


def identity_problem(view: KeystoreView, due: datetime) -> str | None:
    """Return what is wrong with the router's key pair: it has to be whole, private, by the CA in use, and hold until
    ``due``.

    Raises UnsafeKeystoreError for a key that others could have written.
    """
    key = router_key(view)
    if key is None:
        return "its private key is missing, or others could read it"
    pem = safe_files.read_if_there(view.root, layout.ZENOH_ROUTER_CERT)
    if pem is None:
        return "its certificate is missing"
    facts, ca = read_certificate(pem, quoted(view.root / layout.ZENOH_ROUTER_CERT)), view.ca(Role.IDENTITY)
    if facts.common_name != ROUTER_NAME or not issued_by(facts, ca):
        return "its certificate is not one that the identity CA issued for a router"
    if facts.validity.not_after < min(due, ca.validity.not_after):
        return f"its certificate expires {iso(facts.validity.not_after)}"
    return None if key_matches(key, facts) else "its private key belongs to another certificate"


def router_key(view: KeystoreView) -> bytes | None:
    """Return the key; None for a missing one, and for one that others could read: whoever has it can play
    the router.
    """
    path = view.root / layout.ZENOH_ROUTER_KEY
    if not os.path.lexists(path) or stat.S_IMODE(os.lstat(path).st_mode) & 0o077:
        return None
    return safe_files.read_private(view.root, layout.ZENOH_ROUTER_KEY)


def _trust(view: KeystoreView) -> str:
    """Return a digest of all identity CAs: the router reads them when it starts, so another one changes its file."""
    return hashlib.sha256(b"".join(ca.der for ca in view.ca_bundle(Role.IDENTITY))).hexdigest()


def _subject(
    view: KeystoreView, register: Register | None, revoked: frozenset[int], enclave: str
) -> tuple[Subject, tuple[str, ...]]:
    """Return the enclave with its rules and gaps; raises a KeystoreError if it must not be served."""
    cert, place = (layout.enclave_file(enclave, name) for name in (layout.CERT, layout.PERMISSIONS))
    facts = read_certificate(safe_files.read(view.root, cert), quoted(view.root / cert))
    name = _common_name(register, revoked, enclave, facts)
    document = own_document(view, place)
    last = register.permissions(enclave) if register is not None else None
    if last is not None and last.document != hashlib.sha256(document).hexdigest():
        raise DamagedKeystoreError(f"{quoted(view.root / place)} is not what was signed last for it")
    permissions = parse_permissions(document, quoted(view.root / place))
    if permissions.subject != subject_name(name):
        raise DamagedKeystoreError(f"{quoted(view.root / place)} is not for {subject_name(name)}")
    types = types_of_shares(enclave, read_shares(view.root, enclave)) if register is not None else {}
    rules = expanded(permissions.rules)
    grants = grants_of_topics(rules.allow, rules.deny, types)
    return Subject(enclave, name, access_rules(enclave, grants, permissions.domains)), grants.gaps


def _common_name(
    register: Register | None, revoked: frozenset[int], enclave: str, facts: CertificateFacts
) -> str:
    """Return the name, only while no certificate with it is revoked: Zenoh knows no CRL."""
    name = facts.common_name
    if name is None:
        raise DamagedKeystoreError("its certificate has no common name")
    if facts.serial in revoked:
        raise DamagedKeystoreError("its certificate is revoked")
    if register is None:
        return name
    held = register.in_force(enclave)
    if held is None or held.serial != facts.serial:
        raise DamagedKeystoreError("its certificate is not the one issued last")
    if any(one.subject == name and one.revoked is not None for one in register.of_enclave(enclave)):
        raise DamagedKeystoreError(
            "a revoked certificate has the same name, and Zenoh goes by names; secure-keystore renew gives it another"
        )
    return name
