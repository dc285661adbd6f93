"""What a file holds besides what belongs there: further PEM blocks, and private keys in whatever encoding."""

from __future__ import annotations

import binascii
import re
from collections.abc import Iterator
from pathlib import Path

from enclave_launch.boundary.files import read_bytes
from keystore.disk import layout
from keystore.formats.role import Role
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity

_MAX_BYTES = 64_000_000
_BEGIN = re.compile(rb"-----BEGIN ([A-Z0-9 ]+)-----")
_BASE64_RUN = re.compile(rb"[A-Za-z0-9+/=\r\n]{80,}")
_DER_KEYS = (
    b"\x02\x01\x00\x30\x13\x06\x07\x2a\x86\x48\xce\x3d\x02\x01",  # PKCS#8 (RFC 5958), elliptic curve
    b"\x02\x01\x00\x30\x0d\x06\x09\x2a\x86\x48\x86\xf7\x0d\x01\x01\x01",  # PKCS#8, RSA
    b"\x02\x01\x00\x30\x05\x06\x03\x2b\x65",  # PKCS#8, Edwards curves (RFC 8410)
    b"\x02\x01\x01\x04\x20",  # SEC 1 ECPrivateKey of 256 bits (RFC 5915)
    b"\x02\x01\x00\x02\x82",  # PKCS#1 RSAPrivateKey (RFC 8017)
    b"\x06\x09\x2a\x86\x48\x86\xf7\x0d\x01\x05\x0d",  # PBES2: encrypted PKCS#8, PKCS#12
    b"\x06\x0b\x2a\x86\x48\x86\xf7\x0d\x01\x0c\x0a\x01",  # PKCS#12 key bags (RFC 7292)
)

_CERTIFICATE, _CRL, _KEY = b"CERTIFICATE", b"X509 CRL", b"PRIVATE KEY"
_ONE_BLOCK = {layout.CERT: _CERTIFICATE, layout.ENCLAVE_CRL: _CRL, layout.KEY: _KEY}
_TRUST_ANCHORS = frozenset(f"{role.value}.cert.pem" for role in Role) | {"ca.cert.pem"}


def holds_private_key(data: bytes) -> bool:
    """In PEM, in DER, or in base64 without the lines around it; alone or behind other content."""
    if _KEY in data or any(sign in data for sign in _DER_KEYS):
        return True
    return any(sign in decoded for decoded in _decoded(data) for sign in _DER_KEYS)


def check_content(root: Path, relative: str) -> Iterator[Finding]:
    """One file that belongs to the keystore: nothing in it but what its name says."""
    try:
        data = read_bytes(root / relative, _MAX_BYTES)
    except OSError:
        return  # what cannot be read is reported by who needs it
    name = relative.rpartition("/")[2]
    is_key = name.endswith(".key.pem") or name == layout.KEY
    if not is_key and holds_private_key(data):
        yield Finding(
            Severity.ERROR, "private-key", relative,
            "holds a private key, which goes wherever this file goes; the key counts as exposed",
            _new_key(root, relative),
        )  # fmt: skip
    yield from _check_blocks(root, relative, _KEY if is_key else _ONE_BLOCK.get(name), data)


def mime_problem(p7s: bytes) -> str | None:
    """Why OpenSSL, and so both DDS implementations, would not find the two parts of a signed document."""
    import email

    message = email.message_from_bytes(p7s)
    if message.get_content_type() != "multipart/signed" or not message.is_multipart():
        return "its first line does not say multipart/signed"
    parts = [part.get_content_type() for part in message.walk()][1:]
    if len(parts) != 2 or parts[1] not in _SIGNATURE_TYPES:
        return "it has not two parts, a text and its signature"
    return None


_SIGNATURE_TYPES = ("application/x-pkcs7-signature", "application/pkcs7-signature")


def _check_blocks(root: Path, relative: str, wanted: bytes | None, data: bytes) -> Iterator[Finding]:
    labels = [label for label in _BEGIN.findall(data) if label != b"EC PARAMETERS"]
    if wanted is None:
        wanted = _CERTIFICATE if relative.rpartition("/")[2] in _TRUST_ANCHORS else None
        strange = [label for label in labels if wanted is not None and label != wanted]
        several = False
    else:
        strange = [label for label in labels if not label.endswith(wanted)]
        several = len(labels) > 1
    if strange or several:
        found = ", ".join(label.decode().lower() for label in labels)
        yield Finding(
            Severity.ERROR, "several-blocks", relative,
            f"holds {found}; one {(wanted or b'').decode().lower()} belongs there, and implementations differ in "
            "which block they read",
            _new_key(root, relative),
        )  # fmt: skip


def _decoded(data: bytes) -> Iterator[bytes]:
    for run in _BASE64_RUN.findall(data):
        compact = run.translate(None, b"\r\n=")
        try:
            yield binascii.a2b_base64(compact[: len(compact) // 4 * 4])
        except binascii.Error:
            continue


def _new_key(root: Path, relative: str) -> str:
    if not relative.startswith(layout.ENCLAVES + "/"):
        return repair.BACKUP
    enclave = relative.removeprefix(layout.ENCLAVES).rpartition("/")[0] or "/"
    return repair.run(root, "renew", enclave, "--new-keys", "--revoke-old")
