"""Compare an imported keystore with the signed manifest that came with it, which has the hash of every file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.disk.versions import imported_at
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, KeystoreError
from keystore.formats.bundle import Manifest, parse_manifest
from keystore.formats.certificate import CertificateFacts
from keystore.formats.role import Role
from keystore.signing import smime
from keystore.signing.public_key import fingerprint


def read_manifest(signed: bytes, place: str, signers: Iterable[CertificateFacts] | None = None) -> Manifest:
    """Read a manifest, which one of ``signers`` signed, if they are given. Raises DamagedKeystoreError."""
    document = smime.read(signed, place)
    if signers is not None:
        smime.check(document, list(signers), place)
    return parse_manifest(document.document, place)


def deployed_manifest(view: KeystoreView) -> Manifest | None:
    """Return the signed manifest of an imported keystore, None without an import. Raises DamagedKeystoreError."""
    signed = safe_files.read_if_there(view.root, layout.BUNDLE)
    if signed is None and imported_at(view.root) == view.root:
        return None
    if signed is None:
        raise DamagedKeystoreError(
            f"{quoted(view.root / layout.BUNDLE)} is missing, so it is unknown what was imported"
        )
    return read_manifest(signed, quoted(view.root / layout.BUNDLE), view.ca_bundle(Role.PERMISSIONS))


def differing_files(
    view: KeystoreView, manifest: Manifest, enclaves: Iterable[str] | None = None
) -> Iterator[tuple[str, str]]:
    """Yield each file that is not as the manifest has it, and why; of those that ``enclaves`` read, if given."""
    chosen = manifest.names if enclaves is None else [name for name in enclaves if name in manifest.names]
    has_key = {one.enclave: one.has_key for one in manifest.enclaves}
    wanted = layout.bundle_files(((name, has_key[name]) for name in chosen), crl=True, handover=True)
    for name in sorted(wanted & set(manifest.files)):
        found = safe_files.read_if_there(view.root, name)
        if found is None:
            yield name, "is missing: the bundle that was imported has it"
        elif fingerprint(found) != manifest.files[name]:
            yield name, "is not the file of the bundle that was imported"
    if layout.CRL not in manifest.files and view.has_crl:
        yield layout.CRL, "was not in the bundle that was imported"


def deployment_problem(view: KeystoreView, enclaves: Iterable[str]) -> str | None:
    """Return why what these enclaves read is not what was imported; None if it is, or if nothing was imported."""
    try:
        manifest = deployed_manifest(view)
    except DamagedKeystoreError as error:
        return str(error)
    if manifest is None:
        return None
    first = next(differing_files(view, manifest, enclaves), None)
    return f"{quoted(view.root / first[0])} {first[1]}" if first is not None else None


def refuse_changed_deployment(view: KeystoreView, enclaves: Iterable[str]) -> None:
    """Raise DamagedKeystoreError if an imported keystore is not as its bundle left it."""
    if (problem := deployment_problem(view, enclaves)) is not None:
        raise DamagedKeystoreError(
            f"{problem}. Import the bundle again, which restores it: secure-keystore import KEYSTORE HOST.bundle"
        )


def find_differences(view: KeystoreView) -> list[tuple[str, str]]:
    """Return what differs in an imported keystore, including a manifest that cannot be trusted; nothing elsewhere."""
    try:
        manifest = deployed_manifest(view)
        return list(differing_files(view, manifest)) if manifest is not None else []
    except KeystoreError as error:
        return [(layout.BUNDLE, str(error))]
