"""One enclave on disk against what it should be: what is missing, stale or wrong, by cheap means. Reads only.

Every launch asks this of every enclave: no ``cryptography``, no XML parser, some twenty system calls. It compares
bytes, dates, modes and links; it does not check signatures, which DDS does at start and ``keystore.verify`` on request.
"""

from __future__ import annotations

import os
import shlex
import stat
from collections.abc import Callable
from datetime import datetime
from enum import Enum
from typing import NamedTuple

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystore, UnsafeKeystore, printable
from keystore.formats import certificate
from keystore.formats.certificate import CertificateFacts
from keystore.formats.der import DerError
from keystore.formats.role import Role
from keystore.formats.subject import SubjectScheme, common_name, subject_name
from keystore.formats.validity import Validity
from keystore.signing import smime
from keystore.signing.key_pair import key_matches

PermissionsSource = Callable[[str, Validity], "bytes | None"]
"""(subject name, validity of the certificate) -> the document it should have; None: keep what it has."""


NEW = "new enclave"
OTHER_PERMISSIONS = "other permissions"


class Reissue(Enum):
    """What of an enclave's identity must be issued anew."""

    NOTHING = "nothing"
    CERTIFICATE = "certificate"  # for the key that is there
    KEY_PAIR = "key pair"


class EnclaveState(NamedTuple):
    """``reasons`` are for reports; without them nothing is to be done.

    ``validity``: from when until when certificate and permissions hold, where they were seen to say the same.
    """

    enclave: str
    reissue: Reissue
    facts: CertificateFacts | None
    permissions: bool
    links: tuple[str, ...]
    lax_key: bool
    reasons: tuple[str, ...]
    validity: Validity | None = None

    @property
    def is_good(self) -> bool:
        return self.reissue is Reissue.NOTHING and not (self.permissions or self.links or self.lax_key)

    @property
    def exists(self) -> bool:
        return self.reissue is not Reissue.KEY_PAIR or self.facts is not None


def inspect(
    view: KeystoreView, enclave: str, wanted: PermissionsSource, now: datetime, due: datetime
) -> EnclaveState:
    """``due``: certificates that end before it count as stale (``now`` for: only the expired).

    Raises UnsafeKeystore for links, owners and modes that let others in.
    """
    directory = layout.enclave_directory(enclave)
    wanted_links = layout.enclave_links(enclave, crl=view.has_crl)
    if not _is_there(view, directory):
        return EnclaveState(enclave, Reissue.KEY_PAIR, None, True, tuple(wanted_links), False, (NEW,))
    reasons: list[str] = []
    lax = _key_mode(view, directory)
    reissue, facts = _identity(view, enclave, directory, now, due, reasons)
    if lax:
        reasons.append("the private key was readable by others")
    validity = None
    permissions = reissue is not Reissue.NOTHING or facts is None
    if reissue is Reissue.NOTHING and facts is not None and facts.common_name is not None:
        expected = wanted(subject_name(facts.common_name), facts.validity)
        permissions = not _permissions_stand(view, directory, expected, reasons)
        validity = facts.validity if expected is not None and not permissions else None
    links = tuple(
        name for name, target in wanted_links.items() if not _link_stands(view, f"{directory}/{name}", target)
    )
    if links and reasons != [NEW]:
        reasons.append(f"{', '.join(links)} missing or out of step")
    return EnclaveState(enclave, reissue, facts, permissions, links, lax is True, tuple(reasons), validity)


def _is_there(view: KeystoreView, directory: str) -> bool:
    """Whether the enclave's directory exists; raises UnsafeKeystore when it or one above is a link."""
    path = f"{view.root}/{layout.ENCLAVES}"
    for part in directory.split("/")[1:]:
        path = f"{path}/{part}"
        try:
            if stat.S_ISLNK(os.lstat(path).st_mode):
                raise UnsafeKeystore(
                    f"{printable(path)} is a link; an enclave must be a real directory. "
                    f"Remove it: rm {shlex.quote(path)}"
                )
        except FileNotFoundError:
            return False
    return True


def _key_mode(view: KeystoreView, directory: str) -> bool | None:
    """None without a key, else whether others can read it."""
    path = f"{view.root}/{directory}/{layout.KEY}"
    try:
        info = os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        return None
    if not stat.S_ISREG(info.st_mode):
        raise UnsafeKeystore(f"{printable(path)} is not a regular file; remove it")
    if problem := safe_files.private_problem(path, info):
        raise UnsafeKeystore(problem)
    return bool(info.st_mode & 0o077)


def _identity(
    view: KeystoreView, enclave: str, directory: str, now: datetime, due: datetime, reasons: list[str]
) -> tuple[Reissue, CertificateFacts | None]:
    key = safe_files.read_if_there(view.root, f"{directory}/{layout.KEY}")
    cert = safe_files.read_if_there(view.root, f"{directory}/{layout.CERT}")
    facts = _facts(cert)
    if key is None:
        reasons.append("no private key" if cert is not None else NEW)
        return Reissue.KEY_PAIR, facts
    problem = (
        _certificate_problem(view, enclave, key, facts, now, due) if cert is not None else "no certificate"
    )
    if problem is None:
        return Reissue.NOTHING, facts
    reasons.append(problem)
    return Reissue.CERTIFICATE, facts


def _facts(cert: bytes | None) -> CertificateFacts | None:
    try:
        return certificate.read_pem(cert) if cert is not None else None
    except DerError:
        return None


def _certificate_problem(
    view: KeystoreView, enclave: str, key: bytes, facts: CertificateFacts | None, now: datetime, due: datetime
) -> str | None:
    if facts is None:
        return "the certificate cannot be read"
    if facts.common_name != enclave and all(
        facts.common_name != common_name(enclave, scheme) for scheme in SubjectScheme
    ):
        return "the certificate names another subject"
    if not facts.names_issuer(view.ca(Role.IDENTITY)):
        return "the certificate is by another CA"
    if not facts.validity.covers(now):
        return "the certificate is expired or not yet valid"
    if facts.validity.not_after < due:
        return "the certificate expires soon"
    if not key_matches(key, facts):
        return "the certificate belongs to another key"
    return None


def _permissions_stand(
    view: KeystoreView, directory: str, expected: bytes | None, reasons: list[str]
) -> bool:
    """Whether exactly ``expected`` is signed by our CA, None: whatever it is."""
    signed = safe_files.read_if_there(view.root, f"{directory}/{layout.PERMISSIONS}")
    if signed is None:
        reasons.append("no permissions")
        return False
    try:
        present = smime.read(signed, f"{directory}/{layout.PERMISSIONS}")
    except DamagedKeystore:
        reasons.append("the signed permissions cannot be read")
        return False
    if not present.embeds(view.ca(Role.PERMISSIONS).der):
        reasons.append("the permissions are signed by another CA")
        return False
    document = present.document
    if expected is not None and document != expected:
        reasons.append(OTHER_PERMISSIONS)
        return False
    twin = safe_files.read_if_there(view.root, f"{directory}/{layout.PERMISSIONS_XML}")
    # A deployed enclave has none: nothing reads it but people.
    if twin is None or twin.replace(b"\r\n", b"\n") == document:
        return True
    reasons.append("permissions.xml differs from what is signed")
    return False


def _link_stands(view: KeystoreView, relative: str, target: str) -> bool:
    """A link to ``target``, or what a file system without links has instead: a copy."""
    present = safe_files.link_target(view.root, relative)
    if present is not None:
        return present == target
    copy = safe_files.read_if_there(view.root, relative)
    name = relative.rpartition("/")[2]
    return copy is not None and copy == safe_files.read_if_there(view.root, layout.link_source(name))
