"""Contents of a keystore as plain values for reports. Reads no private key, proves no signature (see ``verify``)."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

from keystore.disk import layout
from keystore.disk.signed_documents import governance_in_force
from keystore.disk.view import KeystoreView, keystore_at
from keystore.formats.certificate import CertificateFacts
from keystore.formats.compact import expanded
from keystore.formats.domains import Domains
from keystore.formats.governance import DomainRule, TopicRule
from keystore.formats.permissions_document import granted_rules, parse_permissions
from keystore.formats.policy import Rule
from keystore.formats.role import Role
from keystore.formats.validity import iso
from keystore.signing import smime
from keystore.signing.public_key import fingerprint, key_kind
from keystore.verification.governance import weaknesses


class KeyEntry(NamedTuple):
    """A key of a keystore. ``use``: ``identity CA``, ``permissions CA`` or ``enclave``. ``private_key``: where it is,
    as far as this copy of the keystore says. Dates as ISO 8601; fingerprint and key identifier as SHA-256 in hex."""

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
    """List CAs first, those that are only still trusted after the one in use; then enclaves by name.

    Raises ``NotAKeystoreError`` and ``DamagedKeystoreError``.
    """
    view = keystore_at(keystore)
    return (*_authorities(view), *_enclaves(view))


def _authorities(view: KeystoreView) -> Iterator[KeyEntry]:
    for role in Role:
        for number, facts in enumerate(view.ca_bundle(role)):
            in_use = number == 0
            yield _entry(
                role.label,
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
        facts = view.certificate(enclave)
        if facts is not None:
            where = "on its host" if view.has_request(enclave) else "file of the enclave"
            yield _entry("enclave", enclave, facts, where)


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
    certificate = facts.certificate
    digest = certificate.signature_hash_algorithm
    return f"{_NAMES.get(certificate.signature_algorithm_oid.dotted_string, 'other')}, {digest.name if digest else '?'}"


_NAMES = {
    **{f"1.2.840.10045.4.3.{arc}": "ECDSA" for arc in (2, 3, 4)},
    **{f"1.2.840.113549.1.1.{arc}": "RSA PKCS#1 v1.5" for arc in (11, 12, 13)},
}


class GovernanceFacts(NamedTuple):
    """The governance in force. ``rules``: one for each set of domains, by the attribute names of DDS-Security."""

    rules: list[dict[str, Any]]
    weaknesses: tuple[str, ...]


def governance_facts(keystore: Path | str) -> GovernanceFacts:
    """Read the governance in force; raises NotAKeystoreError, DamagedKeystoreError and InvalidInputError."""
    view = keystore_at(keystore)
    governance = governance_in_force(view)
    return GovernanceFacts([_plain(rule) for rule in governance.domain_rules], tuple(weaknesses(governance)))


def _plain(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Domains):
        return str(value)
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    if isinstance(value, (DomainRule, TopicRule)):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return value


def granted(keystore: Path | str) -> dict[str, frozenset[Rule]]:
    """Map enclaves to the rules that their permissions allow, with final names; one without permissions is left out.

    Compact permissions are written out. What they deny is not taken off.
    No ROS rule explains a name without a slash before it: it is a topic of DDS.

    Raises ``NotAKeystoreError``, ``DamagedKeystoreError``, and ``InvalidInputError`` for files that cannot be read.
    """
    view = keystore_at(keystore)
    found = {}
    for enclave in view.enclaves():
        signed = view.enclave_file(enclave, layout.PERMISSIONS)
        if signed is not None:
            place = layout.enclave_file(enclave, layout.PERMISSIONS)
            permissions = parse_permissions(smime.read(signed, place).document, place)
            found[enclave] = frozenset(granted_rules(permissions._replace(rules=expanded(permissions.rules))))
    return found
