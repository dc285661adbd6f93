"""The files for Zenoh: whether the router enforces what is signed, and whether it is who it says it is.

A file that is not what follows from the keystore is an error, whatever differs. Such files need no editing.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime

from enclave_addons.zenoh.configuration import RouterAddress
from enclave_addons.zenoh.files import (
    identity_problem,
    present_address,
    router_file,
    session_content,
)
from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import KeystoreError
from keystore.formats.certificate import read_certificate
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity


def check_zenoh(view: KeystoreView, now: datetime) -> Iterator[Finding]:
    """Check the files of a keystore with a Zenoh router."""
    fix = repair.run(view.root, "zenoh", "--enclave", "/none", note="writes all of them again")
    try:
        address = present_address(view)
        assert address is not None, "the keystore has a router's file"
        yield from _router(view, address, now)
        yield from _sessions(view, address)
    except KeystoreError as error:
        yield Finding(Severity.ERROR, "zenoh-router", layout.ZENOH_ROUTER, str(error), fix)


def _again(view: KeystoreView) -> str:
    return repair.run(view.root, "zenoh", note="then restart the router")


def _router(view: KeystoreView, address: RouterAddress, now: datetime) -> Iterator[Finding]:
    wanted = router_file(view, view.zenoh_enclaves(), address)
    found = safe_files.read_if_there(view.root, layout.ZENOH_ROUTER)
    if found != wanted.content:
        yield Finding(
            Severity.ERROR, "zenoh-rules", layout.ZENOH_ROUTER,
            "does not enforce what is signed: it was edited, or is older than the last change", _again(view),
        )  # fmt: skip
    for gap in wanted.gaps:
        yield Finding(Severity.WARNING, "zenoh-gap", layout.ZENOH_ROUTER, gap)
    if (problem := identity_problem(view, now)) is not None:
        yield Finding(Severity.ERROR, "zenoh-identity", layout.ZENOH_ROUTER_CERT, problem, _again(view))


def _sessions(view: KeystoreView, address: RouterAddress) -> Iterator[Finding]:
    for enclave in view.zenoh_enclaves():
        file = layout.zenoh_session(enclave)
        wanted, found = session_content(view, enclave, address), safe_files.read_if_there(view.root, file)
        if found != wanted:
            yield Finding(
                Severity.ERROR, "zenoh-session", file,
                "not what was written for it: its processes may talk past the router, or not find it", _again(view),
            )  # fmt: skip
    for enclave in view.enclaves():
        pem = view.enclave_file(enclave, layout.CERT)
        if pem is not None and read_certificate(pem, enclave).names_hosts:
            yield Finding(
                Severity.EXPOSURE, "zenoh-impostor", layout.enclave_file(enclave, layout.CERT),
                "names hosts, so that its holder could play the router there", repair.renew(view.root, enclave),
            )  # fmt: skip
