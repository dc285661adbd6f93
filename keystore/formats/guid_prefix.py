"""Where the participants of an enclave sort among others: the first bytes of their GUIDs. Pure.

DDS-Security 9.3.3 makes them from a hash of the certificate's subject, so they are known before anything runs
(measured on both implementations). Of two participants the one with the smaller GUID begins the handshake.
"""

from __future__ import annotations

from enum import Enum


class Half(Enum):
    """Of all prefixes. One subject in two lies in each."""

    LOW = "low"
    HIGH = "high"


def guid_prefix(common_name: str) -> int:
    """The first 48 bits of the GUID of every secured participant whose certificate has this subject."""
    import hashlib  # loads libcrypto; few launches need it

    digest = hashlib.sha256(_subject(common_name)).digest()
    return (int.from_bytes(digest[:6], "big") >> 1) | 1 << 47


def half_of(common_name: str) -> Half:
    """In which half the GUID prefix lies that a participant with this certificate must have."""
    return Half.HIGH if guid_prefix(common_name) & 1 << 46 else Half.LOW


def _subject(common_name: str) -> bytes:
    """DER of a name with this common name alone, as certificates of a keystore have it (UTF8String)."""
    text = common_name.encode()
    attribute = b"\x06\x03\x55\x04\x03" + _tagged(0x0C, text)
    return _tagged(0x30, _tagged(0x31, _tagged(0x30, attribute)))


def _tagged(tag: int, content: bytes) -> bytes:
    """At most 64 characters: lengths stay below 512."""
    size = len(content)
    length = (
        bytes([size])
        if size < 128
        else bytes([0x81, size])
        if size < 256
        else b"\x82" + size.to_bytes(2, "big")
    )
    return bytes([tag]) + length + content
