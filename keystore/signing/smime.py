"""Documents signed as DDS-Security wants them (S/MIME, section 9.4.1.1 of the specification), and read back.

    document (XML bytes) + CA -> .p7s        .p7s -> SignedDocument -> checked against the permissions CA

The signature is made by ``cryptography`` and read by ``asn1crypto``. The frame around document and signature is one
fixed text: a file is read by framing again what was found in it and comparing bytes, so that OpenSSL, and with it the
DDS implementations, cannot find another document in the same file.

What is signed are the bytes ``Content-Type: text/plain`` CRLF CRLF + document with CRLF line ends.
"""

from __future__ import annotations

import base64
import binascii
import email
import hashlib
import re
from functools import lru_cache
from typing import Any, NamedTuple

from asn1crypto import cms
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.serialization import Encoding, pkcs7

from keystore.errors import DamagedKeystoreError, InvalidInputError, OtherFormError
from keystore.formats.certificate import NOT_OUR_FORM, CertificateFacts
from keystore.signing.authority import Authority
from keystore.signing.public_key import signature_is_valid
from keystore.signing.token_key import builder_key

_TEXT_HEADER = b"Content-Type: text/plain\r\n\r\n"
_FRAME = (
    b"MIME-Version: 1.0\r\n"
    b'Content-Type: multipart/signed; protocol="application/x-pkcs7-signature"; micalg="sha-256"; '
    b'boundary="%(boundary)b"\r\n\r\n'
    b"This is an S/MIME signed message\r\n\r\n"
    b"--%(boundary)b\r\n%(content)b\r\n"
    b"--%(boundary)b\r\n"
    b'Content-Type: application/x-pkcs7-signature; name="smime.p7s"\r\n'
    b"Content-Transfer-Encoding: base64\r\n"
    b'Content-Disposition: attachment; filename="smime.p7s"\r\n\r\n'
    b"%(signature)b\r\n\r\n"
    b"--%(boundary)b--\r\n"
)
_BOUNDARY = re.compile(rb'boundary="(-{4}[0-9A-F]{32})"\r\n')
_OPTIONS = (
    pkcs7.PKCS7Options.DetachedSignature,
    pkcs7.PKCS7Options.Binary,
    pkcs7.PKCS7Options.NoCapabilities,
)
_ASN1_ERRORS = (
    ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError, RecursionError,
)  # fmt: skip
"""Exceptions of ``asn1crypto`` for damaged messages."""
_ATTRIBUTES = frozenset({"content_type", "message_digest", "signing_time"})
_SIGNATURES = frozenset({"sha256_ecdsa", "sha256_rsa", "rsassa_pkcs1v15"})


def sign_document(document: bytes, ca: Authority) -> bytes:
    """Returns the ``.p7s`` file of ``document``, signed by ``ca``.

    Raises InvalidInputError when the document holds a bare CR or a NUL, which verifiers read differently.
    """
    content = _content(document)
    builder = pkcs7.PKCS7SignatureBuilder().set_data(content)
    builder = builder.add_signer(ca.facts.certificate, builder_key(ca.key), hashes.SHA256())
    return _framed(content, builder.sign(Encoding.DER, list(_OPTIONS)))


def _content(document: bytes) -> bytes:
    lines = document.replace(b"\r\n", b"\n")
    if b"\r" in lines or b"\0" in lines:
        raise InvalidInputError("a document to be signed must not contain a bare carriage return or a NUL")
    return _TEXT_HEADER + lines.replace(b"\n", b"\r\n")


def _framed(content: bytes, signature: bytes) -> bytes:
    # The digest makes the boundary one that cannot occur in the content, and the same content the same frame.
    boundary = b"----" + hashlib.sha256(b"boundary" + content).hexdigest()[:32].upper().encode()
    encoded = base64.b64encode(signature)
    lines = b"\r\n".join(encoded[at : at + 64] for at in range(0, len(encoded), 64))
    return _FRAME % {b"boundary": boundary, b"content": content, b"signature": lines}


class SignedDocument(NamedTuple):
    """A ``.p7s`` taken apart; ``check`` returns who signed it. ``document`` has LF line ends, ``pkcs7`` is DER."""

    document: bytes
    pkcs7: bytes

    def embeds(self, certificate: bytes) -> bool:
        """Returns whether exactly this certificate (DER) is carried along: a sign of who signed, no proof."""
        try:
            return _signature(self.pkcs7).certificates == (certificate,)
        except ValueError:
            return False


def read(p7s: bytes, place: str) -> SignedDocument:
    """Takes a file apart that is in the form ``sign_document`` writes; raises OtherFormError for any other."""
    found = _read(p7s)
    if found is None:
        raise OtherFormError(f"{place} is not a signed document as it should be: {NOT_OUR_FORM}")
    return found


@lru_cache(maxsize=1024)  # a launch asks for the same files before each of its processes
def _read(p7s: bytes) -> SignedDocument | None:
    boundary = _BOUNDARY.search(p7s)
    parts = p7s.split(b"--" + boundary[1]) if boundary is not None else []
    if len(parts) != 4:
        return None
    try:
        document = parts[1].removeprefix(b"\r\n" + _TEXT_HEADER).removesuffix(b"\r\n").replace(b"\r\n", b"\n")
        signature = base64.b64decode(parts[2].partition(b"\r\n\r\n")[2])
        if _framed(_content(document), signature) != p7s or not _is_der(signature):
            return None
    except (ValueError, binascii.Error):
        return None
    return SignedDocument(document, signature)


def _is_der(signature: bytes) -> bool:
    """Returns whether the message is in the one encoding of DER, with only what ``sign_document`` puts into it."""
    try:
        encoded = cms.ContentInfo.load(signature, strict=True).dump(force=True)
    except _ASN1_ERRORS:
        return False
    return bool(encoded == signature) and _signature(signature).attributes == _ATTRIBUTES


def read_foreign(p7s: bytes, place: str) -> SignedDocument:
    """Takes a file of SROS2 or ``openssl smime`` apart, which frame documents in other ways.

    Only for what is checked and then signed again: DDS implementations may read another document in the same file.
    Raises DamagedKeystoreError for what is not a detached S/MIME message with a text.
    """
    message = email.message_from_bytes(p7s)
    boundary = message.get_boundary() or ""
    parts = (
        p7s.replace(b"\r\n", b"\n").split(b"\n--" + boundary.encode("latin-1", "replace")) if boundary else []
    )
    if message.get_content_type() != "multipart/signed" or len(parts) != 4 or not parts[1].startswith(b"\n"):
        raise DamagedKeystoreError(f"{place} is not a detached S/MIME message (multipart/signed)")
    header, text = _TEXT_HEADER.replace(b"\r\n", b"\n"), parts[1][1:]
    if not text.startswith(header):
        raise DamagedKeystoreError(
            f"{place}: the signed part is not text/plain, DDS implementations refuse it"
        )
    try:
        signature = base64.b64decode(parts[2].partition(b"\n\n")[2].replace(b"\n", b""), validate=True)
    except binascii.Error:
        raise DamagedKeystoreError(f"{place}: its signature is not base64") from None
    return SignedDocument(text.removeprefix(header), signature)


def read_any(p7s: bytes, place: str) -> SignedDocument:
    """Read as ``read``, and otherwise as ``read_foreign``."""
    return _read(p7s) or read_foreign(p7s, place)


def check(signed: SignedDocument, authorities: list[CertificateFacts], place: str) -> CertificateFacts:
    """Returns the authority whose key signed ``signed``; raises DamagedKeystoreError saying what is wrong.

    Strict as the fixed releases are (Cyclone DDS 11, Fast DDS 2.6.5): the signer must *be* one of
    ``authorities``. Certificates carried in the message are not trusted, and no chain is built.
    """
    try:
        found = _signature(signed.pkcs7)
    except ValueError as error:
        raise DamagedKeystoreError(
            f"{place}: its signature is not PKCS#7 SignedData with one signer ({error})"
        ) from None
    for authority in authorities:
        if (found.issuer, found.serial) == (authority.issuer, authority.serial):
            _check_signature(found, signed, authority, place)
            return authority
    raise DamagedKeystoreError(f"{place}: signed by someone who is not the permissions CA of this keystore")


def _check_signature(
    found: _Signature, signed: SignedDocument, authority: CertificateFacts, place: str
) -> None:
    content = _TEXT_HEADER + signed.document.replace(b"\n", b"\r\n")
    if found.digest != hashlib.sha256(content).digest():
        raise DamagedKeystoreError(f"{place}: its content was changed after signing")
    if not signature_is_valid(
        authority.certificate.public_key(), found.signature, found.signed, hashes.SHA256()
    ):
        raise DamagedKeystoreError(f"{place}: its signature is not by the permissions CA of this keystore")


class _Signature(NamedTuple):
    """The one signature of a message. ``signed``: the attributes as they are signed; ``digest``: of the content."""

    issuer: bytes
    serial: int
    attributes: frozenset[str]
    signed: bytes
    digest: bytes
    signature: bytes
    certificates: tuple[bytes, ...]


@lru_cache(maxsize=1024)
def _signature(pkcs7_der: bytes) -> _Signature:
    """Reads SignedData of RFC 5652: detached, one signer, SHA-256. Raises ValueError for anything else."""
    try:
        return _read_signature(cms.ContentInfo.load(pkcs7_der, strict=True))
    except _ASN1_ERRORS as error:
        if type(error) is ValueError:
            raise
        raise ValueError(f"{type(error).__name__} while reading it") from None


def _read_signature(info: Any) -> _Signature:
    if info["content_type"].native != "signed_data":
        raise ValueError("it is not SignedData")
    data = info["content"]
    if data["encap_content_info"]["content_type"].native != "data" or data["encap_content_info"]["content"]:
        raise ValueError("it is not a detached signature")
    if len(data["signer_infos"]) != 1 or len(data["crls"] or ()):
        raise ValueError("it has not exactly one signer")
    signer = data["signer_infos"][0]
    if signer["sid"].name != "issuer_and_serial_number" or len(signer["unsigned_attrs"] or ()):
        raise ValueError("its signer is not named by issuer and serial number")
    algorithms = {one["algorithm"].native for one in data["digest_algorithms"]}
    if algorithms | {signer["digest_algorithm"]["algorithm"].native} != {"sha256"}:
        raise ValueError("its digest is not SHA-256")
    if signer["signature_algorithm"]["algorithm"].native not in _SIGNATURES:
        raise ValueError("its signature is neither ECDSA nor RSA with SHA-256")
    attributes = {one["type"].native: one["values"] for one in signer["signed_attrs"]}
    values_are_single = all(len(values) == 1 for values in attributes.values())
    if len(attributes) != len(signer["signed_attrs"]) or not values_are_single:
        raise ValueError("it has an attribute twice")
    if attributes["content_type"][0].native != "data":
        raise ValueError("what it signs is not data")
    return _Signature(
        signer["sid"].chosen["issuer"].dump(),
        signer["sid"].chosen["serial_number"].native,
        frozenset(attributes),
        signer["signed_attrs"].untag().dump(),
        attributes["message_digest"][0].native,
        signer["signature"].native,
        tuple(one.chosen.dump() for one in data["certificates"]),
    )
