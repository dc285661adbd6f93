"""The whole keystore checked: files, CAs, governance, every enclave. Reads only, follows no strange link."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from keystore.add_ons import zenoh_files
from keystore.disk import layout, safe_files
from keystore.disk.crl_file import crls_in
from keystore.disk.deployed import find_differences
from keystore.disk.versions import imported_at
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import KeystoreError, NotInstalledError, WrongClockError, storage_errors
from keystore.formats.governance import Governance
from keystore.formats.register import Register
from keystore.formats.validity import utc_now
from keystore.signing.ca_access import CaAccess
from keystore.verification import repair
from keystore.verification.authorities import check_authorities
from keystore.verification.enclaves import check_enclaves
from keystore.verification.files import check_files, check_links, check_parents
from keystore.verification.finding import Finding as Finding
from keystore.verification.finding import Severity as Severity
from keystore.verification.issued import check_anchors, check_published, load_register
from keystore.verification.openssl import check_by_openssl


@dataclass(frozen=True, slots=True)
class VerifyReport:
    """The result of a verification. ``findings``: worst first, then by place."""

    keystore: Path
    enclaves: int
    findings: tuple[Finding, ...]

    @property
    def is_good(self) -> bool:
        """Return True if there are neither errors nor exposures."""
        return not any(finding.severity.fails for finding in self.findings)


class Requirements(NamedTuple):
    """Requirements of the user for a keystore. ``authorities``: SHA-256 fingerprints of all CAs to trust."""

    governance: Governance | None = None
    authorities: tuple[str, ...] = ()


def verify(
    keystore: Path | str,
    *,
    access: CaAccess | None = None,
    now: datetime | None = None,
    required: Requirements | None = None,
) -> VerifyReport:
    """Check everything; raises NotAKeystoreError only when there is nothing to check."""
    order = list(Severity)
    with storage_errors("checking the keystore"):
        for _ in range(_ATTEMPTS):
            view = keystore_at(keystore)
            before = _register_file(view)
            found = list(_findings(view, access or CaAccess(), now or utc_now(), required or Requirements()))
            found.extend(check_links(keystore))
            if not found or _register_file(view) == before:
                break  # otherwise a command wrote in between, and files of two states were compared
    found.sort(key=lambda finding: (order.index(finding.severity), finding.place, finding.code))
    return VerifyReport(view.root, len(view.enclaves()), tuple(found))


_ATTEMPTS = 5


def _register_file(view: KeystoreView) -> bytes | None:
    try:
        return safe_files.read_if_there(view.root, layout.REGISTER)
    except KeystoreError:
        return None  # the check itself reports it


def _findings(
    view: KeystoreView, access: CaAccess, now: datetime, required: Requirements
) -> Iterator[Finding]:
    try:
        view.refuse_clock(now)
    except WrongClockError as error:
        yield Finding(Severity.ERROR, "clock", ".", str(error), "timedatectl")
        return
    except KeystoreError:
        pass  # the checks below report what cannot be read
    owner = os.lstat(view.root)
    for finding in check_parents(view.root):
        # What belongs to the keystore's own foreign owner is reported with the keystore.
        if safe_files.is_trusted_owner(owner) or os.stat(finding.place).st_uid != owner.st_uid:
            yield finding
    yield from check_files(view.root)
    register, problems = load_register(view)
    yield from problems
    try:
        yield from check_anchors(view, register, required.authorities)
        yield from check_authorities(view, register, access, now, required.governance)
        yield from check_published(view, register, now)
    except KeystoreError as error:
        yield Finding(Severity.ERROR, "unreadable", layout.PUBLIC, str(error), repair.BACKUP)
        return
    yield from _check_settings(view, register)
    yield from _check_deployment(view)
    revoked = frozenset(serial for crl in crls_in(view) for serial in crl.revoked)
    yield from check_enclaves(view, register, revoked, now)
    yield from check_by_openssl(view)
    if view.has_zenoh_router:
        yield from _check_zenoh(view, now)


def _check_zenoh(view: KeystoreView, now: datetime) -> Iterator[Finding]:
    try:
        yield from zenoh_files().check(view, now)
    except NotInstalledError as error:
        yield Finding(Severity.ERROR, "zenoh-router", layout.ZENOH_ROUTER, f"not checked: {error}")


def _check_deployment(view: KeystoreView) -> Iterator[Finding]:
    at = imported_at(view.root)
    fix = repair.run(at, "import", "HOST.bundle", note="the bundle in force, or a newer one: restores it")
    for place, problem in find_differences(view):
        yield Finding(Severity.ERROR, "bundle-differs", place, problem, fix)


def _check_settings(view: KeystoreView, register: Register | None) -> Iterator[Finding]:
    place, present = layout.SETTINGS, safe_files.read_if_there(view.root, layout.SETTINGS)
    if register is not None and register.settings != (present or b""):
        yield Finding(
            Severity.ERROR, "settings-changed", place,
            "not what this keystore was made with: new certificates would get other subjects, or another lifetime",
            repair.renew(view.root, note="makes it what it was"),
        )  # fmt: skip
        return
    try:
        _ = view.settings
    except KeystoreError as error:
        fix = repair.run_on(view.root, "rm", layout.SETTINGS, "new enclaves then get the defaults")
        yield Finding(Severity.ERROR, "settings", layout.SETTINGS, str(error), fix)
