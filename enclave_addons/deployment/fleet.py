"""Report the state of a fleet: who has what until when, who still trusts an old CA, who carries a revoked enclave.

Reads manifests only, of bundle files and of imported keystores, from wherever they were collected. Their signatures are
checked where the CA's own keystore is at hand; the register there also says what was revoked and signed last.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from enclave_addons.deployment.bundle_file import read_bundle
from enclave_addons.deployment.host_bundles import SUFFIX, last_signed
from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.disk.deployed import find_differences, read_manifest
from keystore.disk.register_file import read_register
from keystore.disk.safe_files import resolve_root
from keystore.disk.signed_documents import own_permissions_cas
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import InvalidInputError, KeystoreError, storage_errors
from keystore.formats.bundle import Manifest
from keystore.formats.certificate import CertificateFacts
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.validity import later, utc_now
from keystore.signing.public_key import fingerprint


class HostStatus(NamedTuple):
    """The state of one host. ``found`` is what needs attention; ``place`` is where the manifest was read."""

    place: Path
    manifest: Manifest
    ended: bool
    due: bool
    found: tuple[str, ...]


class FleetReport(NamedTuple):
    """The state of a fleet. ``hosts``: the latest of each host, by name; ``unreadable``: place and reason."""

    now: datetime
    hosts: tuple[HostStatus, ...]
    unreadable: tuple[tuple[Path, str], ...]

    @property
    def is_good(self) -> bool:
        return not self.unreadable and not any(one.found for one in self.hosts)


class Reference(NamedTuple):
    """The state of the CA's own keystore. ``trusted``: the CAs of its trust files; ``in_use``: those that sign."""

    in_use: frozenset[str]
    trusted: frozenset[str]
    revoked: frozenset[int]
    crl_number: int
    signers: tuple[CertificateFacts, ...]
    view: KeystoreView


def fleet_status(
    places: Iterable[Path | str],
    *,
    keystore: Path | str | None = None,
    within: timedelta = timedelta(days=30),
    now: datetime | None = None,
) -> FleetReport:
    """Read the manifests in ``places`` (bundle files, imported keystores, directories of either) and compare them.

    Raises InvalidInputError when there is nothing to read, and a KeystoreError for a keystore that cannot be used.
    """
    at = now or utc_now()
    reference = _reference(resolve_root(keystore)) if keystore is not None else None
    latest: dict[str, tuple[Path, Manifest]] = {}
    unreadable = []
    for place in _sources(places):
        try:
            manifest = _manifest(place, reference)
        except KeystoreError as error:
            unreadable.append((place, str(error)))
            continue
        known = latest.get(manifest.host)
        if known is None or known[1].number < manifest.number:
            latest[manifest.host] = place, manifest
    if not latest and not unreadable:
        raise InvalidInputError("no bundle (*.bundle) and no imported keystore there")
    newest = max((manifest.crl_number for _, manifest in latest.values()), default=0)
    hosts = [_judge(*latest[host], reference, newest, at, later(at, within)) for host in sorted(latest)]
    return FleetReport(at, tuple(hosts), tuple(unreadable))


def _reference(root: Path) -> Reference:
    view = keystore_at(root)
    register = read_register(root) or Register()
    in_use = frozenset(fingerprint(view.ca(role).der) for role in Role)
    return Reference(
        in_use,
        in_use
        | {fingerprint(ca) for role, ca in register.authorities if register.trusts_authority(role, ca)},
        frozenset(one.serial for one in register.certificates.values() if one.revoked is not None),
        register.crl_number if register.crl_published else 0,
        tuple(own_permissions_cas(view)),
        view,
    )


def _sources(places: Iterable[Path | str]) -> Iterator[Path]:
    for place in map(Path, places):
        if place.is_file() or (place / layout.BUNDLE).is_file():
            yield place
            continue
        with storage_errors("looking for bundles in"):
            entries = sorted(os.scandir(place), key=lambda entry: entry.name)
        for entry in entries:
            if entry.name.endswith(SUFFIX) or os.path.isfile(f"{entry.path}/{layout.BUNDLE}"):
                yield Path(entry.path)


def _manifest(place: Path, reference: Reference | None) -> Manifest:
    signed = read_bundle(place).signed if place.is_file() else safe_files.read(place, layout.BUNDLE)
    return read_manifest(signed, quoted(place), reference.signers if reference is not None else None)


def _judge(
    place: Path,
    manifest: Manifest,
    reference: Reference | None,
    newest_crl: int,
    now: datetime,
    limit: datetime,
) -> HostStatus:
    found = [*_ends(manifest, now, limit), *_changed(place, manifest)]
    if reference is not None:
        found += _against(manifest, reference)
    elif manifest.crl_number < newest_crl:
        found.append(f"its CRL ({manifest.crl_number}) is older than that of others ({newest_crl})")
    return HostStatus(place, manifest, manifest.ends < now, manifest.ends <= limit, tuple(found))


def _ends(manifest: Manifest, now: datetime, limit: datetime) -> Iterator[str]:
    for one in manifest.enclaves:
        if one.not_after < now:
            yield f"{one.enclave} has expired"
        elif one.not_after <= limit:
            yield f"{one.enclave} expires soon"
    if manifest.ends <= limit and not any(one.not_after <= limit for one in manifest.enclaves):
        yield "a CA or the CRL " + ("has expired" if manifest.ends < now else "expires soon")


def _changed(place: Path, manifest: Manifest) -> Iterator[str]:
    if place.is_file():
        content = read_bundle(place).opened(manifest)
        for name, digest in manifest.files.items():
            if name not in content or fingerprint(content[name]) != digest:
                yield f"{name} is missing in the bundle, or is not the file that was signed"
        return
    for name, problem in find_differences(KeystoreView(resolve_root(place))):
        yield f"{name} {problem}"


def _against(manifest: Manifest, reference: Reference) -> Iterator[str]:
    trusted = {one for role in Role for one in manifest.authorities[role]}
    if old := sorted(trusted - reference.trusted):
        yield f"still trusts an old CA: {', '.join(one[:16] for one in old)}"
    if reference.in_use - trusted:
        yield "does not trust the CA in use"
    for one in manifest.enclaves:
        if one.serial in reference.revoked:
            yield f"carries the revoked enclave {one.enclave}"
    if manifest.crl_number < reference.crl_number:
        yield f"has not got the CRL in force ({reference.crl_number})"
    last = last_signed(reference.view, manifest.host)
    if last is None:
        yield "no bundle was exported for it from this keystore"
    elif manifest.number < last[0].number:
        yield f"is behind: number {manifest.number}, exported last was {last[0].number}"
