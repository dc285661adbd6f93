"""A keystore as it stands on disk, read only. A view caches what the lock protects: make a new one after writing."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.errors import (
    DamagedKeystoreError,
    InvalidEnclaveNameError,
    InvalidInputError,
    NotAKeystoreError,
    SigningUnavailableError,
    StorageError,
    storage_errors,
)
from keystore.formats.certificate import CertificateFacts, read_certificate, read_certificates
from keystore.formats.clock import refuse_clock_before
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.role import Role
from keystore.formats.subject import SubjectScheme
from keystore.formats.validity import DEFAULT_LIFETIME
from keystore.signing.authority import Authority, authority_of
from keystore.signing.ca_access import CaAccess
from keystore.signing.token_key import open_key

_OWN_ENTRIES = frozenset({
    layout.PUBLIC, layout.PRIVATE, layout.ENCLAVES, layout.STAGING, layout.LOCK, layout.SETTINGS, layout.ZENOH,
    layout.BUNDLE,
})  # fmt: skip


def keystore_at(keystore: Path | str) -> KeystoreView:
    """Open the keystore at that path, links resolved; raises NotAKeystoreError unless it is a complete one."""
    view = KeystoreView(safe_files.resolve_root(keystore))
    view.require_complete()
    return view


class KeystoreView:
    """Reads a keystore. ``root`` should be resolved by the caller: links above the keystore are the user's business.

    ``successors``: CAs that are about to follow those on disk; it is seen as if they had.
    """

    def __init__(self, root: Path, successors: Mapping[Role, Authority] = MappingProxyType({})):
        self.root = root
        self._successors = successors

    @property
    def is_complete(self) -> bool:
        """Return True if trust anchors and governance exist; a deployed copy without ``private/`` is complete too."""
        needed = (*(layout.ca_cert(role) for role in Role), layout.GOVERNANCE)
        return all(os.path.isfile(self.root / name) for name in needed)

    @property
    def can_be_completed(self) -> bool:
        """Return True if the directory is empty, or holds nothing but the beginnings of a keystore."""
        try:
            return set(os.listdir(self.root)) <= _OWN_ENTRIES
        except (FileNotFoundError, NotADirectoryError):
            return not os.path.lexists(self.root)
        except OSError as error:
            raise StorageError.of(error, "looking for a keystore at") from None

    def refuse_foreign(self) -> None:
        """Raise NotAKeystoreError for a directory with other things in it, in which no keystore can be made."""
        if not self.is_complete and not self.can_be_completed:
            raise NotAKeystoreError(
                f"{quoted(self.root)} is not a keystore, and other files are in it\n"
                f"try: secure-keystore create {shlex.quote(str(self.root / 'keystore'))}"
            )

    def require_complete(self) -> None:
        if not self.root.is_dir():
            raise NotAKeystoreError(
                f"there is no keystore at {quoted(self.root)}\n"
                f"try: secure-keystore create {shlex.quote(str(self.root))}"
            )
        if self.is_complete:
            return
        around = next((each for each in self.root.parents if KeystoreView(each).is_complete), None)
        if around is not None:
            raise NotAKeystoreError(
                f"{quoted(self.root)} is a folder inside the keystore {quoted(around)}\n"
                f"try: secure-keystore verify {shlex.quote(str(around))}"
            )
        if self.can_be_completed:
            raise NotAKeystoreError(
                f"{quoted(self.root)} is not a complete keystore: it is empty, or its creation was interrupted\n"
                f"try: secure-keystore create {shlex.quote(str(self.root))}"
            )
        self.refuse_foreign()

    @cached_property
    def settings(self) -> KeystoreSettings:
        text = safe_files.read_if_there(self.root, layout.SETTINGS)
        if text is None:
            return KeystoreSettings()
        return KeystoreSettings.from_json(text, str(self.root / layout.SETTINGS))

    def ca_bundle(self, role: Role) -> list[CertificateFacts]:
        """Return all certificates of a trust anchor file, the one in use first."""
        return self._bundles[role]

    def ca(self, role: Role) -> CertificateFacts:
        return self._bundles[role][0]

    @cached_property
    def _bundles(self) -> dict[Role, list[CertificateFacts]]:
        bundles = {}
        for role in Role:
            name = layout.ca_cert(role)
            present = read_certificates(safe_files.read(self.root, name), quoted(self.root / name))
            coming = [self._successors[role].facts] if role in self._successors else []
            bundles[role] = [*coming, *present]
        return bundles

    def refuse_clock(self, now: datetime) -> None:
        """Raise WrongClockError if ``now`` is before a CA of this keystore begins."""
        refuse_clock_before(now, (self.ca(role) for role in Role))

    def refuse_ended(self, now: datetime, *roles: Role) -> None:
        """Raise DamagedKeystoreError if one of these CAs is not valid now, so that what it signs would not be."""
        self.refuse_clock(now)
        if not all(self.ca(role).validity.covers(now) for role in roles):
            raise DamagedKeystoreError(
                "a CA of this keystore is expired; to replace it: "
                f"secure-keystore renew {shlex.quote(str(self.root))} --ca start"
            )

    @property
    def shares_one_ca(self) -> bool:
        return self.ca(Role.IDENTITY).public_key == self.ca(Role.PERMISSIONS).public_key

    def key_file(self, role: Role) -> str | None:
        """Return the file with the CA's key or token URI; None on a machine that does not hold it."""
        candidates = (layout.ca_key_uri(role), layout.ca_key(role))
        return next((name for name in candidates if os.path.lexists(self.root / name)), None)

    def authority(self, role: Role, access: CaAccess) -> Authority:
        """Return the CA ready to sign; raises SigningUnavailableError if its key is not here, or does not open."""
        if role in self._successors:
            return self._successors[role]
        name = self.key_file(role)
        if name is None:
            raise SigningUnavailableError(
                f"{quoted(self.root / layout.ca_key(role))} is not here, so nothing can be signed; "
                "run this where the CA keys are, then deploy"
            )
        reference = safe_files.read_private(self.root, name)
        key = open_key(reference, quoted(self.root / name), access)
        return authority_of(self.ca(role), key, quoted(self.root / layout.ca_cert(role)))

    @cached_property
    def has_crl(self) -> bool:
        return os.path.lexists(self.root / layout.CRL)

    @property
    def has_zenoh_router(self) -> bool:
        """Return True if the keystore holds a configuration for a Zenoh router."""
        return os.path.lexists(self.root / layout.ZENOH_ROUTER)

    def zenoh_enclaves(self) -> list[str]:
        """Return the enclaves whose processes have a session configuration for Zenoh, sorted."""
        return [name for name in self.enclaves() if os.path.lexists(self.root / layout.zenoh_session(name))]

    def has_request(self, enclave: str) -> bool:
        """Return whether the enclave's key was made on its host: here is only the request that was signed."""
        return os.path.lexists(self.root / layout.request(enclave))

    def certificate(self, enclave: str) -> CertificateFacts | None:
        """Return the certificate that an enclave has; None without one. Raises DamagedKeystoreError."""
        pem = self.enclave_file(enclave, layout.CERT)
        if pem is None:
            return None
        return read_certificate(pem, quoted(layout.enclave_file(enclave, layout.CERT)))

    def readable_certificate(self, enclave: str) -> CertificateFacts | None:
        """Return the certificate that an enclave has; None also for one that cannot be read."""
        with suppress(DamagedKeystoreError):
            return self.certificate(enclave)
        return None

    def common_name(self, enclave: str) -> str | None:
        """Return the common name of the certificate that an enclave has; None without one, or for an empty file."""
        pem = self.enclave_file(enclave, layout.CERT)
        place = quoted(layout.enclave_file(enclave, layout.CERT))
        return read_certificate(pem, place).common_name if pem else None

    def require_enclaves(self, names: Iterable[str]) -> None:
        """Raise InvalidInputError if one of these enclaves does not exist."""
        unknown = sorted(set(names) - set(self.enclaves()))
        if unknown:
            raise InvalidInputError(
                f"no enclave {', '.join(unknown)} in {quoted(self.root)}\n"
                f"try: secure-keystore list {shlex.quote(str(self.root))}"
            )

    def matching(self, patterns: Iterable[str]) -> list[str]:
        """Return the enclaves that match patterns (``/robot1/*``); raises InvalidInputError for one without match."""
        names, fitting = self.enclaves(), set[str]()
        for pattern in patterns:
            found = [name for name in names if fnmatchcase(name, pattern)]
            if not found:
                raise InvalidInputError(
                    f"no enclave matches {quoted(pattern)}\n"
                    f"try: secure-keystore list {shlex.quote(str(self.root))}"
                )
            fitting.update(found)
        return [name for name in names if name in fitting]

    def enclave_file(self, enclave: str, name: str) -> bytes | None:
        """Return a public file of an enclave; None if it has none."""
        return safe_files.read_if_there(self.root, layout.enclave_file(enclave, name))

    def enclaves(self) -> list[str]:
        """Return the names of all enclaves (directories with a key or a certificate), sorted; follows no links."""
        found: list[str] = []
        with storage_errors("reading the keystore"):
            _collect(self.root / layout.ENCLAVES, "", found)
        return sorted(found)


def _collect(directory: Path | str, prefix: str, found: list[str]) -> None:
    with os.scandir(directory) as entries:
        children = list(entries)
    names = {entry.name for entry in children}
    if names & {layout.KEY, layout.CERT}:
        found.append(prefix or "/")
    for entry in children:
        if not entry.is_dir(follow_symlinks=False):
            continue
        try:
            validate_enclave_name(f"{prefix}/{entry.name}")
        except InvalidEnclaveNameError:
            continue  # a stray, which verify reports
        _collect(entry.path, f"{prefix}/{entry.name}", found)


_VERSION = 1


@dataclass(frozen=True, slots=True)
class KeystoreSettings:
    """The settings that a keystore keeps in ``secure-keystore.json``; keystores made by SROS2 have the defaults.

    The file also marks a directory as a keystore in the making, so that an interrupted ``create`` can be completed
    while a foreign directory is left alone. ``lifetime`` is for new certificates of enclaves. ``compact``: permissions
    name the parameter services of a node by one expression (``keystore.formats.compact``).
    """

    subjects: SubjectScheme = SubjectScheme.EXACT
    lifetime: timedelta = DEFAULT_LIFETIME
    compact: bool = False

    def to_json(self) -> bytes:
        content = {
            "version": _VERSION,
            "subjects": self.subjects.value,
            "lifetime_seconds": int(self.lifetime.total_seconds()),
            **({"compact": True} if self.compact else {}),
        }
        return json.dumps(content, indent=2, sort_keys=True).encode() + b"\n"

    @classmethod
    def from_json(cls, text: bytes, place: str) -> KeystoreSettings:
        """Parse what ``to_json`` writes; raises DamagedKeystoreError for anything else."""
        try:
            content: Any = json.loads(text)
            if content["version"] != _VERSION:
                raise DamagedKeystoreError(f"{place} was written by a newer version; update secure-keystore")
            return cls(
                SubjectScheme(content["subjects"]),
                timedelta(seconds=int(content["lifetime_seconds"])),
                content.get("compact", False) is True,
            )
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
            raise DamagedKeystoreError(
                f"{place} is not the settings file of a keystore; restore or remove it"
            ) from None
