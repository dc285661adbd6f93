"""Write one signed bundle for each host: its enclaves, no CA key, and a manifest with the hash of every file.

The manifest signed last is used again if nothing changed; a new one gets a higher number, which hosts compare.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from enclave_addons.deployment.bundle_file import bundle_bytes, read_bundle
from enclave_addons.deployment.hosts import Hosts, refuse_host_name
from enclave_addons.deployment.public_files import files_of, refuse_unfit
from enclave_common.terminal import quoted
from enclave_common.words import some_of
from keystore.disk import layout, safe_files, store
from keystore.disk.crl_file import crl_number, crl_validity, forgotten, listed_in
from keystore.disk.register_file import read_register
from keystore.disk.store import Content, Store, write_new
from keystore.disk.versions import written_aside
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import InvalidInputError, KeystoreError, UnsafeKeystoreError, storage_errors
from keystore.formats.bundle import BundledEnclave, Manifest, manifest_json, parse_manifest, pin
from keystore.formats.certificate import read_certificate
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.validity import utc_now
from keystore.signing import smime
from keystore.signing.public_key import fingerprint
from keystore.signing.records import permissions_record
from keystore.signing.smime import sign_document
from keystore.steps.opening import ChangeOptions, opened_for_change

SUFFIX = ".bundle"


@dataclass(frozen=True, slots=True)
class BundleOptions(ChangeOptions):
    """How to export. ``accept_shared``: accept enclaves on several hosts, whose keys are then on all of them."""

    accept_exposures: bool = False
    accept_shared: bool = False


@dataclass(frozen=True, slots=True)
class HostBundle:
    """What was written for one host; if ``is_new`` is False, the same bytes as last time."""

    path: Path
    manifest: Manifest
    is_new: bool


def enclaves_of_hosts(enclaves: Iterable[str], hosts: Hosts) -> dict[str, list[str]]:
    """Return host -> its enclaves; those that no pattern names are on none. Raises InvalidInputError."""
    found: dict[str, list[str]] = {host: [] for host in hosts.names}
    for enclave in enclaves:
        host = hosts.of_enclave(enclave)
        if host is not None:
            found[host].append(enclave)
    return found


def export_hosts(
    keystore: Path | str,
    output: Path | str,
    assigned: Mapping[str, Iterable[str]],
    *,
    options: BundleOptions | None = None,
) -> tuple[HostBundle, ...]:
    """Write ``output``/HOST.bundle for each host of ``assigned`` (host -> enclave names or patterns).

    Raises:
        InvalidInputError: A host has no enclave, or an enclave is on several hosts.
        DamagedKeystoreError: ``verify`` finds an error in these enclaves.
        SigningUnavailableError: The permissions CA's key is not here.
    """
    chosen = options or BundleOptions()
    view = keystore_at(keystore)
    root, now = view.root, chosen.now or utc_now()
    names = {host: _enclaves_of(host, view, list(patterns)) for host, patterns in assigned.items()}
    if not chosen.accept_shared:
        _refuse_shared(names)
    refuse_unfit(
        view, sorted({one for listed in names.values() for one in listed}), now, chosen.accept_exposures
    )
    with opened_for_change(root, now, chosen) as opened:
        return tuple(
            _export(opened, Path(output), host, listed, chosen, now) for host, listed in names.items()
        )


def _enclaves_of(host: str, view: KeystoreView, patterns: list[str]) -> list[str]:
    refuse_host_name(host, "host")
    if not patterns:
        raise InvalidInputError(f"host {host} has no enclave")
    return view.matching(patterns)


def _refuse_shared(names: Mapping[str, Iterable[str]]) -> None:
    holders: dict[str, list[str]] = {}
    for host, enclaves in names.items():
        for enclave in enclaves:
            holders.setdefault(enclave, []).append(host)
    for enclave, several in holders.items():
        if len(several) > 1:
            raise InvalidInputError(
                f"enclave {enclave} would live on several hosts ({', '.join(several)}): who takes one of them is it "
                "on all. Give the nodes enclaves of their own, or export with --accept-shared-enclaves"
            )


def _export(
    opened: Store, output: Path, host: str, names: list[str], options: BundleOptions, now: datetime
) -> HostBundle:
    view = KeystoreView(opened.root)
    files = dict(files_of(view, names))
    handover = safe_files.read_if_there(view.root, layout.SIGNED_HANDOVER)
    if handover is not None:
        files[layout.HANDOVER] = Content(handover)
    manifest = _manifest(view, host, names, files)
    present = last_signed(view, host)
    is_new = present is None or not manifest.same_content(present[0])
    if present is None or is_new:
        number = max(int(now.timestamp()), present[0].number + 1 if present is not None else 0)
        manifest = manifest._replace(number=number)
        signed = sign_document(manifest_json(manifest), view.authority(Role.PERMISSIONS, options.access))
        with opened.batch() as batch:
            batch.file(layout.signed_bundle(host), signed, store.PRIVATE_MODE)
    else:
        manifest, signed = present
    _refuse_forgotten(output / f"{host}{SUFFIX}", view)
    content = bundle_bytes(signed, {name: file.data for name, file in files.items()})
    return HostBundle(_write(output, host, content, opened.root), manifest, is_new)


def _refuse_forgotten(earlier: Path, view: KeystoreView) -> None:
    """Raise for a CRL that lacks what the bundle to be replaced lists: this keystore was restored from a backup."""
    issuers = view.ca_bundle(Role.IDENTITY)
    try:
        sealed = read_bundle(earlier)
        manifest = parse_manifest(smime.read(sealed.signed, sealed.place).document, sealed.place)
        listed = sealed.opened(manifest).get(layout.CRL, b"")
    except KeystoreError:
        return  # there is none, or a file that no host would import
    known = listed_in(listed, issuers, quoted(earlier))
    present = listed_in(safe_files.read_if_there(view.root, layout.CRL) or b"", issuers, layout.CRL)
    if missing := forgotten(known, present):
        serials = some_of([f"{serial:X}" for serial in missing], 8)
        raise UnsafeKeystoreError(
            f"the CRL of this keystore does not list {serials}, which {quoted(earlier)} lists as revoked: the "
            f"keystore was restored from a backup. Take the list of host {manifest.host} over, its public/crl.pem: "
            f"secure-keystore renew {shlex.quote(str(view.root))} --adopt-crl FILE"
        )


def last_signed(view: KeystoreView, host: str) -> tuple[Manifest, bytes] | None:
    """Return the manifest signed last for ``host`` and its file, None if there is none."""
    relative = layout.signed_bundle(host)
    signed = safe_files.read_if_there(view.root, relative)
    if signed is None:
        return None
    place = quoted(view.root / relative)
    document = smime.read(signed, place)
    manifest = parse_manifest(document.document, place)
    if not document.embeds(view.ca(Role.PERMISSIONS).der):
        # By an earlier CA: signed again, with a higher number.
        return manifest._replace(files={}), signed
    smime.check(document, [view.ca(Role.PERMISSIONS)], place)
    return manifest, signed


def hosts_that_left(keystore: Path | str, hosts: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Return hosts with a bundle of this keystore that are not among ``hosts`` -> their enclaves.

    Only enclaves whose certificates on that host are neither revoked nor expired: who has the host can use them.
    """
    view, at = keystore_at(keystore), utc_now()
    register = read_register(view.root) or Register()
    present = set(hosts)
    found = {}
    for path in sorted((view.root / layout.BUNDLES).glob("*.p7s")):
        last = last_signed(view, path.stem) if path.stem not in present else None
        good = [
            one.enclave
            for one in (last[0].enclaves if last is not None else ())
            if (issued := register.certificates.get(one.serial)) is not None
            and issued.revoked is None
            and one.not_after > at
        ]
        if good:
            found[path.stem] = tuple(good)
    return found


def _manifest(view: KeystoreView, host: str, names: list[str], files: Mapping[str, Content]) -> Manifest:
    enclaves = tuple(_bundled(enclave, files) for enclave in names)
    ends = [ca.validity.not_after for role in Role for ca in view.ca_bundle(role)]
    ends += [one.not_after for one in enclaves]
    ends += [crl_validity(view).not_after] if view.has_crl else []
    return Manifest(
        host=host,
        number=0,
        authorities={role: tuple(fingerprint(ca.der) for ca in view.ca_bundle(role)) for role in Role},
        crl_number=crl_number(view) if view.has_crl else 0,
        enclaves=enclaves,
        files={name: fingerprint(file.data) for name, file in files.items()},
        ends=min(ends),
    )


def _bundled(enclave: str, files: Mapping[str, Content]) -> BundledEnclave:
    # From the very bytes that are exported.
    directory = layout.enclave_directory(enclave)
    cert = read_certificate(files[f"{directory}/{layout.CERT}"].data, f"{directory}/{layout.CERT}")
    signed = smime.read(files[f"{directory}/{layout.PERMISSIONS}"].data, f"{directory}/{layout.PERMISSIONS}")
    record = permissions_record(enclave, cert.common_name or "", signed.document)
    return BundledEnclave(
        enclave,
        cert.serial,
        fingerprint(cert.public_key),
        record.document,
        cert.validity.not_before,
        min(cert.validity.not_after, record.not_after),
        f"{directory}/{layout.KEY}" in files,
    )


def _write(output: Path, host: str, content: bytes, root: Path) -> Path:
    target = output / f"{host}{SUFFIX}"
    if Path(os.path.realpath(output)).is_relative_to(root):
        raise InvalidInputError(f"{quoted(output)} lies in the keystore; choose another place")
    with storage_errors("writing the bundle"):
        output.mkdir(parents=True, exist_ok=True)
        with written_aside(target) as aside:
            write_new(aside, content, store.PRIVATE_MODE)
    return target


def pinned(manifest: Manifest) -> tuple[str, ...]:
    """Return the pins for the first import: which CA may do what."""
    return tuple(pin(role, one) for role in Role for one in manifest.authorities[role])
