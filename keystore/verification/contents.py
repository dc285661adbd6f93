"""What a file holds besides what belongs there: further PEM blocks, and private keys in whatever encoding."""

from __future__ import annotations

import binascii
import re
from collections.abc import Iterator
from pathlib import Path

from enclave_common.files import read_bytes
from keystore.disk import layout
from keystore.disk.crl_file import is_crl
from keystore.errors import DamagedKeystoreError
from keystore.formats.certificate import read_certificate, read_certificates
from keystore.formats.role import Role
from keystore.signing import smime
from keystore.signing.public_key import is_our_form
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity

_MAX_BYTES = 64_000_000
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

_KEY = b"PRIVATE KEY"
_ONE_BLOCK = frozenset({layout.CERT, layout.ENCLAVE_CRL})
_TRUST_ANCHORS = frozenset(f"{role.value}.cert.pem" for role in Role) | {"ca.cert.pem"}


def holds_private_key(data: bytes) -> bool:
    """Return whether there is a key in PEM, in DER, or in base64 without its frame; alone or behind other content."""
    if _KEY in data or any(sign in data for sign in _DER_KEYS):
        return True
    return any(sign in decoded for decoded in _decoded(data) for sign in _DER_KEYS)


def check_content(root: Path, relative: str) -> Iterator[Finding]:
    """Finds what a file of the keystore holds beside what its name says; DDS implementations may read that instead."""
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
    blocks = data.count(b"-----BEGIN ")
    several = blocks > 1 and (is_key or name in _ONE_BLOCK)
    if several or not _is_our_form(name, data):
        fix = _new_key(root, relative) if is_key or several else _written_again(root, relative)
        message = f"holds {blocks} PEM blocks" if several else "is not as secure-keystore writes it"
        yield Finding(
            Severity.ERROR, "several-blocks" if blocks > 1 else "other-form", relative,
            f"{message}: DDS implementations may read something else in it than was signed", fix,
        )  # fmt: skip


def _is_our_form(name: str, data: bytes) -> bool:
    try:
        if name == layout.KEY:
            return is_our_form(data)
        if name == layout.CERT:
            read_certificate(data)
        elif name in _TRUST_ANCHORS:
            read_certificates(data, name)
        elif name == layout.ENCLAVE_CRL:
            return is_crl(data)
        elif name.endswith(".p7s"):
            smime.read(data, name)
    except DamagedKeystoreError:
        return False
    return True


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


def _written_again(root: Path, relative: str) -> str:
    if not relative.startswith(layout.ENCLAVES + "/") or relative == layout.GOVERNANCE:
        return repair.run(root, "renew", note="writes it again")
    enclave = relative.removeprefix(layout.ENCLAVES).rpartition("/")[0] or "/"
    return repair.run(root, "renew", enclave)
