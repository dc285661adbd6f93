"""The manifest of a bundle for one host, signed by the permissions CA.

    bundle.p7s      the manifest, as S/MIME like governance and permissions
    public/...      trust anchors and CRL          enclaves/...    governance and each enclave's files

The manifest names every file with its SHA-256, so that nothing can be added, left out or exchanged; the host, so that
another host's bundle is refused; a number that only grows, so that an earlier bundle is; the fingerprints of the
CAs; and of each enclave what the register of the CA holds: serial, hash of the key, hash of the permissions, dates.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Any, NamedTuple

from enclave_common.terminal import quoted
from keystore.errors import DamagedKeystoreError, InvalidInputError, KeystoreError
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.register import lines_json
from keystore.formats.role import Role
from keystore.formats.validity import iso, parse_time

_HOST = re.compile(r"[A-Za-z0-9](?:[A-Za-z0-9._-]{0,61}[A-Za-z0-9])?\Z")
TYPE = "enclave-launch bundle"
_VERSION = 1


def refuse_host_name(name: str, where: str) -> None:
    """Raise InvalidInputError if ``name`` cannot name a file, a Compose service and a Kubernetes node."""
    if not _HOST.match(name):
        raise InvalidInputError(
            f"{where}: {quoted(name)} is not a host name: 1 to 63 of letters, digits, '.', '_' and '-', "
            "a letter or digit first and last"
        )


class BundledEnclave(NamedTuple):
    """An enclave in a manifest.

    Attributes:
        key: SHA-256 of the public key, as in the register.
        document: SHA-256 of the signed permissions, as in the register.
        has_key: True if the private key is in the bundle; otherwise it was made on the host and never left it.
    """

    enclave: str
    serial: int
    key: str
    document: str
    not_before: datetime
    not_after: datetime
    has_key: bool


class Manifest(NamedTuple):
    """The signed contents of a bundle.

    Attributes:
        authorities: SHA-256 of each trusted CA certificate, the one in use first.
        files: Path -> SHA-256.
        ends: When the first of its contents expires.
    """

    host: str
    number: int
    authorities: Mapping[Role, tuple[str, ...]]
    crl_number: int
    enclaves: tuple[BundledEnclave, ...]
    files: Mapping[str, str]
    ends: datetime

    def same_content(self, other: Manifest) -> bool:
        """Return True if both are the same apart from their numbers."""
        return self == other._replace(number=self.number)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the enclaves."""
        return tuple(one.enclave for one in self.enclaves)


def manifest_json(manifest: Manifest) -> bytes:
    """Return the manifest as JSON, one line for each enclave and file, so that a diff can be read."""
    head = {
        "type": TYPE,
        "version": _VERSION,
        "host": manifest.host,
        "number": manifest.number,
        "authorities": {role.value: list(manifest.authorities[role]) for role in Role},
        "crl_number": manifest.crl_number,
        "ends": iso(manifest.ends),
    }
    files = ([name, digest] for name, digest in sorted(manifest.files.items()))
    return lines_json(head, {"enclaves": map(_row, manifest.enclaves), "files": files})


def _row(one: BundledEnclave) -> list[Any]:
    dates = (iso(one.not_before), iso(one.not_after))
    return [one.enclave, f"{one.serial:x}", one.key, one.document, *dates, one.has_key]


def parse_manifest(text: bytes, place: str) -> Manifest:
    """Read what ``manifest_json`` writes. Raises DamagedKeystoreError for anything else."""
    try:
        content: Any = json.loads(text)
        if content["type"] != TYPE or content["version"] != _VERSION:
            raise DamagedKeystoreError(f"{place}: not a bundle of this version; update secure-keystore")
        refuse_host_name(content["host"], place)
        return Manifest(
            str(content["host"]),
            int(content["number"]),
            {role: tuple(map(str, content["authorities"][role.value])) for role in Role},
            int(content["crl_number"]),
            tuple(map(_enclave, content["enclaves"])),
            {str(name): str(digest) for name, digest in content["files"]},
            parse_time(content["ends"]),
        )
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError) as error:
        if isinstance(error, KeystoreError):
            raise
        raise DamagedKeystoreError(f"{place} is not the manifest of a bundle") from None


_ROLES = {role.use: role for role in Role}


def pin(role: Role, digest: str) -> str:
    """Return which CA may do what: ``identity=SHA256`` or ``permissions=SHA256``."""
    return f"{role.use}={digest}"


def pins_of(named: Iterable[str]) -> dict[Role, frozenset[str]]:
    """Read what ``pin`` writes, and fingerprints with colons and capitals as openssl prints them.

    Raises:
        InvalidInputError: A fingerprint has no role, or a role no CA.
    """
    found: dict[Role, set[str]] = {role: set() for role in Role}
    for one in named:
        role, _, digest = one.partition("=")
        if role not in _ROLES or not digest:
            raise InvalidInputError(
                f"--require-ca {quoted(one)}: say what that CA may do, identity=SHA256 or permissions=SHA256, as "
                "secure-keystore export prints it"
            )
        plain = digest.replace(":", "").lower()
        if re.fullmatch("[0-9a-f]{64}", plain) is None:
            raise InvalidInputError(
                f"--require-ca {quoted(one)}: {len(plain)} characters, and a SHA-256 fingerprint has 64 hex digits\n"
                "try: secure-keystore export again where the CA is; its last line has the options to copy"
            )
        found[_ROLES[role]].add(plain)
    if missing := [role.use for role in Role if not found[role]]:
        raise InvalidInputError(f"no CA is named for {missing[0]}: --require-ca {missing[0]}=SHA256")
    return {role: frozenset(listed) for role, listed in found.items()}


def _enclave(row: list[Any]) -> BundledEnclave:
    name, serial, key, document, not_before, not_after, has_key = row
    dates = (parse_time(not_before), parse_time(not_after))
    return BundledEnclave(
        validate_enclave_name(name), int(serial, 16), str(key), str(document), *dates, bool(has_key)
    )


_HANDOVER = "enclave-launch handover"


def handover_json(authorities: Mapping[Role, tuple[str, ...]]) -> bytes:
    """Return what a permissions CA signs before it is replaced, for each later bundle: the CAs to trust then, by the
    SHA-256 of their certificates."""
    named = {role.value: list(authorities[role]) for role in Role}
    return (
        json.dumps({"type": _HANDOVER, "version": 1, "authorities": named}, indent=1, sort_keys=True).encode()
        + b"\n"
    )


def parse_handover(text: bytes, place: str) -> dict[Role, frozenset[str]]:
    """Return the CAs that a handover names, by role. Raises DamagedKeystoreError."""
    try:
        content: Any = json.loads(text)
        if content["type"] == _HANDOVER and content["version"] == 1:
            return {role: frozenset(map(str, content["authorities"][role.value])) for role in Role}
    except (ValueError, KeyError, TypeError, RecursionError):
        pass
    raise DamagedKeystoreError(f"{place} does not name the CAs that follow")
