"""Comparison of the keystore with what the register lists as issued last.

What was put back was signed here once, and proves nothing about today. Without a register fingerprints can be shown."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import suppress
from datetime import datetime

from keystore.disk import layout
from keystore.disk.crl_file import crl_problem
from keystore.disk.deployed import deployed_manifest
from keystore.disk.register_file import describe, foreign_authorities, needs_register, read_register
from keystore.disk.view import KeystoreView
from keystore.errors import KeystoreError, UnsafeKeystoreError
from keystore.formats.certificate import CertificateFacts
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.validity import iso
from keystore.signing.public_key import fingerprint, fingerprints
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity


def load_register(view: KeystoreView) -> tuple[Register | None, list[Finding]]:
    """Load the register, or say why there is none where one belongs."""
    try:
        register = read_register(view.root)
    except UnsafeKeystoreError:
        return None, []  # the check of all files names it, with what to do about it
    except KeystoreError as error:
        return None, [Finding(Severity.ERROR, "register", layout.REGISTER, str(error), repair.BACKUP)]
    if register is None and needs_register(view):
        fix = repair.renew(view.root, note="takes over what can still be known")
        why = (
            "there is no register: revoked certificates and earlier files that were put back are not noticed"
        )
        return None, [Finding(Severity.EXPOSURE, "no-register", layout.REGISTER, why, fix)]
    return register, []


def check_anchors(
    view: KeystoreView, register: Register | None, required: Collection[str]
) -> Iterator[Finding]:
    """Check the trusted CAs.

    ``required``: SHA-256 of the CA certificates to trust, for one role (``identity=``) or both; any if empty.
    """
    for role, ca in foreign_authorities(view, register):
        yield Finding(
            Severity.ERROR, "foreign-ca", layout.ca_cert(role),
            f"holds a CA that this keystore did not make, or has retired: {describe(ca)}; whoever has its key can make "
            "enclaves that Fast DDS lets in", repair.renew(view.root, note="once it is known who put it there"),
        )  # fmt: skip
    for role in Role:
        prefix = f"{role.use}="
        wanted = fingerprints(one.removeprefix(prefix) for one in required)
        bundle = view.ca_bundle(role)
        for ca in bundle:
            if wanted and fingerprint(ca.der) not in wanted:
                yield Finding(
                    Severity.ERROR, "ca-not-required", layout.ca_cert(role),
                    f"trusts a CA that --require-ca does not name: {describe(ca)}", repair.BACKUP,
                )  # fmt: skip
        if register is None and len(bundle) > 1 and not wanted and not _is_imported(view):
            yield Finding(
                Severity.EXPOSURE, "several-cas", layout.ca_cert(role),
                f"trusts {len(bundle)} CAs: {'; '.join(map(describe, bundle))}; without a register it is unknown "
                "whether a roll-over is under way", "verify --require-ca SHA256 for each CA that is meant",
            )  # fmt: skip


def _is_imported(view: KeystoreView) -> bool:
    """Return whether a signed manifest names the CAs; that they are these is checked with its other files."""
    with suppress(KeystoreError):
        return deployed_manifest(view) is not None
    return False


def check_published(view: KeystoreView, register: Register | None, now: datetime) -> Iterator[Finding]:
    """Check that CRL and governance are the ones published last, and that everybody is still there."""
    if register is None:
        return
    problem = crl_problem(view, register, now)
    if problem is not None and problem != "the CRL has expired":  # which its dates report
        yield Finding(
            Severity.ERROR, "crl-not-last", layout.CRL,
            f"{problem}: enclaves that were revoked since may talk again",
            repair.renew(view.root, note="publishes it again; then deploy"),
        )  # fmt: skip
    present = set(view.enclaves())
    for enclave in sorted({one.enclave for one in register.certificates.values()} - present - {""}):
        if (held := register.in_force(enclave)) is not None and held.not_after > now:
            yield Finding(
                Severity.WARNING, "enclave-gone", layout.enclave_directory(enclave),
                f"is not here, but its certificate is valid until {iso(held.not_after)} and not revoked",
                repair.run(view.root, "remove", enclave, note="revokes it; or restore it from a backup"),
            )  # fmt: skip


def check_certificate_issued(
    view: KeystoreView, register: Register | None, enclave: str, facts: CertificateFacts
) -> Iterator[Finding]:
    """Finds a certificate that the register does not know for ``enclave``, or that was replaced since."""
    if register is None:
        return
    place = layout.enclave_file(enclave, layout.CERT)
    again = repair.renew(view.root, enclave, "--new-keys", "--revoke-old")
    known, held = register.certificates.get(facts.serial), register.in_force(enclave)
    if known is None or known.enclave != enclave or known.key != fingerprint(facts.public_key):
        why = "was not issued here: no certificate with this serial and key is in the register"
        yield Finding(Severity.ERROR, "not-issued-here", place, why, again)
    elif known.revoked is not None:
        why = f"was revoked on {iso(known.revoked)} and has been put back"
        yield Finding(Severity.ERROR, "revoked", place, why, again)
    elif held is None or held.serial != facts.serial:
        why = "is an earlier one that has been put back: another was issued in its place"
        yield Finding(Severity.ERROR, "certificate-not-last", place, why, again)


def check_permissions_issued(
    view: KeystoreView, register: Register | None, enclave: str, document: bytes
) -> Iterator[Finding]:
    """Finds permissions of ``enclave`` other than those that were signed last."""
    if register is None:
        return
    last = register.permissions(enclave)
    if last is not None and last.document == fingerprint(document):
        return
    earlier = any(one.document == fingerprint(document) for one in register.documents)
    what = (
        "an earlier document that has been put back" if earlier else "a document that is not in the register"
    )
    yield Finding(
        Severity.ERROR, "permissions-not-last", layout.enclave_file(enclave, layout.PERMISSIONS),
        f"{what}: it may permit what was removed since", repair.grant_again(view.root, enclave),
    )  # fmt: skip
