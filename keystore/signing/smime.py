"""Documents signed as DDS-Security wants them (S/MIME, section 9.4.1.1 of the specification), and read back.

    document (XML bytes) + Signer -> .p7s        .p7s -> SignedDocument -> checked against the permissions CA

``cryptography``'s S/MIME writer spends over a millisecond per document: it signs in about 0.1 ms and then
sends the result through Python's ``email`` generator, which parses and re-flows headers in pure Python. A
signed document of ours has a fixed shape, so it is concatenated here; and since only the raw signature
comes from a ``Signer``, a key in a token signs the same way as one in a file.

What is signed are the bytes ``Content-Type: text/plain`` CRLF CRLF + document with CRLF line ends. Verifiers
canonicalise line ends, so the file itself may be stored with either.
"""

from __future__ import annotations

import binascii
from datetime import datetime
from typing import TYPE_CHECKING, NamedTuple

from keystore.errors import DamagedKeystoreError, InvalidInputError
from keystore.formats import der
from keystore.formats.certificate import CertificateFacts

if TYPE_CHECKING:
    from keystore.signing.authority import Authority

_TEXT_HEADER = b"Content-Type: text/plain\r\n\r\n"
_LF_HEADER = b"Content-Type: text/plain\n\n"
_SHA256 = der.encode(der.SEQUENCE, der.object_identifier("2.16.840.1.101.3.4.2.1"))
_ECDSA_SHA256 = der.encode(der.SEQUENCE, der.object_identifier("1.2.840.10045.4.3.2"))
_RSA = der.encode(der.SEQUENCE, der.object_identifier("1.2.840.113549.1.1.1"), der.encode(der.NULL))
_DATA = der.object_identifier("1.2.840.113549.1.7.1")
_SIGNED_DATA = der.object_identifier("1.2.840.113549.1.7.2")
_CONTENT_TYPE = der.object_identifier("1.2.840.113549.1.9.3")
_MESSAGE_DIGEST = der.object_identifier("1.2.840.113549.1.9.4")
_SIGNING_TIME = der.object_identifier("1.2.840.113549.1.9.5")
_CONSTRUCTED_0 = 0xA0


def sign_document(document: bytes, ca: Authority, now: datetime) -> bytes:
    """The ``.p7s`` file of ``document``, signed by ``ca``.

    Raises InvalidInputError when the document holds a bare CR or a NUL, which verifiers read differently.
    """
    content = _TEXT_HEADER + _with_crlf(document)
    return _multipart(content, _signed_data(content, ca, now))


def _with_crlf(document: bytes) -> bytes:
    lines = document.replace(b"\r\n", b"\n")
    if b"\r" in lines or b"\0" in lines:
        raise InvalidInputError("a document to be signed must not contain a bare carriage return or a NUL")
    return lines.replace(b"\n", b"\r\n")


def _signed_data(content: bytes, ca: Authority, now: datetime) -> bytes:
    """SignedData of RFC 5652 section 5.1, version 1, detached, with the signer's certificate."""
    certificate = ca.facts
    attributes = _attributes(_sha256(content), now)
    signer_info = der.encode(
        der.SEQUENCE,
        der.integer(1),
        der.encode(der.SEQUENCE, certificate.issuer, der.integer(certificate.serial)),
        _SHA256,
        der.encode(_CONSTRUCTED_0, attributes),
        _signature_algorithm(certificate),
        # RFC 5652 section 5.4: what is signed is the SET OF, not the [0] that stands in the message.
        der.encode(der.OCTET_STRING, ca.signer.sign(der.encode(der.SET, attributes))),
    )
    body = der.encode(
        der.SEQUENCE,
        der.integer(1),
        der.encode(der.SET, _SHA256),
        der.encode(der.SEQUENCE, _DATA),
        der.encode(_CONSTRUCTED_0, certificate.der),
        der.encode(der.SET, signer_info),
    )
    return der.encode(der.SEQUENCE, _SIGNED_DATA, der.encode(_CONSTRUCTED_0, body))


def _sha256(data: bytes) -> bytes:
    import hashlib  # loads libcrypto, which a launch that only compares does not need

    return hashlib.sha256(data).digest()


def _attributes(digest: bytes, now: datetime) -> bytes:
    """contentType, signingTime, messageDigest: in the ascending order DER demands of a SET OF."""
    pairs = (
        (_CONTENT_TYPE, _DATA),
        (_SIGNING_TIME, der.utc_time(now)),
        (_MESSAGE_DIGEST, der.encode(der.OCTET_STRING, digest)),
    )
    return b"".join(sorted(der.encode(der.SEQUENCE, oid, der.encode(der.SET, value)) for oid, value in pairs))


def _signature_algorithm(certificate: CertificateFacts) -> bytes:
    return _RSA if _RSA in certificate.public_key[:40] else _ECDSA_SHA256


def _multipart(content: bytes, pkcs7: bytes) -> bytes:
    # The digest makes the boundary one that cannot occur in the content, and the same content the same frame.
    boundary = b"----" + _sha256(b"boundary" + content).hex()[:32].upper().encode()
    encoded = binascii.b2a_base64(pkcs7, newline=False)
    lines = b"\r\n".join(encoded[at : at + 64] for at in range(0, len(encoded), 64))
    head = b'MIME-Version: 1.0\r\nContent-Type: multipart/signed; protocol="application/x-pkcs7-signature"; '
    return b"".join((
        head, b'micalg="sha-256"; boundary="', boundary, b'"\r\n\r\nThis is an S/MIME signed message\r\n\r\n--',
        boundary, b"\r\n", content, b"\r\n--",
        boundary, b"\r\n"
        b'Content-Type: application/x-pkcs7-signature; name="smime.p7s"\r\n'
        b"Content-Transfer-Encoding: base64\r\n"
        b'Content-Disposition: attachment; filename="smime.p7s"\r\n\r\n',
        lines, b"\r\n\r\n--", boundary, b"--\r\n",
    ))  # fmt: skip


class SignedDocument(NamedTuple):
    """A ``.p7s`` taken apart, nothing checked yet."""

    text: bytes
    """The signed part with LF line ends: text/plain header and document."""
    pkcs7: bytes

    @property
    def document(self) -> bytes:
        """The XML with LF line ends."""
        return self.text.removeprefix(_LF_HEADER)

    @property
    def content(self) -> bytes:
        """The signed bytes: in canonical form, with CRLF line ends."""
        return self.text.replace(b"\n", b"\r\n")

    def embeds(self, certificate: bytes) -> bool:
        """Whether this certificate (DER) is carried along: a cheap sign of who signed, no proof."""
        return certificate in self.pkcs7


def read(p7s: bytes, place: str) -> SignedDocument:
    """Take a multipart/signed file apart; raises DamagedKeystoreError naming ``place``.

    The outer header may carry any boundary (ours, ``cryptography``'s, ``openssl smime``'s).
    """
    lines = p7s.replace(b"\r\n", b"\n")
    header = lines.partition(b"\n\n")[0]
    boundary = _boundary(header) if b"multipart/signed" in header else b""
    parts = lines.split(b"\n--" + boundary) if boundary else []
    if len(parts) < 3 or not parts[1].startswith(b"\n"):
        raise DamagedKeystoreError(f"{place} is not a detached S/MIME message (multipart/signed)")
    head, _, encoded = parts[2].partition(b"\n\n")
    if b"pkcs7-signature" not in head:  # where OpenSSL looks
        raise DamagedKeystoreError(f"{place} carries no PKCS#7 signature")
    try:
        pkcs7 = der.from_base64(encoded)
    except der.DerError:
        raise DamagedKeystoreError(f"{place}: its signature is not base64") from None
    return SignedDocument(parts[1][1:], pkcs7)


def _boundary(header: bytes) -> bytes:
    _, _, value = header.replace(b"\n\t", b" ").replace(b"\n ", b" ").partition(b"boundary=")
    if value.startswith(b'"'):
        return value[1:].partition(b'"')[0]
    return value.split(b";")[0].split()[0] if value.strip() else b""


def check(signed: SignedDocument, authorities: list[CertificateFacts], place: str) -> CertificateFacts:
    """The authority whose key signed ``signed``; raises DamagedKeystoreError saying what is wrong.

    Strict as the fixed releases are (Cyclone DDS 11, Fast DDS 2.6.5): the signer must *be* one of
    ``authorities``. Certificates carried in the message are not trusted, and no chain is built.
    """
    if not signed.text.startswith(_LF_HEADER):
        raise DamagedKeystoreError(
            f"{place}: the signed part is not text/plain, DDS implementations refuse it"
        )
    try:
        info = _signer_info(signed.pkcs7)
    except (der.DerError, IndexError, ValueError):
        raise DamagedKeystoreError(
            f"{place}: its signature is not PKCS#7 SignedData with one signer"
        ) from None
    for authority in authorities:
        if info.issuer == authority.issuer and info.serial == authority.serial:
            _check_signature(info, signed, authority, place)
            return authority
    raise DamagedKeystoreError(f"{place}: signed by someone who is not the permissions CA of this keystore")


class _SignerInfo(NamedTuple):
    issuer: bytes
    serial: int
    attributes: bytes
    digest: bytes
    signature: bytes


def _signer_info(pkcs7: bytes) -> _SignerInfo:
    oid, holder = der.parse(pkcs7).expect(der.SEQUENCE).children()
    if oid.whole != _SIGNED_DATA:
        raise der.DerError("not SignedData")
    signers = holder.children()[0].children()[-1].expect(der.SET).children()
    (signer,) = signers
    _, identifier, digest_algorithm, attributes, _, signature = signer.children()[:6]
    if digest_algorithm.children()[0].whole != der.parse(_SHA256).children()[0].whole:
        raise der.DerError("not SHA-256")
    issuer, serial = identifier.children()
    values = {
        pair.children()[0].whole: pair.children()[1] for pair in attributes.expect(_CONSTRUCTED_0).children()
    }
    return _SignerInfo(
        issuer.whole,
        int.from_bytes(serial.content, "big"),
        der.encode(der.SET, attributes.content),
        values[_MESSAGE_DIGEST].children()[0].content if _MESSAGE_DIGEST in values else b"",
        signature.expect(der.OCTET_STRING).content,
    )


def _check_signature(
    info: _SignerInfo, signed: SignedDocument, authority: CertificateFacts, place: str
) -> None:
    from keystore.signing.public_key import signature_is_valid

    if info.digest != _sha256(signed.content):
        raise DamagedKeystoreError(f"{place}: its content was changed after signing")
    if not signature_is_valid(authority.public_key, info.signature, info.attributes):
        raise DamagedKeystoreError(f"{place}: its signature is not by the permissions CA of this keystore")
