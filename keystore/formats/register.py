"""The register of a keystore: what was issued, to whom, until when, and what of it was revoked. Performs no I/O.

``private/register.json``, written before a certificate or document leaves the CA. What stands elsewhere in the
keystore can be put back from a backup or copied in; the register says whether it is what was issued last.

    authorities     every CA this keystore made or was given: waiting, in use, or retired
    certificates    by serial number; of each enclave one is in force
    documents       what was signed for whom, by hash; governance as text
    settings        as which subjects and for how long is signed, as text
    crl_number      of the CRL published last, 0 before the first (RFC 5280 section 5.2.3: it only grows)
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from enum import Enum
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

from keystore.errors import DamagedKeystoreError
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.role import Role
from keystore.formats.validity import iso, parse_time

_VERSION = 1

_time = lru_cache(maxsize=1024)(parse_time)  # what was issued together has the same dates
UNKNOWN = ""
"""In place of an enclave, subject or key: of certificates that only a CRL lists."""


class AuthorityState(str, Enum):
    """Of a CA over its life. All but the retired may stand in a trust file."""

    WAITING = "waiting"  # made, to sign after the switch
    IN_USE = "in use"
    LEAVING = "leaving"  # signs no more; trusted until the roll-over is finished
    RETIRED = "retired"  # trusted no more


class IssuedCertificate(NamedTuple):
    """A certificate that was issued. ``subject`` is the common name, ``key`` the SHA-256 of the public key
    (SubjectPublicKeyInfo, hex), ``issuer`` the SHA-256 of the CA's certificate. ``replaced``: another one of the
    enclave is in force, or it was removed."""

    serial: int
    enclave: str
    subject: str
    key: str
    issuer: str
    not_before: datetime
    not_after: datetime
    replaced: bool = False
    revoked: datetime | None = None
    lifetime: int | None = None
    """In seconds, as granted, which a renewal keeps; None if it was found in the files, or another CA issued it."""

    @property
    def in_force(self) -> bool:
        return not self.replaced and self.revoked is None


class SignedPermissions(NamedTuple):
    """Permissions that were signed. ``document`` is the SHA-256 of the signed XML, ``rules`` of what it grants apart
    from subject and dates."""

    enclave: str
    subject: str
    document: str
    rules: str
    not_after: datetime


@dataclass(frozen=True)
class Register:
    """The contents of a register; each change gives a new one. ``authorities``: role and DER certificate -> state.
    ``crl_published``: whether there is a CRL by the CA in use. ``written``: the machine's clock when it was written
    last. ``settings``: what ``secure-keystore.json`` was made with."""

    authorities: Mapping[tuple[Role, bytes], AuthorityState] = field(default_factory=dict)
    certificates: Mapping[int, IssuedCertificate] = field(default_factory=dict)
    documents: tuple[SignedPermissions, ...] = ()
    governance: bytes = b""
    crl_number: int = 0
    crl_published: bool = False
    written: datetime | None = None
    settings: bytes = b""

    @cached_property
    def _by_enclave(self) -> dict[str, list[IssuedCertificate]]:
        found: dict[str, list[IssuedCertificate]] = {}
        for one in self.certificates.values():
            found.setdefault(one.enclave, []).append(one)
        return found

    @cached_property
    def _latest_documents(self) -> dict[str, SignedPermissions]:
        return {one.enclave: one for one in self.documents}

    def of_enclave(self, enclave: str) -> list[IssuedCertificate]:
        """Return every certificate of the enclave that is remembered, in the order of issue."""
        return self._by_enclave.get(enclave, [])

    def in_force(self, enclave: str) -> IssuedCertificate | None:
        """Return the certificate issued last, unless it was revoked or removed."""
        return next((one for one in reversed(self.of_enclave(enclave)) if one.in_force), None)

    def permissions(self, enclave: str) -> SignedPermissions | None:
        """Return the document signed last for the enclave."""
        return self._latest_documents.get(enclave)

    def trusts_authority(self, role: Role, ca: bytes) -> bool:
        """Return whether the CA with this certificate may stand in the trust file: known, and not retired."""
        return self.authorities.get((role, ca), AuthorityState.RETIRED) is not AuthorityState.RETIRED

    def trusted_authorities(self, role: Role) -> list[bytes]:
        """Return the certificates of a trust file, the one in use first."""
        known = {ca: state for (its, ca), state in self.authorities.items() if its is role}
        in_use = [ca for ca, state in known.items() if state is AuthorityState.IN_USE]
        return in_use + [ca for ca in known if self.trusts_authority(role, ca) and ca not in in_use]

    def revoked(self, issuer: str) -> dict[int, datetime]:
        """Map serial to date of revocation, of the certificates that this CA issued."""
        return {
            one.serial: one.revoked
            for one in self.certificates.values()
            if one.revoked is not None and one.issuer == issuer
        }

    def with_authority(self, role: Role, ca: bytes, state: AuthorityState) -> Register:
        """Put a new CA in use; the one that was is leaving."""
        known = dict(self.authorities)
        if state is AuthorityState.IN_USE:
            for (its, other), was in self.authorities.items():
                if its is role and was is AuthorityState.IN_USE:
                    known[its, other] = AuthorityState.LEAVING
        known[role, ca] = state
        return replace(self, authorities=known)

    def with_retired(self, roles: Iterable[Role]) -> Register:
        """Retire every CA that is leaving one of these roles: it is not trusted any more."""
        ended = set(roles)
        known = {
            (role, ca): AuthorityState.RETIRED if role in ended and state is AuthorityState.LEAVING else state
            for (role, ca), state in self.authorities.items()
        }
        return replace(self, authorities=known)

    def with_certificates(self, issued: Iterable[IssuedCertificate]) -> Register:
        """Add certificates; each takes the place of what its enclave had."""
        fresh = {one.serial: one for one in issued}
        before = self.without_enclaves(one.enclave for one in fresh.values()).certificates
        return replace(self, certificates={**before, **fresh})

    def with_documents(self, signed: Iterable[SignedPermissions]) -> Register:
        fresh = tuple(signed)
        kept = tuple(one for one in self.documents if one not in fresh)
        return replace(self, documents=(*kept, *fresh))

    def without_enclaves(self, enclaves: Iterable[str]) -> Register:
        """Remove enclaves: none of their certificates is in force, what they were granted stays known."""
        gone = set(enclaves)
        known = {
            serial: one._replace(replaced=True) if one.enclave in gone else one
            for serial, one in self.certificates.items()
        }
        return replace(self, certificates=known)

    def with_revoked(self, serials: Iterable[int], now: datetime) -> Register:
        """Revoke certificates; a CRL that lists them has to follow, so its number is counted up."""
        known = dict(self.certificates)
        for serial in serials:
            if serial in known and known[serial].revoked is None:
                known[serial] = known[serial]._replace(revoked=now)
        return replace(self, certificates=known).with_next_crl(now)

    def with_next_crl(self, now: datetime) -> Register:
        """Count the CRL's number up. It is the time if that is enough to let it grow."""
        number = max(int(now.timestamp()), self.crl_number + 1)
        return replace(self, crl_number=number, crl_published=True)

    def without_ended(self, now: datetime) -> Register:
        """Remove entries that have expired. The entries in force stay, so that each enclave remains known.

        What was revoked stays while its CA is trusted: neither a wrong clock nor a host may miss it on the CRL.
        """
        trusted = {
            hashlib.sha256(ca).hexdigest()
            for (role, ca) in self.authorities
            if self.trusts_authority(role, ca)
        }
        certificates = {
            serial: one
            for serial, one in self.certificates.items()
            if one.in_force or one.not_after > now or (one.revoked and one.issuer in trusted)
        }
        documents = tuple(
            one for one in self.documents if one.not_after > now or one is self.permissions(one.enclave)
        )
        return replace(self, certificates=certificates, documents=documents)


def register_json(register: Register) -> bytes:
    """Write one line for each entry, so that differences between two versions can be read."""
    head = {
        "version": _VERSION,
        "crl_number": register.crl_number,
        "crl_published": register.crl_published,
        "governance": register.governance.decode(),
        "settings": register.settings.decode(),
        "written": iso(register.written) if register.written is not None else None,
    }
    rows: dict[str, Iterable[list[Any]]] = {
        "authorities": (
            [role.value, state.value, base64.b64encode(ca).decode()]
            for (role, ca), state in register.authorities.items()
        ),
        "certificates": map(_certificate_row, register.certificates.values()),
        "documents": (
            [one.enclave, one.subject, one.document, one.rules, iso(one.not_after)]
            for one in register.documents
        ),
    }
    return lines_json(head, rows)


def lines_json(head: Mapping[str, Any], rows: Mapping[str, Iterable[list[Any]]]) -> bytes:
    """Write an object with ``head``, then lists of ``rows``; each entry and each row on a line of its own."""
    entries = [f"{json.dumps(name)}: {json.dumps(value)}" for name, value in head.items()]
    for name, listed in rows.items():
        entries.append(f"{json.dumps(name)}: [\n" + ",\n".join(map(json.dumps, listed)) + "\n]")
    return ("{\n" + ",\n".join(entries) + "\n}\n").encode()


def _certificate_row(one: IssuedCertificate) -> list[Any]:
    revoked = iso(one.revoked) if one.revoked is not None else None
    dates = (iso(one.not_before), iso(one.not_after))
    whose = [f"{one.serial:x}", one.enclave, one.subject, one.key, one.issuer]
    return [*whose, *dates, one.replaced, revoked, one.lifetime]


def parse_register(text: bytes, place: str) -> Register:
    """Parse what ``register_json`` writes; raises DamagedKeystoreError for anything else."""
    try:
        content: Any = json.loads(text)
        if content["version"] != _VERSION:
            raise DamagedKeystoreError(f"{place} was written by a newer version; update secure-keystore")
        return Register(
            dict(_authorities(content["authorities"])),
            {one.serial: one for one in map(_certificate, content["certificates"])},
            tuple(map(_document, content["documents"])),
            content["governance"].encode(),
            int(content["crl_number"]),
            bool(content["crl_published"]),
            _time(content["written"]) if content.get("written") is not None else None,
            content["settings"].encode(),
        )
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError, RecursionError):
        raise DamagedKeystoreError(
            f"{place} is not a register that secure-keystore wrote; restore it from a backup"
        ) from None


def _authorities(rows: list[Any]) -> Iterator[tuple[tuple[Role, bytes], AuthorityState]]:
    for role, state, ca in rows:
        yield (Role(role), base64.b64decode(ca, validate=True)), AuthorityState(state)


def _certificate(row: list[Any]) -> IssuedCertificate:
    serial, enclave, subject, key, issuer, not_before, not_after, replaced, revoked, lifetime = row
    return IssuedCertificate(
        int(serial, 16),
        validate_enclave_name(enclave) if enclave != UNKNOWN else UNKNOWN,
        str(subject),
        str(key),
        str(issuer),
        _time(not_before),
        _time(not_after),
        bool(replaced),
        _time(revoked) if revoked is not None else None,
        int(lifetime) if lifetime is not None else None,
    )


def _document(row: list[Any]) -> SignedPermissions:
    enclave, subject, document, rules, not_after = row
    return SignedPermissions(
        validate_enclave_name(enclave), str(subject), str(document), str(rules), _time(not_after)
    )
