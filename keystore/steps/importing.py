"""A bundle put in force on its host: everything is checked in memory and aside, then one rename changes all.

Needs neither a network nor a CA key. Refused: what the pinned permissions CA did not sign, another host's bundle, an
earlier one, one that is cut off or has a file more, less or changed, an earlier CRL, an enclave that was revoked, and
what ``verify`` calls an error. Nothing is half-imported: a run that is killed leaves the keystore of before.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout, lock, safe_files, store
from keystore.disk.archive import read_bundle
from keystore.disk.store import Content, Link
from keystore.disk.versions import Versions
from keystore.errors import (
    DamagedKeystoreError,
    InvalidInputError,
    UnsafeKeystoreError,
    printable,
)
from keystore.formats.bundle import BundledEnclave, Manifest, parse_manifest
from keystore.formats.certificate import read_certificates
from keystore.formats.role import Role
from keystore.formats.validity import utc_now
from keystore.signing import smime
from keystore.signing.public_key import fingerprint, fingerprints
from keystore.steps.host_keys import HostKey, find_key, forget_pending
from keystore.verification import Severity, verify


class Restart(str, Enum):
    """Who must be started anew: participants read their files once, when they are created."""

    NOBODY = "nobody"
    CHANGED = "the changed enclaves, one after the other"
    ALL = "every enclave, one after the other (the CRL changed)"
    TOGETHER = "every enclave of all hosts, together (a CA or the governance changed)"


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """``host``: which one this is; needed unless the bundle's name for it is taken from an earlier import.
    ``authorities``: SHA-256 of the CAs to trust, for the first import and to pin others by hand."""

    host: str | None = None
    authorities: tuple[str, ...] = ()
    lock_timeout: float = lock.DEFAULT_TIMEOUT
    now: datetime | None = None


class ImportReport(NamedTuple):
    """``changed``: enclaves that are new or have other files. ``notes`` are for a person."""

    keystore: Path
    manifest: Manifest
    changed: tuple[str, ...]
    removed: tuple[str, ...]
    restart: Restart
    notes: tuple[str, ...] = ()


class _Bundle(NamedTuple):
    manifest: Manifest
    files: Mapping[str, bytes]
    place: str


def import_bundle(
    keystore: Path | str, bundle: Path | str, *, options: ImportOptions | None = None
) -> ImportReport:
    """Put ``bundle`` in force at ``keystore``, a link that this makes and owns; the same one again changes nothing.

    Raises DamagedKeystoreError (cut off, changed, not fit), UnsafeKeystoreError (not signed by the pinned CA, for
    another host, earlier, with what is revoked), InvalidInputError, StorageError.
    """
    chosen = options or ImportOptions()
    versions = Versions(keystore)
    content = read_bundle(Path(bundle))
    with versions.opened(chosen.lock_timeout):
        present = deployed_manifest(versions.current) if versions.current else None
        found = _checked(content, printable(bundle), present, chosen)
        if present is not None and found.manifest == present:
            return ImportReport(
                versions.root, present, (), (), Restart.NOBODY, ("this bundle is in force already",)
            )
        if present is not None:
            _refuse_earlier(found, present)
        return _put_in_force(versions, found, present, chosen.now or utc_now())


def deployed_manifest(version: Path) -> Manifest:
    """Of an imported keystore. Raises DamagedKeystoreError."""
    place = printable(version / layout.BUNDLE)
    return parse_manifest(smime.read(safe_files.read(version, layout.BUNDLE), place).document, place)


def _checked(
    content: Mapping[str, bytes], place: str, present: Manifest | None, options: ImportOptions
) -> _Bundle:
    """Who signed it comes first: nothing else of it is believed before."""
    signed = content.get(layout.BUNDLE)
    if signed is None:
        raise DamagedKeystoreError(
            f"{place} has no {layout.BUNDLE}: not a host's bundle (secure-keystore export --hosts), or cut off"
        )
    document = smime.read(signed, place)
    _check_signer(document, content, _pins(present, options), place)
    manifest = parse_manifest(document.document, place)
    _refuse_other_host(manifest, present, options, place)
    found = _Bundle(manifest, {name: data for name, data in content.items() if name != layout.BUNDLE}, place)
    _check_files(found)
    _check_authorities(found, options)
    return found._replace(files={**found.files, layout.BUNDLE: signed})


def _pins(present: Manifest | None, options: ImportOptions) -> frozenset[str]:
    """The CAs named by hand, else those of what is in force. Raises UnsafeKeystoreError without either."""
    named = fingerprints(options.authorities)
    if not named and present is None:
        raise UnsafeKeystoreError(
            "nothing is pinned on this host yet: give the fingerprints of both CAs with --require-ca; "
            "secure-keystore export prints them, and they must come another way than the bundle"
        )
    return named or frozenset(one for role in Role for one in (present.authorities[role] if present else ()))


def _check_signer(
    document: smime.SignedDocument, content: Mapping[str, bytes], pins: frozenset[str], place: str
) -> None:
    name = layout.ca_cert(Role.PERMISSIONS)
    if name not in content:
        raise DamagedKeystoreError(f"{place} lacks {name}: it is cut off, or was changed; copy it again")
    authorities = read_certificates(content[name], f"{place}: {name}")
    trusted = [ca for ca in authorities if fingerprint(ca.der) in pins]
    if not trusted:
        raise UnsafeKeystoreError(
            f"{place} is by another permissions CA than the one pinned here. If the CA was replaced and this host "
            "missed a step, pin the new ones with --require-ca"
        )
    try:
        smime.check(document, trusted, place)
    except DamagedKeystoreError as error:
        raise UnsafeKeystoreError(
            f"{error}; it may be forged, get it again from where it was exported"
        ) from None


def _refuse_other_host(
    manifest: Manifest, present: Manifest | None, options: ImportOptions, place: str
) -> None:
    host = present.host if present is not None else options.host
    if host is None:
        raise InvalidInputError(
            f"which host is this? Name it with --host (the bundle is for {manifest.host})"
        )
    if options.host not in (None, host):
        raise InvalidInputError(f"this keystore is that of host {host}, not of {options.host}")
    if manifest.host != host:
        raise UnsafeKeystoreError(f"{place} is for host {manifest.host}; this is {host}")


def _check_files(found: _Bundle) -> None:
    """Exactly the files of the manifest, each with its hash; and only such that a bundle can have."""
    manifest, place = found.manifest, found.place
    enclaves = [(one.enclave, one.has_key) for one in manifest.enclaves]
    expected = layout.bundle_files(enclaves, crl=layout.CRL in manifest.files)
    for name in sorted(set(manifest.files) ^ expected):
        raise DamagedKeystoreError(f"{place}: its list of files does not fit its enclaves: {printable(name)}")
    for name in sorted(set(found.files) - expected):
        raise UnsafeKeystoreError(f"{place} holds a file that nobody signed: {printable(name)}")
    for name, digest in sorted(manifest.files.items()):
        if name not in found.files:
            raise DamagedKeystoreError(f"{place} lacks {name}; copy it again")
        if fingerprint(found.files[name]) != digest:
            raise UnsafeKeystoreError(f"{place}: {name} is not the file that was signed; copy it again")


def _check_authorities(found: _Bundle, options: ImportOptions) -> None:
    """The trust files hold the CAs that the manifest names; with pins by hand, only those."""
    named = fingerprints(options.authorities)
    for role in Role:
        name = layout.ca_cert(role)
        present = tuple(fingerprint(ca.der) for ca in read_certificates(found.files[name], name))
        foreign = sorted(set(present) - named) if named else []
        if present != found.manifest.authorities[role] or foreign:
            what = foreign[0] if foreign else ", ".join(present)
            raise UnsafeKeystoreError(f"{found.place}: {name} trusts a CA that is not pinned: {what}")


def _refuse_earlier(found: _Bundle, present: Manifest) -> None:
    if found.manifest.number <= present.number:
        raise UnsafeKeystoreError(
            f"{found.place} is number {found.manifest.number}, but {present.number} is in force here: an earlier "
            "bundle may give back what was taken away or revoked since. Export again where the CA is"
        )
    if found.manifest.crl_number < present.crl_number:
        raise UnsafeKeystoreError(
            f"{found.place} has an earlier CRL ({found.manifest.crl_number}) than this host ({present.crl_number})"
        )


def _put_in_force(
    versions: Versions, found: _Bundle, present: Manifest | None, now: datetime
) -> ImportReport:
    keys = {one.enclave: find_key(versions, one) for one in found.manifest.enclaves if not one.has_key}
    staged = versions.stage(_entries(found, keys))
    try:
        notes = _refuse_unfit(staged, found.place, now)
        versions.switch(found.manifest.number)
    finally:
        versions.discard()
    forget_pending(versions, keys)
    changed, removed = _differences(found.manifest, present)
    restart = _restart(found.manifest, present, changed)
    return ImportReport(versions.root, found.manifest, changed, removed, restart, tuple(notes))


def _entries(found: _Bundle, keys: Mapping[str, HostKey]) -> dict[str, Content | Link]:
    """The files of the version: those of the bundle, the keys that were made here, and the usual links."""
    entries: dict[str, Content | Link] = {
        name: Content(data, store.PRIVATE_MODE if name.endswith(f"/{layout.KEY}") else store.PUBLIC_MODE)
        for name, data in found.files.items()
    }
    for enclave in found.manifest.names:
        directory = layout.enclave_directory(enclave)
        links = store.enclave_links(enclave, crl=layout.CRL in found.files)
        entries |= {f"{directory}/{name}": link for name, link in links.items()}
        if enclave in keys:
            entries[f"{directory}/{keys[enclave].name}"] = Content(keys[enclave].data, store.PRIVATE_MODE)
    return entries


def _refuse_unfit(staged: Path, place: str, now: datetime) -> list[str]:
    """What ``verify`` finds in the version itself; what stands around it is the host's business and only told."""
    notes = []
    for finding in verify(staged, now=now).findings:
        text = f"{finding.place}: {finding.message} [{finding.code}]"
        if finding.severity is Severity.ERROR and finding.code != "too-large":
            raise DamagedKeystoreError(f"{place} is not fit for use: {text}")
        if finding.severity is not Severity.NOTE:
            notes.append(text)
    return notes


def _differences(manifest: Manifest, present: Manifest | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    before: dict[str, BundledEnclave] = {one.enclave: one for one in present.enclaves} if present else {}
    changed = tuple(one.enclave for one in manifest.enclaves if before.get(one.enclave) != one)
    return changed, tuple(sorted(set(before) - set(manifest.names)))


def _restart(manifest: Manifest, present: Manifest | None, changed: Iterable[str]) -> Restart:
    if present is None:
        return Restart.CHANGED
    common = {name: digest for name, digest in manifest.files.items() if name == layout.GOVERNANCE}
    if manifest.authorities != present.authorities or not common.items() <= present.files.items():
        return Restart.TOGETHER
    if manifest.files.get(layout.CRL) != present.files.get(layout.CRL):
        return Restart.ALL
    return Restart.CHANGED if any(changed) else Restart.NOBODY
