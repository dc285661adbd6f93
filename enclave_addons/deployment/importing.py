"""Import a bundle on its host: everything is checked in memory and aside, then one rename changes all.

Needs neither a network nor a CA key. Refused: what the pinned permissions CA did not sign, another host's bundle, an
earlier one, one that is cut off or has a file more, less or changed, an earlier CRL, an enclave that was revoked, a
governance weaker than the default, and what ``verify`` calls an error. The same bundle again restores what was changed
since. Nothing is half-imported: a run that is killed leaves the previous keystore.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from enclave_addons.deployment.bundle_file import SealedBundle, read_bundle
from enclave_addons.deployment.host_keys import HostKey, find_key, forget_pending
from enclave_common.terminal import quoted
from enclave_common.words import some_of
from keystore.disk import layout, lock, safe_files, store
from keystore.disk.container_copies import (
    ContainerUser,
    container_entries,
    container_owner,
    differing_copies,
    give_to,
)
from keystore.disk.crl_file import forgotten, listed_in
from keystore.disk.deployed import differing_files, read_manifest
from keystore.disk.store import Content, Link
from keystore.disk.versions import Versions
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, InvalidInputError, KeystoreError, UnsafeKeystoreError
from keystore.formats.bundle import BundledEnclave, Manifest, parse_handover, parse_manifest, pins_of
from keystore.formats.certificate import read_certificates
from keystore.formats.governance import parse_governance
from keystore.formats.role import Role
from keystore.formats.validity import LATEST, utc_now
from keystore.signing import smime
from keystore.signing.public_key import fingerprint
from keystore.verification import Severity, verify
from keystore.verification.governance import weaknesses


class Restart(str, Enum):
    """Who must be restarted: participants read their files once, when they are created."""

    NOBODY = "nobody"
    CHANGED = "the changed enclaves, one after the other"
    ALL = "every enclave, one after the other (the CRL or the trusted CAs changed)"
    TOGETHER = "every enclave of all hosts, together (a CA in use or the governance changed)"


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """How to import.

    Attributes:
        host: Which host this is; None if an earlier import said so.
        authorities: Which CA may do what, as ``identity=SHA256`` and ``permissions=SHA256``; for the first import, and
            to pin others by hand.
        accept_weaker: Attributes of the governance that may be weaker than the default.
        owner: Of the copies for containers; None for the previous one.
    """

    host: str | None = None
    authorities: tuple[str, ...] = ()
    accept_weaker: tuple[str, ...] = ()
    owner: ContainerUser | None = None
    lock_timeout: float = lock.DEFAULT_TIMEOUT
    now: datetime | None = None


class ImportReport(NamedTuple):
    """What an import changed. ``changed``: enclaves that are new or have other files; ``notes`` are for a person."""

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
    """Put ``bundle`` in force at ``keystore``, a link that this makes and owns; importing it again changes nothing.

    Raises:
        DamagedKeystoreError: It is cut off, changed, or not fit for use.
        UnsafeKeystoreError: It is not signed by the pinned CA, for another host, earlier, or weaker than the default.
        InvalidInputError: Host or pins are not given as they should be.
        StorageError: It cannot be written; what was in force still is.
    """
    chosen = options or ImportOptions()
    versions = Versions(keystore)
    sealed = read_bundle(Path(bundle))
    with versions.opened(chosen.lock_timeout):
        present = _present(versions.current, chosen.host)
        pins = _pins(present, chosen)
        if not chosen.authorities and versions.current is not None:
            pins = _with_successors(pins, sealed.handover, KeystoreView(versions.current))
        found = _checked(sealed, present, pins, chosen)
        differing: list[str] = []
        owned = container_owner(versions.current) if versions.current is not None else None
        owner = chosen.owner or owned
        if present is not None and versions.current is not None and found.manifest == present:
            differing = [name for name, _ in differing_files(KeystoreView(versions.current), present)]
            differing += [name for name, _ in differing_copies(versions.current)]
            if not differing and owner == owned:
                said = ("this bundle is in force already",)
                return ImportReport(versions.root, present, (), (), Restart.NOBODY, said)
        elif present is not None:
            _refuse_earlier(found, present)
            _refuse_forgotten(found, KeystoreView(versions.current or versions.root))
        _refuse_weaker(found, present, chosen.accept_weaker)
        return _put_in_force(versions, found, present, chosen.now or utc_now(), differing, owner)


def parse_owner(text: str) -> ContainerUser:
    """Return the owner that ``UID:GID`` names. Raises InvalidInputError."""
    uid, _, gid = text.partition(":")
    if not (uid.isdecimal() and gid.isdecimal()):
        raise InvalidInputError(f"--owner {quoted(text)} is not UID:GID in numbers, such as 10001:10001")
    return ContainerUser(int(uid), int(gid))


def _present(version: Path | None, host: str | None) -> Manifest | None:
    """Return the manifest in force. Its signature was checked when it was imported; ``verify`` checks it again.

    Of one that was deleted or damaged is left what else says what was imported: the name of the version, and the CAs.
    """
    if version is None:
        return None
    try:
        return read_manifest(safe_files.read(version, layout.BUNDLE), quoted(version / layout.BUNDLE))
    except DamagedKeystoreError:
        with suppress(KeystoreError):
            view = KeystoreView(version)
            trusted = {role: tuple(fingerprint(ca.der) for ca in view.ca_bundle(role)) for role in Role}
            return Manifest(host or "", int(version.name.partition(".")[0]), trusted, 0, (), {}, LATEST)
        return None


def _checked(
    sealed: SealedBundle,
    present: Manifest | None,
    pins: Mapping[Role, frozenset[str]],
    options: ImportOptions,
) -> _Bundle:
    """Return the bundle if it is whole. Who signed it comes first: nothing is believed before."""
    document = smime.read(sealed.signed, sealed.place)
    _check_signer(document, sealed, pins)
    manifest = parse_manifest(document.document, sealed.place)
    _refuse_other_host(manifest, present, options, sealed.place)
    found = _Bundle(manifest, sealed.opened(manifest), sealed.place)
    _check_files(found)
    _check_authorities(found, options)
    return found._replace(files={**found.files, layout.BUNDLE: sealed.signed})


def _pins(present: Manifest | None, options: ImportOptions) -> dict[Role, frozenset[str]]:
    if options.authorities:
        return pins_of(options.authorities)
    if present is None:
        raise UnsafeKeystoreError(
            "nothing is pinned on this host yet: say which CA may do what with --require-ca identity=SHA256 and "
            "--require-ca permissions=SHA256; secure-keystore export prints them, and they must come another way than "
            "the bundle"
        )
    return {role: frozenset(present.authorities[role]) for role in Role}


def _with_successors(
    pins: Mapping[Role, frozenset[str]], handover: bytes, present: KeystoreView
) -> dict[Role, frozenset[str]]:
    """Return ``pins`` and the CAs that a permissions CA trusted here has named as those that follow it.

    A handover by another CA is of a replacement that this host has followed already, or is forged: it changes nothing.
    """
    named: Mapping[Role, frozenset[str]] = {}
    if handover:
        with suppress(DamagedKeystoreError):
            document = smime.read(handover, layout.HANDOVER)
            smime.check(document, present.ca_bundle(Role.PERMISSIONS), layout.HANDOVER)
            named = parse_handover(document.document, layout.HANDOVER)
    return {role: pins[role] | named.get(role, frozenset()) for role in Role}


def _check_signer(
    document: smime.SignedDocument, sealed: SealedBundle, pins: Mapping[Role, frozenset[str]]
) -> None:
    place = sealed.place
    authorities = read_certificates(sealed.authorities, f"{place}: {layout.ca_cert(Role.PERMISSIONS)}")
    trusted = [ca for ca in authorities if fingerprint(ca.der) in pins[Role.PERMISSIONS]]
    if not trusted:
        raise UnsafeKeystoreError(
            f"{place} is by another permissions CA than the one pinned here, which did not name it as the one that "
            "follows. If the CA was replaced more than once since the last import, pin the new ones with --require-ca"
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
    host = (present.host if present is not None else None) or options.host
    if host is None and present is not None:
        return  # its name is lost with the manifest; the CAs and the number still hold
    if host is None:
        raise InvalidInputError(
            f"which host is this? Name it with --host (the bundle is for {manifest.host})"
        )
    if options.host not in (None, host):
        raise InvalidInputError(f"this keystore is that of host {host}, not of {options.host}")
    if manifest.host != host:
        raise UnsafeKeystoreError(
            f"{place} is for host {manifest.host}; this is {host}\n"
            f"try: import it on {manifest.host}; if this machine is that host, add --host {manifest.host}"
        )


def _check_files(found: _Bundle) -> None:
    """Raise unless the files are exactly those of the manifest, with their hashes, and such that a bundle can have."""
    manifest, place = found.manifest, found.place
    enclaves = [(one.enclave, one.has_key) for one in manifest.enclaves]
    expected = layout.bundle_files(
        enclaves, crl=layout.CRL in manifest.files, handover=layout.HANDOVER in manifest.files
    )
    for name in sorted(set(manifest.files) ^ expected):
        raise DamagedKeystoreError(f"{place}: its list of files does not fit its enclaves: {quoted(name)}")
    for name in sorted(set(found.files) ^ expected):
        raise UnsafeKeystoreError(f"{place}: {name} is not as its manifest says")
    for name, digest in sorted(manifest.files.items()):
        if fingerprint(found.files[name]) != digest:
            raise UnsafeKeystoreError(f"{place}: {name} is not the file that was signed; copy it again")


def _check_authorities(found: _Bundle, options: ImportOptions) -> None:
    pins = pins_of(options.authorities) if options.authorities else None
    for role in Role:
        name = layout.ca_cert(role)
        present = tuple(fingerprint(ca.der) for ca in read_certificates(found.files[name], name))
        foreign = sorted(set(present) - pins[role]) if pins is not None else []
        if present != found.manifest.authorities[role] or foreign:
            what = foreign[0] if foreign else ", ".join(present)
            raise UnsafeKeystoreError(
                f"{found.place}: {name} trusts a CA that is not pinned as {role.label}: {what}"
            )


def _refuse_earlier(found: _Bundle, present: Manifest) -> None:
    """Raise for an earlier bundle or CRL. CRL numbers belong to their issuer: another CA in use begins a new series."""
    damaged = not present.files
    if found.manifest.number < present.number or (found.manifest.number == present.number and not damaged):
        raise UnsafeKeystoreError(
            f"{found.place} is number {found.manifest.number}, but {present.number} is in force here: an earlier "
            "bundle may restore rights that were removed or revoked since. Export again where the CA is"
        )
    issuers = [one.authorities[Role.IDENTITY][:1] for one in (found.manifest, present)]
    if issuers[0] == issuers[1] and found.manifest.crl_number < present.crl_number:
        raise UnsafeKeystoreError(
            f"{found.place} has an earlier CRL ({found.manifest.crl_number}) than this host ({present.crl_number})"
        )


def _refuse_forgotten(found: _Bundle, present: KeystoreView) -> None:
    """Raise for a CRL that lacks what this host knows as revoked: the CA machine was restored from a backup.

    A CRL number does not tell, for it comes from the clock. What a CA revoked is on all its later lists.
    """
    pem = safe_files.read_if_there(present.root, layout.CRL)
    known = listed_in(pem, present.ca_bundle(Role.IDENTITY), layout.CRL) if pem is not None else None
    if known is None or fingerprint(known.issuer.der) not in found.manifest.authorities[Role.IDENTITY][:1]:
        return
    given = found.files.get(layout.CRL)
    coming = listed_in(given, present.ca_bundle(Role.IDENTITY), layout.CRL) if given is not None else None
    if missing := forgotten(known, coming):
        listed = some_of([f"{serial:X}" for serial in missing], 8)
        raise UnsafeKeystoreError(
            f"{found.place}: its CRL does not list {listed}, which this host "
            "knows as revoked: the CA machine was restored from a backup. Take this host's list over there, "
            f"secure-keystore renew KEYSTORE --adopt-crl FILE with {quoted(present.root / layout.CRL)}, and export "
            "again"
        )


def _refuse_weaker(found: _Bundle, present: Manifest | None, accepted: Iterable[str]) -> None:
    """Raise UnsafeKeystoreError if the governance is weaker than the default and this host has not accepted it yet."""
    if (
        present is not None
        and present.files.get(layout.GOVERNANCE) == found.manifest.files[layout.GOVERNANCE]
    ):
        return
    document = smime.read(found.files[layout.GOVERNANCE], layout.GOVERNANCE).document
    for weakness in weaknesses(parse_governance(document, layout.GOVERNANCE)):
        attribute = weakness.split()[0]
        if attribute not in set(accepted):
            raise UnsafeKeystoreError(
                f"{found.place}: its governance is weaker than the default: {weakness}. Where that is meant: import "
                f"with --accept-weaker {attribute}"
            )


def _put_in_force(
    versions: Versions,
    found: _Bundle,
    present: Manifest | None,
    now: datetime,
    differing: Collection[str],
    owner: ContainerUser | None,
) -> ImportReport:
    """Write and switch to a version. ``differing``: files that are not as this bundle left them, and are restored."""
    keys = {one.enclave: find_key(versions, one) for one in found.manifest.enclaves if not one.has_key}
    entries = _entries(found, keys)
    copies = container_entries(found.manifest.names, entries) if owner is not None else {}
    staged = versions.stage({**entries, **copies})
    try:
        if owner is not None:
            give_to(staged, owner)
        notes = _refuse_unfit(staged, found.place, now)
        versions.switch(found.manifest.number)
    finally:
        versions.discard()
    forget_pending(versions, keys)
    before = _without(present, differing)
    changed, removed = _differences(found.manifest, before)
    restart = _restart(found.manifest, before, changed)
    notes += [f"restored: {name}" for name in differing]
    return ImportReport(versions.root, found.manifest, changed, removed, restart, tuple(notes))


def _without(present: Manifest | None, differing: Collection[str]) -> Manifest | None:
    if present is None:
        return None
    files = {name: digest for name, digest in present.files.items() if name not in differing}
    directories = {name.rpartition("/")[0] for name in differing}
    whole = tuple(one for one in present.enclaves if layout.enclave_directory(one.enclave) not in directories)
    return present._replace(files=files, enclaves=whole)


def _entries(found: _Bundle, keys: Mapping[str, HostKey]) -> dict[str, Content | Link]:
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
    in_use = [[one.authorities[role][:1] for role in Role] for one in (manifest, present)]
    if in_use[0] != in_use[1] or _file_differs(layout.GOVERNANCE, manifest, present):
        return Restart.TOGETHER
    if manifest.authorities != present.authorities or _file_differs(layout.CRL, manifest, present):
        return Restart.ALL
    return Restart.CHANGED if any(changed) else Restart.NOBODY


def _file_differs(name: str, manifest: Manifest, present: Manifest) -> bool:
    return manifest.files.get(name) != present.files.get(name)
