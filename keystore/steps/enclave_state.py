"""One enclave on disk against what it should be: what is missing, stale or wrong. Reads only.

Every launch asks this of every enclave: bytes, dates, modes, links and signatures, without an XML parser. Whatever is
not in the form that we write counts as wrong: DDS implementations may read something else in it.
"""

from __future__ import annotations

import os
import shlex
import stat
from collections.abc import Callable
from datetime import datetime, timedelta
from enum import Enum
from typing import NamedTuple

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import (
    DamagedKeystoreError,
    KeystoreError,
    OtherFormError,
    SigningUnavailableError,
    UnsafeKeystoreError,
)
from keystore.formats.certificate import CertificateFacts
from keystore.formats.permissions_document import parse_permissions, taken_away
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.subject import names_enclave, subject_name
from keystore.formats.validity import BACKDATE, Validity, iso
from keystore.signing import smime
from keystore.signing.certificate_request import public_half, request_key
from keystore.signing.private_key import spki
from keystore.signing.public_key import fingerprint, is_our_form, issued_by, key_matches

PermissionsSource = Callable[[str, Validity], "bytes | None"]
"""(subject name, validity of the certificate) -> the document it should have; None: keep what it has."""


NEW = "new enclave"
OTHER_PERMISSIONS = "other permissions"


class Reissue(Enum):
    """The parts of an enclave's identity that must be issued again."""

    NOTHING = "nothing"
    CERTIFICATE = "certificate"  # for the key that is there
    KEY_PAIR = "key pair"


class EnclaveState(NamedTuple):
    """The state of one enclave on disk. ``reasons`` are for reports; without them nothing is to be done.

    ``validity``: from when until when certificate and permissions hold, where they were seen to say the same.
    """

    enclave: str
    reissue: Reissue
    facts: CertificateFacts | None
    permissions: bool
    links: tuple[str, ...]
    reasons: tuple[str, ...]
    validity: Validity | None = None
    incident: bool = False
    """Its key is not the one issued for it, or others could read it: what it had must be revoked."""

    @property
    def is_good(self) -> bool:
        return self.reissue is Reissue.NOTHING and not (self.permissions or self.links)


class _Enclave(NamedTuple):
    view: KeystoreView
    register: Register | None
    name: str
    directory: str
    now: datetime
    due: datetime

    def read(self, file: str) -> bytes | None:
        return safe_files.read_if_there(self.view.root, f"{self.directory}/{file}")


def inspect(
    view: KeystoreView,
    register: Register | None,
    name: str,
    wanted: PermissionsSource,
    now: datetime,
    due: datetime,
) -> EnclaveState:
    """Inspect what an enclave has.

    Certificates that expire before ``due`` count as stale (``now``: only the expired). ``register`` is None on a host
    that issues nothing. Raises UnsafeKeystoreError for links, owners and modes that let others in.
    """
    enclave = _Enclave(view, register, name, layout.enclave_directory(name), now, due)
    wanted_links = layout.enclave_links(name, crl=view.has_crl)
    if not _is_there(view, enclave.directory):
        return EnclaveState(name, Reissue.KEY_PAIR, None, True, tuple(wanted_links), (NEW,))
    reissue, facts, problem, incident = _identity(enclave)
    reasons = [problem] if problem else []
    validity = None
    permissions = reissue is not Reissue.NOTHING or facts is None
    if reissue is Reissue.NOTHING and facts is not None and facts.common_name is not None:
        expected = wanted(subject_name(facts.common_name), facts.validity)
        unlike = _permissions_problem(enclave, expected)
        permissions = unlike is not None
        reasons += [unlike] if unlike else []
        validity = facts.validity if expected is not None and not permissions else None
    links = tuple(link for link, target in wanted_links.items() if not _link_stands(enclave, link, target))
    if links and reasons != [NEW]:
        reasons.append(f"{', '.join(links)} missing or out of step")
    return EnclaveState(name, reissue, facts, permissions, links, tuple(reasons), validity, incident)


def beyond_and_missing(
    view: KeystoreView, state: EnclaveState, wanted: PermissionsSource
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what the signed permissions grant beyond what is wanted, and what they lack; nothing if unreadable."""
    if state.facts is None or state.facts.common_name is None:
        return (), ()
    place = layout.PERMISSIONS
    try:
        signed = safe_files.read(view.root, layout.enclave_file(state.enclave, place))
        present = parse_permissions(smime.read(signed, place).document, place)
        document = wanted(subject_name(state.facts.common_name), state.facts.validity)
        requested = parse_permissions(document, place) if document is not None else present
    except KeystoreError:
        return (), ()
    return taken_away(present, requested), taken_away(requested, present)


def granted_lifetime(view: KeystoreView, register: Register | None, enclave: str) -> timedelta | None:
    """Returns the lifetime of the certificate issued last, as it was granted; None where it is not known."""
    issued = register.of_enclave(enclave) if register is not None else []
    if not issued:
        return None
    last = issued[-1]
    if last.lifetime is not None:
        return timedelta(seconds=last.lifetime)
    if any(last.not_after == ca.validity.not_after for role in Role for ca in view.ca_bundle(role)):
        return None  # cut to the life of its CA
    return max(last.not_after - last.not_before - BACKDATE, timedelta(hours=1))


def _is_there(view: KeystoreView, directory: str) -> bool:
    """Return whether the enclave's directory exists; raises UnsafeKeystoreError if it or one above is a link."""
    path = f"{view.root}/{layout.ENCLAVES}"
    for part in directory.split("/")[1:]:
        path = f"{path}/{part}"
        try:
            if stat.S_ISLNK(os.lstat(path).st_mode):
                raise UnsafeKeystoreError(
                    f"{quoted(path)} is a link; an enclave must be a real directory. "
                    f"Remove it: rm {shlex.quote(path)}"
                )
        except FileNotFoundError:
            return False
    return True


class _Found(NamedTuple):
    reissue: Reissue
    facts: CertificateFacts | None
    problem: str | None = None
    incident: bool = False


def _identity(enclave: _Enclave) -> _Found:
    mode = _key_mode(enclave)
    key, facts = enclave.read(layout.KEY), enclave.view.readable_certificate(enclave.name)
    has_cert = facts is not None or enclave.read(layout.CERT) is not None
    request = (
        safe_files.read_if_there(enclave.view.root, layout.request(enclave.name)) if key is None else None
    )
    if request is not None:
        # The key is on its host; ``private/`` holds the request that was accepted, so it may be certified again.
        public = request_key(request, f"the request of {enclave.name}").spki
        matches = facts is not None and facts.public_key == public
        problem = _certificate_problem(enclave, facts, matches) if has_cert else "no certificate"
        return _Found(Reissue.CERTIFICATE if problem else Reissue.NOTHING, facts, problem)
    if key is None and enclave.read(layout.KEY_URI) is not None:
        # The key is in a token, and the certificate says which one it is.
        problem = _certificate_problem(enclave, facts, True) if has_cert else "no certificate"
        return _Found(Reissue.CERTIFICATE if problem else Reissue.NOTHING, facts, problem)
    if key is None:
        return _Found(Reissue.KEY_PAIR, facts, "no private key" if has_cert else NEW)
    if mode & 0o077:
        return _Found(Reissue.KEY_PAIR, facts, f"others could read its private key (mode {mode:04o})", True)
    if not is_our_form(key):
        why = "its private key is not in the form that is written here"
        return _Found(Reissue.KEY_PAIR, facts, why, enclave.register is not None)
    matches = facts is not None and key_matches(key, facts)
    problem = _certificate_problem(enclave, facts, matches) if has_cert else "no certificate"
    if problem is None:
        return _Found(Reissue.NOTHING, facts)
    if enclave.register is not None and not _key_is_ours(enclave, enclave.register, key):
        return _Found(Reissue.KEY_PAIR, facts, f"its private key was not issued here ({problem})", True)
    return _Found(Reissue.CERTIFICATE, facts, problem)


def _key_mode(enclave: _Enclave) -> int:
    path = f"{enclave.view.root}/{enclave.directory}/{layout.KEY}"
    try:
        info = os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        return 0
    if not stat.S_ISREG(info.st_mode):
        raise UnsafeKeystoreError(f"{quoted(path)} is not a regular file; remove it")
    if problem := safe_files.private_problem(path, info):
        raise UnsafeKeystoreError(problem)
    return stat.S_IMODE(info.st_mode)


def _certificate_problem(enclave: _Enclave, facts: CertificateFacts | None, matches_key: bool) -> str | None:
    if facts is None:
        return "the certificate cannot be read"
    if not names_enclave(facts.common_name, enclave.name):
        return "the certificate names another subject"
    if not issued_by(facts, enclave.view.ca(Role.IDENTITY)):
        return "the certificate is by another CA"
    if enclave.now < facts.validity.not_before:
        return (
            f"the certificate is not yet valid (from {iso(facts.validity.not_before)}; is the clock right?)"
        )
    if enclave.now > facts.validity.not_after:
        return "the certificate is expired"
    if facts.validity.not_after < enclave.due:
        return "the certificate expires soon"
    if not matches_key:
        return "the certificate belongs to another key"
    return _record_problem(enclave.register, enclave.name, facts.serial)


def _record_problem(register: Register | None, enclave: str, serial: int) -> str | None:
    if register is None:
        return None
    record = register.certificates.get(serial)
    if record is None or record.enclave != enclave:
        return "the certificate was not issued here for this enclave"
    if record.revoked is not None:
        return "the certificate is revoked"
    if record.replaced:
        return "the certificate is an earlier one, put back or left by an interrupted run"
    return None


def _key_is_ours(enclave: _Enclave, register: Register, key_pem: bytes) -> bool:
    """Return whether the key is that of the certificate in force, or of one by the present CA that is not revoked.

    Only such a key is certified again. A certificate of an earlier CA proves nothing, since nothing revokes it.
    """
    try:
        present = fingerprint(spki(public_half(key_pem, "the enclave's key")))
    except SigningUnavailableError:
        return False
    issuer = fingerprint(enclave.view.ca(Role.IDENTITY).der)
    return any(
        one.key == present and one.revoked is None and (one.in_force or one.issuer == issuer)
        for one in register.of_enclave(enclave.name)
    )


def _permissions_problem(enclave: _Enclave, expected: bytes | None) -> str | None:
    signed = enclave.read(layout.PERMISSIONS)
    if signed is None:
        return "no permissions"
    try:
        present = smime.read(signed, f"{enclave.directory}/{layout.PERMISSIONS}")
    except DamagedKeystoreError:
        return "the signed permissions cannot be read: they are not in the form that is written here"
    ca = enclave.view.ca(Role.PERMISSIONS)
    try:
        smime.check(present, [ca], enclave.directory)
    except DamagedKeystoreError:
        return "the permissions are signed by another CA"
    if not present.embeds(ca.der):
        return "the permissions are signed by another CA"
    document = present.document
    if expected is not None and document != expected:
        return OTHER_PERMISSIONS
    if expected is None:
        try:
            parse_permissions(document)
        except OtherFormError:
            return "the signed permissions are not, byte for byte, what is written here"
    twin = enclave.read(layout.PERMISSIONS_XML)
    # A deployed enclave has none: nothing reads it but people.
    if twin is None or twin.replace(b"\r\n", b"\n") == document:
        return None
    return "permissions.xml differs from what is signed"


def _link_stands(enclave: _Enclave, name: str, target: str) -> bool:
    """Return whether there is a link to ``target``, or what a file system without links has instead: a copy."""
    present = safe_files.link_target(enclave.view.root, f"{enclave.directory}/{name}")
    if present is not None:
        return present == target
    copy = enclave.read(name)
    return copy is not None and copy == safe_files.read_if_there(enclave.view.root, layout.link_source(name))
