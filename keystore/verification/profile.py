"""Certificates by what they allow beyond identifying one enclave, and keys that two of them share."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from keystore.disk import layout
from keystore.disk.view import KeystoreView
from keystore.formats.certificate import CertificateFacts
from keystore.formats.role import Role
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity

if TYPE_CHECKING:
    from cryptography import x509

_BROKEN_HASHES = frozenset({"md5", "sha1"})


def check_leaf(view: KeystoreView, enclave: str, facts: CertificateFacts) -> Iterator[Finding]:
    """Basic constraints, key usage and signature of an enclave's certificate (RFC 5280 sections 4.2.1.3, 4.2.1.9)."""
    from cryptography import x509

    try:
        certificate = x509.load_der_x509_certificate(facts.der)
        extensions = certificate.extensions
        algorithm = certificate.signature_hash_algorithm
    except Exception:  # the parser's own errors, which differ between releases: to us it is one thing
        yield _leaf(view, enclave, Severity.ERROR, "certificate", "its extensions cannot be read")
        return
    if algorithm is None or algorithm.name in _BROKEN_HASHES:
        name = "no hash" if algorithm is None else algorithm.name
        yield _leaf(
            view, enclave, Severity.EXPOSURE, "weak-signature", f"signed with {name}, which can be forged"
        )
    constraints = _extension(extensions, x509.BasicConstraints)
    if constraints is not None and constraints.ca:
        yield _leaf(
            view,
            enclave,
            Severity.ERROR,
            "leaf-is-ca",
            "a CA certificate: its key can certify enclaves of its own",
        )
    yield from _key_usage(view, enclave, _extension(extensions, x509.KeyUsage))
    if _extension(extensions, x509.ExtendedKeyUsage) is None:
        yield _leaf(
            view, enclave, Severity.WARNING, "no-extended-key-usage",
            "nothing says that its key may not sign documents: where it is certified by a permissions CA, it can",
        )  # fmt: skip


def _key_usage(view: KeystoreView, enclave: str, usage: x509.KeyUsage | None) -> Iterator[Finding]:
    if usage is None:
        yield _leaf(view, enclave, Severity.WARNING, "no-key-usage", "nothing restricts what its key may do")
    elif usage.key_cert_sign or usage.crl_sign:
        yield _leaf(
            view, enclave, Severity.ERROR, "leaf-can-certify", "its key may sign certificates or CRLs"
        )
    elif not usage.digital_signature:
        yield _leaf(
            view, enclave, Severity.WARNING, "key-usage", "its key may not sign, which authentication needs"
        )


def check_shared_keys(view: KeystoreView, enclaves: dict[str, CertificateFacts]) -> Iterator[Finding]:
    """One key, one enclave: who has the key of two is both, and who has a CA's is everybody."""
    owners = {facts.public_key: f"the {role.value}" for role in Role for facts in view.ca_bundle(role)}
    for enclave, facts in enclaves.items():
        other = owners.setdefault(facts.public_key, f"enclave {enclave}")
        if other != f"enclave {enclave}":
            yield _leaf(view, enclave, Severity.ERROR, "shared-key", f"has the same key as {other}")


def _extension(extensions: x509.Extensions, kind: type) -> Any:
    from cryptography import x509

    try:
        return extensions.get_extension_for_class(kind).value
    except x509.ExtensionNotFound:
        return None


def _leaf(view: KeystoreView, enclave: str, severity: Severity, code: str, message: str) -> Finding:
    fix = repair.run(view.root, "renew", enclave, "--new-keys", "--revoke-old")
    return Finding(severity, code, f"{layout.enclave_directory(enclave)}/{layout.CERT}", message, fix)
