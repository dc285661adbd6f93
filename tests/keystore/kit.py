"""What the keystore tests share: small policies, fast options, openssl as the counterpart, snapshots of a tree."""

from __future__ import annotations

import os
import stat
import subprocess
from collections.abc import Iterable
from datetime import datetime, timedelta, timezone
from pathlib import Path

from cryptography import x509

from keystore import (
    CreateOptions,
    EnclavePolicy,
    Operation,
    Profile,
    ProvisionOptions,
    ProvisionReport,
    Qualifier,
    Rule,
    create_keystore,
    provision,
    verify,
)
from keystore.disk import layout
from keystore.disk.view import KeystoreView
from keystore.formats.certificate import CertificateFacts, read_certificate
from keystore.formats.permissions_document import parse_permissions
from keystore.steps.opening import taken_over

NOW = datetime(2031, 5, 1, 12, tzinfo=timezone.utc)
DAY = timedelta(days=1)
ARTICLE = ("/", "/a", "/a/b", "/b/a", "/a/b/c")
"""Names whose SROS2 subjects Cyclone DDS confuses."""


def policy(path: str, *topics: str) -> EnclavePolicy:
    rules = tuple(Rule(Operation.PUBLISH, Qualifier.ALLOW, topic) for topic in topics or ("/chatter",))
    return EnclavePolicy(path, (Profile("/", "talker", rules),))


def options(**changes: object) -> ProvisionOptions:
    """Without fsync and with a lock that does not make a failing test wait."""
    return ProvisionOptions(**{"durable": False, "lock_timeout": 5.0, **changes})  # type: ignore[arg-type]


def filled(root: Path, names: Iterable[str] = ("/a", "/b"), **changes: object) -> Path:
    """A keystore with these enclaves, each allowed to publish /chatter."""
    provision(root, [policy(name) for name in names], options=options(**changes))
    return root


def created(root: Path, **changes: object) -> Path:
    create_keystore(root, CreateOptions(**{"durable": False, **changes}))  # type: ignore[arg-type]
    return root


def actions(report: ProvisionReport) -> dict[str, tuple[str, ...]]:
    return {one.enclave: one.actions for one in report.enclaves if one.actions}


def openssl(*arguments: str | Path) -> str:
    """Output of openssl; fails the test with its message when it does not succeed."""
    done = subprocess.run(["openssl", *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def snapshot(root: Path) -> dict[str, tuple[int, int, bytes | str]]:
    """Path -> mode, mtime, content or link target; the lock file, which every writer signs, left out."""
    found: dict[str, tuple[int, int, bytes | str]] = {}
    for path in sorted(root.rglob("*")):
        info = path.lstat()
        content: bytes | str = b""
        if stat.S_ISLNK(info.st_mode):
            content = os.readlink(path)
        elif stat.S_ISREG(info.st_mode):
            content = path.read_bytes()
        if path.name != ".lock":
            found[path.relative_to(root).as_posix()] = (info.st_mode, info.st_mtime_ns, content)
    return found


def contents(root: Path) -> dict[str, bytes | str]:
    """A snapshot without times and modes, and without directories."""
    return {name: content for name, (mode, _, content) in snapshot(root).items() if not stat.S_ISDIR(mode)}


def codes(root: Path, now: datetime | None = None) -> set[str]:
    """Return the codes of the errors and exposures that ``verify`` finds."""
    return {finding.code for finding in verify(root, now=now).findings if finding.severity.fails}


def certificate_of(root: Path, name: str) -> CertificateFacts:
    return read_certificate((root / layout.enclave_file(name, layout.CERT)).read_bytes())


def granted(root: Path, name: str) -> set[str]:
    """The DDS topics that an enclave may publish, by what is signed."""
    document, _ = taken_over(KeystoreView(root), name)
    return set(parse_permissions(document).rules.allow.publish)


def crl_of(root: Path) -> x509.CertificateRevocationList:
    return x509.load_pem_x509_crl((root / layout.CRL).read_bytes())


def mode(path: Path) -> int:
    return stat.S_IMODE(path.lstat().st_mode)
