"""The configuration of enclaves on Zenoh: a session file for each, and the router's files, which enforce.

    write_zenoh     these enclaves are on Zenoh     ``secure-keystore zenoh``, a secured launch
    follow          whoever changed the keystore    the same files for what it is now

The router has an identity of its own: a certificate for its host's name, which no enclave's has, and for nothing but
serving. It is issued again whenever its configuration changes. So whoever connects sees whether the router that runs
knows the present rules, and one that does not is restarted.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from enclave_addons.zenoh.configuration import ROUTER_NAME, RouterAddress
from enclave_addons.zenoh.files import (
    RouterFile,
    identity_problem,
    present_address,
    router_file,
    router_key,
    session_content,
)
from keystore.disk import layout, safe_files
from keystore.disk.safe_files import resolve_root
from keystore.disk.store import PRIVATE_MODE, PUBLIC_MODE, Store
from keystore.disk.view import KeystoreView, keystore_at
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.register import UNKNOWN, IssuedCertificate
from keystore.formats.role import Role
from keystore.formats.validity import Validity, later, utc_now
from keystore.signing.ca_access import CaAccess
from keystore.signing.certificate_request import public_half
from keystore.signing.private_key import key_pem, new_key
from keystore.signing.records import certificate_record
from keystore.steps.opening import opened_for_change
from keystore.steps.options import ProvisionOptions, Signing


class ZenohReport(NamedTuple):
    """The result of writing Zenoh's configuration. ``written``: files that were not as they are now. ``gaps``: what
    Zenoh cannot grant, and who is shut out. ``restart``: a router that runs has to be restarted to know of it."""

    keystore: Path
    router: RouterAddress
    written: tuple[str, ...]
    enclaves: tuple[str, ...]
    gaps: tuple[str, ...]
    restart: bool


def write_zenoh(
    keystore: Path | str,
    enclaves: Iterable[str],
    *,
    router: str | None = None,
    options: ProvisionOptions | None = None,
) -> ZenohReport:
    """Write session files for ``enclaves``; the router serves them and those that had one before. Idempotent.

    ``router``: where it is (``HOST:PORT``); None: as before, ``localhost:7447`` for the first time.

    On a host without ``private/`` only session files are written: the router's are where certificates are issued.
    Raises InvalidInputError for an enclave that is not there, SigningUnavailableError without the CA key.
    """
    chosen = options or ProvisionOptions()
    if chosen.signing is not None:
        return _signed_elsewhere(chosen.signing, enclaves, router, chosen)
    view = keystore_at(keystore)
    requested = set(enclaves)
    view.require_enclaves(requested)
    names = sorted({*requested, *view.zenoh_enclaves()})
    address = RouterAddress.parse(router) if router is not None else present_address(view) or RouterAddress()
    now = chosen.now or utc_now()
    due = later(now, chosen.renew_within)
    found = _pending(view, names, address, due)
    if not found.sessions and not found.is_router_stale:
        return ZenohReport(view.root, address, (), found.router.served, found.router.gaps, restart=False)
    with opened_for_change(view.root, now, chosen) as opened:
        opened.keep_adopted()  # the router's file follows from the register
        found = _pending(KeystoreView(opened.root), names, address, due)
        return _write(opened, found, address, chosen.access, now)


def matching_enclaves(keystore: Path | str, patterns: Sequence[str] | None) -> list[str]:
    """Return those that match one of ``patterns`` (``/robot1/*``).

    Without patterns all, but none more if some are on Zenoh already. Raises InvalidInputError for a pattern that none
    matches.
    """
    view = keystore_at(keystore)
    if patterns is None:
        return [] if view.has_zenoh_router else view.enclaves()
    return view.matching(patterns)


def follow(root: Path, options: ProvisionOptions) -> list[str]:
    """Write the files again after a change of the keystore; return what to report of it."""
    report = write_zenoh(root, (), options=options)
    said = [f"the Zenoh router's configuration follows: {RESTART}"] if report.restart else []
    return [*said, *report.gaps]


def sign(root: Path, options: ProvisionOptions, request: Any) -> Any:
    """Answer ``write_zenoh`` of a launcher, in the signing process."""
    names = [validate_enclave_name(name) for name in request["enclaves"]]
    report = write_zenoh(root, names, router=request["router"], options=options)
    return {**report._asdict(), "keystore": str(report.keystore), "router": str(report.router)}


def _signed_elsewhere(
    signing: Signing, enclaves: Iterable[str], router: str | None, options: ProvisionOptions
) -> ZenohReport:
    done = signing.request("zenoh", {"enclaves": list(enclaves), "router": router}, options)
    return ZenohReport(
        Path(done["keystore"]), RouterAddress.parse(done["router"]), tuple(done["written"]),
        tuple(done["enclaves"]), tuple(done["gaps"]), done["restart"],
    )  # fmt: skip


def session_differences(keystore: Path | str, enclave: str, address: RouterAddress) -> tuple[str, ...]:
    """Return why the session file of an enclave is not what ``write_zenoh`` left; empty if it is.

    Cheap: evaluated before each process.
    """
    view = KeystoreView(resolve_root(keystore))
    if safe_files.read_if_there(view.root, layout.zenoh_session(enclave)) == session_content(
        view, enclave, address
    ):
        return ()
    return (f"{layout.zenoh_session(enclave)} is not what was written for it",)


def router_differences(keystore: Path | str) -> tuple[str, ...]:
    """Return why the router's file must not be used: it is not what follows from the keystore."""
    view = KeystoreView(resolve_root(keystore))
    address = present_address(view)
    if address is None:
        return (f"{layout.ZENOH_ROUTER} is missing",)
    wanted = router_file(view, view.zenoh_enclaves(), address)
    if safe_files.read_if_there(view.root, layout.ZENOH_ROUTER) == wanted.content:
        return ()
    return (f"{layout.ZENOH_ROUTER} is not what follows from the permissions that are signed",)


RESTART = (
    "a router that runs has to be restarted to enforce it (one that secure-launch started restarts by itself)"
)


class _Pending(NamedTuple):
    """The files for Zenoh that must be written.

    Attributes:
        sessions: Session files, path -> content.
        router: What the router should serve; nothing on a host that has no keys of the CAs.
        is_router_stale: Whether the router's file or certificate must be written.
    """

    sessions: dict[str, bytes]
    router: RouterFile
    is_router_stale: bool


def _pending(view: KeystoreView, names: list[str], address: RouterAddress, due: datetime) -> _Pending:
    """Compare with what is there. Evaluated before each secured launch."""
    wanted = {layout.zenoh_session(name): session_content(view, name, address) for name in names}
    stale = {
        file: content
        for file, content in wanted.items()
        if safe_files.read_if_there(view.root, file) != content
    }
    if not (view.root / layout.PRIVATE).is_dir():
        return _Pending(stale, RouterFile(b"", (), ()), False)
    router = router_file(view, names, address)
    changed = safe_files.read_if_there(view.root, layout.ZENOH_ROUTER) != router.content
    return _Pending(stale, router, changed or identity_problem(view, due) is not None)


def _write(
    opened: Store, found: _Pending, address: RouterAddress, access: CaAccess, now: datetime
) -> ZenohReport:
    view = KeystoreView(opened.root)
    files = dict(found.sessions)
    with opened.batch() as batch:
        if found.is_router_stale:
            record, issued = _issue(view, address, access, now)
            batch.record(opened.register.with_certificates([record]))
            files |= {**issued, layout.ZENOH_ROUTER: found.router.content}
        for file, content in files.items():
            batch.file(file, content, PRIVATE_MODE if file == layout.ZENOH_ROUTER_KEY else PUBLIC_MODE)
        restart = found.is_router_stale and view.has_zenoh_router
    return ZenohReport(view.root, address, tuple(files), found.router.served, found.router.gaps, restart)


def _issue(
    view: KeystoreView, address: RouterAddress, access: CaAccess, now: datetime
) -> tuple[IssuedCertificate, dict[str, bytes]]:
    """Issue a certificate for the router's host; its key stays unless it is missing or others could read it."""
    view.refuse_ended(now, Role.IDENTITY)
    authority = view.authority(Role.IDENTITY, access)
    key = router_key(view)
    fresh = None if key is not None else new_key()
    public = fresh.public_key() if fresh is not None else public_half(key or b"", layout.ZENOH_ROUTER_KEY)
    validity = Validity.starting(now, view.settings.lifetime)
    facts = authority.issue(ROUTER_NAME, public, validity, address.hosts)
    files = {layout.ZENOH_ROUTER_KEY: key_pem(fresh)} if fresh is not None else {}
    record = certificate_record(UNKNOWN, facts, authority.facts)._replace(replaced=True)
    return record, {**files, layout.ZENOH_ROUTER_CERT: facts.pem}
