"""The little DER that certificates and S/MIME need, read and written in plain Python. Pure.

Why not a library: comparing a keystore before a launch must look into certificates without importing ``cryptography``,
and its PKCS#7 writer cannot sign with a key that lives in a token. Only definite lengths and single-byte tags
are accepted, which is all X.509 and CMS use (ITU-T X.690 section 10).
"""

from __future__ import annotations

import binascii
from datetime import datetime, timezone
from typing import NamedTuple

SEQUENCE, SET = 0x30, 0x31
INTEGER, OCTET_STRING, NULL, OID, UTF8_STRING = 0x02, 0x04, 0x05, 0x06, 0x0C
UTC_TIME, GENERALIZED_TIME = 0x17, 0x18
BOOLEAN = 0x01


class DerError(ValueError):
    """The bytes are not the DER they should be; callers translate it to an error with a place."""


class Element(NamedTuple):
    """One value inside ``data``: its tag, where it starts, where its content starts and ends."""

    data: bytes
    tag: int
    start: int
    body: int
    end: int

    @property
    def content(self) -> bytes:
        return self.data[self.body : self.end]

    @property
    def whole(self) -> bytes:
        return self.data[self.start : self.end]

    def children(self) -> list[Element]:
        return _elements(self.data, self.body, self.end)

    def expect(self, tag: int) -> Element:
        if self.tag != tag:
            raise DerError(f"expected tag {tag:#04x}, found {self.tag:#04x}")
        return self


def parse(data: bytes) -> Element:
    """The single value that ``data`` consists of; raises DerError."""
    found = _elements(data, 0, len(data))
    if len(found) != 1:
        raise DerError("expected one value")
    return found[0]


def _elements(data: bytes, at: int, limit: int) -> list[Element]:
    """One flat loop: certificates are read by the hundred before a launch."""
    found = []
    while at < limit:
        if at + 2 > limit:
            raise DerError("cut short")
        length, body = data[at + 1], at + 2
        if length >= 0x80:
            width = length & 0x7F
            body += width
            if not 1 <= width <= 4 or body > limit:
                raise DerError("unsupported length")
            length = int.from_bytes(data[at + 2 : body], "big")
        end = body + length
        if end > limit:
            raise DerError("cut short")
        found.append(Element(data, data[at], at, body, end))
        at = end
    return found


def encode(tag: int, *parts: bytes) -> bytes:
    """One element: ``tag``, the length in its shortest form, and the joined ``parts``."""
    content = b"".join(parts)
    size = len(content)
    if size < 0x80:
        return bytes((tag, size)) + content
    width = (size.bit_length() + 7) // 8
    return bytes((tag, 0x80 | width)) + size.to_bytes(width, "big") + content


def integer(value: int) -> bytes:
    """A non-negative INTEGER."""
    return encode(INTEGER, value.to_bytes(value.bit_length() // 8 + 1, "big"))


def object_identifier(dotted: str) -> bytes:
    """The element for an OID such as ``2.5.4.3``."""
    first, second, *rest = (int(part) for part in dotted.split("."))
    return encode(OID, b"".join(_base128(arc) for arc in (40 * first + second, *rest)))


def _base128(arc: int) -> bytes:
    groups = [arc & 0x7F]
    while arc := arc >> 7:
        groups.append(0x80 | arc & 0x7F)
    return bytes(reversed(groups))


def time_value(element: Element) -> datetime:
    """UTCTime or GeneralizedTime in the Zulu form that RFC 5280 section 4.1.2.5 demands."""
    text = element.content.decode("ascii", "replace")
    if element.tag == UTC_TIME:
        text = ("19" if text[:2] >= "50" else "20") + text
    elif element.tag != GENERALIZED_TIME:
        raise DerError("not a time")
    if len(text) != 15 or text[14] != "Z" or not text[:14].isdigit():
        raise DerError("a time that is not in UTC")
    year, month, day = int(text[:4]), int(text[4:6]), int(text[6:8])
    try:
        return datetime(
            year, month, day, int(text[8:10]), int(text[10:12]), int(text[12:14]), tzinfo=timezone.utc
        )
    except ValueError as error:
        raise DerError("an impossible time") from error


def utc_time(moment: datetime) -> bytes:
    """Until 2049 UTCTime, afterwards GeneralizedTime (RFC 5652 section 11.3)."""
    if moment.year < 2050:
        return encode(UTC_TIME, moment.strftime("%y%m%d%H%M%SZ").encode())
    return encode(GENERALIZED_TIME, moment.strftime("%Y%m%d%H%M%SZ").encode())


_BASE64 = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=\r\n"


def from_base64(body: bytes) -> bytes:
    """The content of a PEM block or S/MIME part; raises DerError for what OpenSSL refuses and Python skips."""
    try:
        if not body.translate(None, _BASE64):
            return binascii.a2b_base64(body)
    except binascii.Error:
        pass
    raise DerError("not base64")
