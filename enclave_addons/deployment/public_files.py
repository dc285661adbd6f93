"""A bundle of some enclaves for one host: exactly the files their processes read, nothing that signs.

Every file is named one by one from the list in ``layout``: never ``private/``, unsigned twins, others' keys, strays."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime
from enum import Enum
from pathlib import Path

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files, store
from keystore.disk.archive import archive_bytes
from keystore.disk.store import Content, Link, write_new
from keystore.disk.versions import write_tree, written_aside
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import DamagedKeystoreError, InvalidInputError, storage_errors
from keystore.formats.validity import utc_now
from keystore.verification import Finding, Severity, verify


class PublicFiles(str, Enum):
    """How an enclave gets CA certificates, governance and CRL."""

    LINK = "link"  # as in the keystore: public/ and governance once, relative links to them
    COPY = "copy"  # every enclave directory stands alone; public/ is there for ``verify`` and a launch


def export(
    keystore: Path | str,
    output: Path | str,
    patterns: Iterable[str],
    *,
    public: PublicFiles = PublicFiles.LINK,
    now: datetime | None = None,
    accept_exposures: bool = False,
) -> tuple[str, ...]:
    """Write the bundle of all enclaves that match one of ``patterns`` (``/robot1/*``); returns their names.

    ``output`` ending in ``.tar`` or ``.tar.gz`` becomes an archive with the same bytes for the same keystore,
    otherwise a new directory. Raises InvalidInputError when nothing matches or ``output`` exists, DamagedKeystoreError
    for whatever ``verify`` calls an error of these enclaves or of the keystore, and for exposures unless they are
    accepted.
    """
    view = keystore_at(keystore)
    names = view.matching(patterns)
    refuse_unfit(view, names, now or utc_now(), accept_exposures)
    _refuse_without_key(view, names)
    files: dict[str, Content | Link] = {**files_of(view, names)}
    for name in names:
        files |= _public_files(view, name, public)
    target = Path(output)
    if target.exists() or target.is_symlink():
        raise InvalidInputError(f"{quoted(target)} exists already; choose a new name or remove it")
    if Path(os.path.realpath(target)).is_relative_to(view.root):
        raise InvalidInputError(f"{quoted(target)} lies in the keystore; choose another place")
    with storage_errors("writing the bundle"):
        _write(target, files)
    return tuple(names)


def _refuse_without_key(view: KeystoreView, names: list[str]) -> None:
    for name in names:
        if view.has_request(name):
            raise InvalidInputError(
                f"the key of enclave {name} was made on its host and is only there; export a signed bundle for that "
                f"host (--host NAME --enclave {name}) and import it there"
            )


def refuse_unfit(view: KeystoreView, names: list[str], now: datetime, accept_exposures: bool) -> None:
    """Refuse what ``verify`` finds wrong with these enclaves or the keystore: it would travel with the bundle."""
    for name in names:
        for file in layout.RUNTIME_FILES:
            if file == layout.KEY and view.has_request(name):
                continue  # made on its host, and only there
            if view.enclave_file(name, file) is None:
                raise DamagedKeystoreError(
                    f"enclave {name} is incomplete ({file}); secure-keystore renew completes it"
                )
    owners = {layout.enclave_directory(name): f"enclave {name}" for name in names}
    reported = [
        (_concerned(finding.place, owners), finding) for finding in verify(view.root, now=now).findings
    ]
    for what, finding in sorted(reported, key=lambda one: one[0] != _KEYSTORE):
        if what is not None:
            _refuse(what, finding, accept_exposures)


_KEYSTORE = "the keystore"


def _concerned(place: str, owners: Mapping[str, str]) -> str | None:
    if not place.startswith(layout.ENCLAVES + "/") or place in (layout.GOVERNANCE, layout.GOVERNANCE_XML):
        return _KEYSTORE
    return owners.get(place) or owners.get(place.rpartition("/")[0])


def _refuse(what: str, finding: Finding, accept_exposures: bool) -> None:
    found = f"{finding.place}: {finding.message} [{finding.code}]; repair: {finding.repair}"
    # Fast DDS alone cannot carry large permissions: the user's choice of DDS.
    if finding.severity is Severity.ERROR and finding.code != "too-large":
        raise DamagedKeystoreError(f"{what} is not fit for a host: {found}")
    if finding.severity is Severity.EXPOSURE and not accept_exposures:
        raise DamagedKeystoreError(f"{what} is exposed: {found}; or export with --accept-exposures")


def files_of(view: KeystoreView, names: Iterable[str]) -> dict[str, Content]:
    """Return what every bundle of these enclaves holds, by path; a key only if it was not made on its host."""
    enclaves = [(name, not view.has_request(name)) for name in names]
    found = {}
    for path in sorted(layout.bundle_files(enclaves, crl=view.has_crl)):
        if path.endswith(f"/{layout.KEY}"):
            found[path] = Content(safe_files.read_private(view.root, path), store.PRIVATE_MODE)
        else:
            found[path] = Content(safe_files.read(view.root, path))
    return found


def _public_files(
    view: KeystoreView, enclave: str, public: PublicFiles
) -> Iterator[tuple[str, Content | Link]]:
    for name, link in store.enclave_links(enclave, crl=view.has_crl).items():
        file = link if public is PublicFiles.LINK else Content(safe_files.read(view.root, link.source))
        yield layout.enclave_file(enclave, name), file


def _write(target: Path, files: Mapping[str, Content | Link]) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    with written_aside(target) as aside:
        if target.name.endswith((".tar", ".tar.gz")):
            content = archive_bytes(files, compressed=target.name.endswith(".gz"))
            write_new(aside, content, store.PRIVATE_MODE, durable=True)  # it holds keys
        else:
            write_tree(aside, files, durable=True)
