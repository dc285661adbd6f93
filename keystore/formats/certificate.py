"""What the keystore wants to know about a certificate, read without ``cryptography``. Pure.

Nothing here proves anything: signatures are checked by ``keystore.verify``. These facts serve status, the
comparison before a launch, and finding out which subject an enclave already has.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from keystore.errors import DamagedKeystoreError
from keystore.formats import der
from keystore.formats.validity import Validity

_COMMON_NAME = der.object_identifier("2.5.4.3")
_SUBJECT_KEY_ID = der.object_identifier("2.5.29.14")
_AUTHORITY_KEY_ID = der.object_identifier("2.5.29.35")
_EXTENDED_KEY_USAGE = der.object_identifier("2.5.29.37")
_SUBJECT_ALT_NAME = der.object_identifier("2.5.29.17")
_KEY_USAGE = der.object_identifier("2.5.29.15")
_EMAIL_PROTECTION = der.object_identifier("1.3.6.1.5.5.7.3.4")
_ANY_USAGE = der.object_identifier("2.5.29.37.0")
_EXTENSIONS = 0xA3
_BEGIN, _END = b"-----BEGIN CERTIFICATE-----", b"-----END CERTIFICATE-----"


class CertificateFacts(NamedTuple):
    """``issuer``, ``subject`` and ``public_key`` are DER. Extensions are read when asked for: most questions
    before a launch do not concern them."""

    der: bytes
    serial: int
    issuer: bytes
    subject: bytes
    common_name: str | None
    name_parts: int
    validity: Validity
    public_key: bytes
    extensions: bytes
    """DER of the Extensions sequence, empty without any."""

    def __repr__(self) -> str:
        return f"CertificateFacts({self.common_name!r}, serial={self.serial})"

    @property
    def subject_key_id(self) -> bytes | None:
        return _subject_key_id(self.extensions)

    @property
    def authority_key_id(self) -> bytes | None:
        """The keyIdentifier [0] of AuthorityKeyIdentifier."""
        try:
            parts = der.parse(_by_oid(self.extensions)[_AUTHORITY_KEY_ID]).children()
        except (KeyError, der.DerError):
            return None
        return next((part.content for part in parts if part.tag == 0x80), None)

    @property
    def can_sign_mail(self) -> bool:
        """Whether OpenSSL's S/MIME purpose accepts it: then, below a shared CA, its key can sign permissions."""
        try:
            return _can_sign_mail(_by_oid(self.extensions))
        except der.DerError:
            return True

    @property
    def names_hosts(self) -> bool:
        """Whether it has alternative names: a TLS client accepts its holder as a server of these hosts."""
        try:
            return _SUBJECT_ALT_NAME in _by_oid(self.extensions)
        except der.DerError:
            return True

    def names_issuer(self, ca: CertificateFacts) -> bool:
        """Whether this certificate says that ``ca`` issued it (names and, where present, key identifiers)."""
        if self.issuer != ca.subject:
            return False
        if ca.subject_key_id is None or ca.subject_key_id in self.extensions:
            return True  # the quick look: 160 bits do not occur by accident
        return self.authority_key_id in (None, ca.subject_key_id)


def pem_blocks(pem: bytes) -> list[bytes]:
    """DER of each certificate in a PEM file; text around the blocks is skipped. Raises DerError."""
    found = []
    for part in pem.split(_BEGIN)[1:]:
        body, end, _ = part.partition(_END)
        if not end:
            raise der.DerError("a PEM block without its end line")
        try:
            found.append(der.from_base64(body))
        except der.DerError as error:
            raise der.DerError("a PEM block that is not base64") from error
    return found


def read_pem(pem: bytes) -> CertificateFacts:
    """Facts of the first certificate of a PEM file, as Cyclone DDS reads it. Raises DerError."""
    blocks = pem_blocks(pem)
    if not blocks:
        raise der.DerError("no PEM certificate in it")
    return read_der(blocks[0])


def read_der(data: bytes) -> CertificateFacts:
    """Raises DerError when ``data`` is not an X.509 v3 certificate."""
    try:
        return _read(data)
    except (IndexError, ValueError) as error:
        raise error if isinstance(error, der.DerError) else der.DerError(str(error)) from error


def read_certificate(pem: bytes, place: str) -> CertificateFacts:
    """The first certificate of a PEM file; raises DamagedKeystoreError naming ``place``."""
    try:
        return read_pem(pem)
    except der.DerError as error:
        raise DamagedKeystoreError(f"{place} is not a usable certificate: {error}") from None


def read_certificates(pem: bytes, place: str) -> list[CertificateFacts]:
    """Every certificate of a PEM file (a trust bundle during a CA roll-over)."""
    try:
        return [read_der(block) for block in pem_blocks(pem)]
    except der.DerError as error:
        raise DamagedKeystoreError(f"{place} is not a usable certificate: {error}") from None


def _read(data: bytes) -> CertificateFacts:
    fields = der.parse(data).expect(der.SEQUENCE).children()[0].children()
    _, serial, _, issuer, validity, subject, public_key, *rest = fields
    names = [part for group in subject.children() for part in group.children()]
    holder = next((part for part in rest if part.tag == _EXTENSIONS), None)
    return CertificateFacts(
        der=data,
        serial=int.from_bytes(serial.content, "big"),
        issuer=issuer.whole,
        subject=subject.whole,
        common_name=_common_name(names),
        name_parts=len(names),
        validity=_validity(validity.whole),
        public_key=public_key.whole,
        extensions=holder.content if holder is not None else b"",
    )


@lru_cache(maxsize=64)  # enclaves that were made together have the same
def _validity(sequence: bytes) -> Validity:
    not_before, not_after = der.parse(sequence).children()
    return Validity(der.time_value(not_before), der.time_value(not_after))


@lru_cache(maxsize=8)  # the CAs', which are compared with those of every enclave
def _subject_key_id(extensions: bytes) -> bytes | None:
    try:
        return der.parse(_by_oid(extensions)[_SUBJECT_KEY_ID]).content
    except (KeyError, der.DerError):
        return None


def _by_oid(extensions: bytes) -> dict[bytes, bytes]:
    """OID -> content of the extension's OCTET STRING. Unreadable extensions count as absent: the cautious reading, a
    certificate that may do anything."""
    try:
        entries = [entry.children() for entry in der.parse(extensions).children()] if extensions else []
        return {entry[0].whole: entry[-1].expect(der.OCTET_STRING).content for entry in entries if entry}
    except der.DerError:
        return {}


def _common_name(names: list[der.Element]) -> str | None:
    values = [name.children() for name in names]
    found = [value.content.decode("utf-8", "replace") for oid, value in values if oid.whole == _COMMON_NAME]
    return found[0] if len(found) == 1 else None


def _can_sign_mail(extensions: dict[bytes, bytes]) -> bool:
    """OpenSSL's S/MIME signing purpose: EKU absent or emailProtection, KU absent or a signature bit."""
    usages = extensions.get(_EXTENDED_KEY_USAGE)
    if usages is not None:
        allowed = {usage.whole for usage in der.parse(usages).children()}
        if not allowed & {_EMAIL_PROTECTION, _ANY_USAGE}:
            return False
    bits = extensions.get(_KEY_USAGE)
    # After the count of unused bits: digitalSignature and nonRepudiation are the two highest of the first byte.
    return bits is None or bool(der.parse(bits).content[1:2] >= b"\x40")
