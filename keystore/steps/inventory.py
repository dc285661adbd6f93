"""Every key and algorithm of a keystore: which certificate, of which kind, until when. Reads only, no private key."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout, safe_files
from keystore.disk.safe_files import resolve_root
from keystore.disk.view import KeystoreView
from keystore.errors import printable
from keystore.formats.certificate import CertificateFacts, read_certificate
from keystore.formats.role import Role
from keystore.formats.validity import iso
from keystore.signing.public_key import fingerprint, key_kind


class KeyEntry(NamedTuple):
    """``use``: ``identity CA``, ``permissions CA`` or ``enclave``. ``private_key``: where it is, as far as this copy of
    the keystore tells. Dates as ISO 8601; fingerprint and key identifier as SHA-256 in hex."""

    use: str
    name: str
    common_name: str
    key: str
    signature: str
    not_before: str
    not_after: str
    serial: str
    certificate_sha256: str
    private_key: str


def inventory(keystore: Path | str) -> tuple[KeyEntry, ...]:
    """CAs first, those that are only still trusted after the one in use; then enclaves by name.

    Raises NotAKeystoreError and DamagedKeystoreError.
    """
    view = KeystoreView(resolve_root(keystore))
    view.require_complete()
    return (*_authorities(view), *_enclaves(view))


def _authorities(view: KeystoreView) -> Iterator[KeyEntry]:
    for role in Role:
        for number, facts in enumerate(view.ca_bundle(role)):
            in_use = number == 0
            yield _entry(
                role.value.replace("_ca", " CA"),
                "in use" if in_use else "still trusted",
                facts,
                _place(view.key_file(role)) if in_use else "not looked for",
            )


def _place(file: str | None) -> str:
    if file is None:
        return "not here"
    return "PKCS#11 token" if file.endswith(".p11") else "file of the keystore"


def _enclaves(view: KeystoreView) -> Iterator[KeyEntry]:
    for enclave in view.enclaves():
        relative = f"{layout.enclave_directory(enclave)}/{layout.CERT}"
        pem = safe_files.read_if_there(view.root, relative)
        if pem is not None:
            where = "on its host" if view.has_request(enclave) else "file of the enclave"
            yield _entry("enclave", enclave, read_certificate(pem, printable(relative)), where)


def _entry(use: str, name: str, facts: CertificateFacts, private_key: str) -> KeyEntry:
    return KeyEntry(
        use,
        name,
        facts.common_name or "",
        key_kind(facts.public_key),
        _signature(facts),
        iso(facts.validity.not_before),
        iso(facts.validity.not_after),
        format(facts.serial, "x"),
        fingerprint(facts.der),
        private_key,
    )


def _signature(facts: CertificateFacts) -> str:
    from cryptography import x509

    certificate = x509.load_der_x509_certificate(facts.der)
    digest = certificate.signature_hash_algorithm
    return f"{_NAMES.get(certificate.signature_algorithm_oid.dotted_string, 'other')}, {digest.name if digest else '?'}"


_NAMES = {
    **{f"1.2.840.10045.4.3.{arc}": "ECDSA" for arc in (2, 3, 4)},
    **{f"1.2.840.113549.1.1.{arc}": "RSA PKCS#1 v1.5" for arc in (11, 12, 13)},
}
