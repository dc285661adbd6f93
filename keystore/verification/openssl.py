"""Check CAs and enclaves' certificates with OpenSSL: what it refuses, every DDS implementation refuses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from keystore.disk import layout
from keystore.disk.view import KeystoreView
from keystore.errors import KeystoreError, NotInstalledError
from keystore.formats.certificate import CertificateFacts
from keystore.formats.role import Role
from keystore.signing.openssl import refusals
from keystore.signing.public_key import issued_by
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity

_REFUSES = "OpenSSL, by which DDS implementations check, refuses"


def check_by_openssl(view: KeystoreView) -> Iterator[Finding]:
    """Ask OpenSSL of each CA, and of the enclaves below it, unless the CA itself is what it refuses."""
    enclaves: dict[str, CertificateFacts] = {}
    for enclave in view.enclaves():
        with suppress(KeystoreError):  # the check of the enclave reports what cannot be read
            if (facts := view.certificate(enclave)) is not None:
                enclaves[enclave] = facts
    try:
        for role in Role:
            for ca in view.ca_bundle(role):
                below = enclaves if role is Role.IDENTITY else {}
                yield from _check(
                    view, role, ca, {name: its for name, its in below.items() if issued_by(its, ca)}
                )
    except NotInstalledError as error:
        text = f"certificates were not checked as DDS implementations do: {error}"
        yield Finding(Severity.WARNING, "openssl-missing", layout.PUBLIC, text, "apt install openssl")


def _check(
    view: KeystoreView, role: Role, ca: CertificateFacts, below: dict[str, CertificateFacts]
) -> Iterator[Finding]:
    own, *others = refusals(ca, [ca, *below.values()], role)
    if own:
        fix = repair.replace_ca(view.root, role)
        text = f"{_REFUSES} what this CA signs: {own}"
        yield Finding(Severity.ERROR, "ca-refused", layout.ca_cert(role), text, fix)
        return
    for enclave, why in zip(below, others, strict=True):
        if why:
            note = "or have the CA that issued it issue another: secure-keystore sign --issued"
            fix = repair.renew(view.root, enclave, note=note)
            place = layout.enclave_file(enclave, layout.CERT)
            yield Finding(Severity.ERROR, "certificate-refused", place, f"{_REFUSES} it: {why}", fix)
