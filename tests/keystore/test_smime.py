"""Signed documents: written as openssl and cryptography do, checked as strictly as the fixed DDS releases do."""

from __future__ import annotations

from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, pkcs7
from hypothesis import given
from hypothesis import strategies as st

from keystore import DamagedKeystoreError, InvalidInputError, Role, Validity
from keystore.formats import certificate
from keystore.signing import authority, smime
from keystore.signing.authority import Authority
from keystore.signing.private_key import key_pem, new_key
from tests.keystore.kit import DAY, NOW, openssl

VALIDITY = Validity.starting(NOW, 90 * DAY)
DOCUMENT = b'<?xml version="1.0" encoding="UTF-8"?>\n<dds>\n<!-- \xc3\xa9 -->\n</dds>\n'
AT = str(int(NOW.timestamp()))


def new_ca() -> Authority:
    name = authority.default_ca_name(Role.PERMISSIONS)
    return authority.self_signed_ca(Role.PERMISSIONS, name, new_key(), VALIDITY)


CA, OTHER = new_ca(), new_ca()


def sign(document: bytes, by: Authority = CA) -> bytes:
    return smime.sign_document(document, by)


def check(p7s: bytes, by: Authority = CA, *, foreign: bool = False) -> bytes:
    signed = smime.read_foreign(p7s, "x.p7s") if foreign else smime.read(p7s, "x.p7s")
    smime.check(signed, [by.facts], "x.p7s")
    if not signed.embeds(by.facts.der):
        raise DamagedKeystoreError("another certificate is carried along")
    return signed.document


def test_openssl_verifies_what_we_sign(tmp_path: Path) -> None:
    (tmp_path / "ca.pem").write_bytes(CA.facts.pem)
    (tmp_path / "x.p7s").write_bytes(sign(DOCUMENT))
    openssl(
        "smime", "-verify", "-text", "-attime", AT, "-CAfile", tmp_path / "ca.pem", "-in", tmp_path / "x.p7s",
        "-out", tmp_path / "out",
    )  # fmt: skip
    assert (tmp_path / "out").read_bytes().replace(b"\r\n", b"\n") == DOCUMENT


@pytest.mark.parametrize("extra", [(), ("-nodetach",), ("-md", "sha512")])
def test_openssl_signs_what_we_read(tmp_path: Path, extra: tuple[str, ...]) -> None:
    """Detached with SHA-256 is taken over; other forms are refused, not misread. As it stands none is ours."""
    (tmp_path / "ca.pem").write_bytes(CA.facts.pem)
    (tmp_path / "key.pem").write_bytes(key_pem(CA.key))
    (tmp_path / "x.xml").write_bytes(DOCUMENT)
    openssl(
        "smime", "-sign", "-text", *extra, "-signer", tmp_path / "ca.pem", "-inkey", tmp_path / "key.pem",
        "-in", tmp_path / "x.xml", "-out", tmp_path / "x.p7s",
    )  # fmt: skip
    made = (tmp_path / "x.p7s").read_bytes()
    with pytest.raises(DamagedKeystoreError):
        check(made)
    if extra:
        with pytest.raises(DamagedKeystoreError):
            check(made, foreign=True)
    else:
        assert check(made, foreign=True) == DOCUMENT


@pytest.mark.parametrize("line_ends", [b"\r\n", b"\n"])
def test_what_sros2_signs_is_read(line_ends: bytes) -> None:
    """sros2 calls cryptography's builder with exactly these options."""
    cert = x509.load_der_x509_certificate(CA.facts.der)
    options = [pkcs7.PKCS7Options.Text, pkcs7.PKCS7Options.DetachedSignature]
    builder = pkcs7.PKCS7SignatureBuilder().set_data(DOCUMENT)
    made = builder.add_signer(cert, CA.key, hashes.SHA256()).sign(Encoding.SMIME, options)
    made = made.replace(b"\r\n", b"\n").replace(b"\n", line_ends)
    assert check(made, foreign=True) == DOCUMENT
    with pytest.raises(DamagedKeystoreError, match="not in the form"):
        check(made)


printable_lines = st.lists(
    st.text(st.characters(codec="utf-8", exclude_characters="\r\n\0"), max_size=40), max_size=8
)


@given(printable_lines)
def test_any_document_comes_back_unchanged(lines: list[str]) -> None:
    document = "\n".join(lines).encode()
    assert check(sign(document)) == document


@pytest.mark.parametrize("document", [b"a\rb", b"a\0b", b"\r"])
def test_bytes_that_verifiers_read_differently_are_not_signed(document: bytes) -> None:
    with pytest.raises(InvalidInputError):
        sign(document)


def test_changed_content_is_refused() -> None:
    changed = smime.read(sign(DOCUMENT), "x")._replace(document=DOCUMENT.replace(b"</dds>", b"</ddx>"))
    with pytest.raises(DamagedKeystoreError, match="changed after signing"):
        smime.check(changed, [CA.facts], "x")
    with pytest.raises(DamagedKeystoreError):
        check(sign(DOCUMENT).replace(b"</dds>", b"</ddx>"))


def test_a_changed_signature_is_refused() -> None:
    signed = smime.read(sign(DOCUMENT), "x")
    broken = signed._replace(pkcs7=signed.pkcs7[:-1] + bytes([signed.pkcs7[-1] ^ 1]))
    with pytest.raises(DamagedKeystoreError):
        smime.check(broken, [CA.facts], "x")


def test_another_ca_is_refused() -> None:
    with pytest.raises(DamagedKeystoreError, match="not the permissions CA"):
        check(sign(DOCUMENT, OTHER))


def test_a_certificate_below_the_ca_is_refused() -> None:
    """CVE-2023-24010 and -24011: it chains to the CA, and that is not enough."""
    key = new_key()
    enclave = Authority(CA.issue("ros.a", key.public_key(), VALIDITY), key)
    with pytest.raises(DamagedKeystoreError, match="not the permissions CA"):
        check(sign(DOCUMENT, enclave))


def forger_of(ca: Authority) -> Authority:
    """A CA of another key under the name and serial of ``ca``."""
    key, real = ec.generate_private_key(ec.SECP256R1()), ca.facts.certificate
    copied = x509.CertificateBuilder(real.issuer, real.subject, key.public_key(), real.serial_number)
    copied = copied.not_valid_before(NOW).not_valid_after(NOW + 90 * DAY)
    made = copied.sign(key, hashes.SHA256())
    return Authority(certificate.read_der(made.public_bytes(Encoding.DER)), key)


def test_a_forger_with_the_cas_name_and_serial_is_refused() -> None:
    """Issuer and serial alone prove nothing: the signature must be by the CA's key."""
    forged = smime.sign_document(DOCUMENT, forger_of(CA))
    with pytest.raises(DamagedKeystoreError, match="not by the permissions CA"):
        check(forged)


@pytest.mark.parametrize(
    "p7s", [b"", b"x", b"\0" * 50, DOCUMENT, b'Content-Type: multipart/signed; boundary=""\n\n']
)
def test_what_is_no_smime_is_refused(p7s: bytes) -> None:
    with pytest.raises(DamagedKeystoreError):
        check(p7s)


@given(st.integers(0, 3000), st.binary(min_size=1, max_size=4))
def test_damage_is_refused(position: int, damage: bytes) -> None:
    whole = sign(DOCUMENT)
    damaged = whole[:position] + damage + whole[position + len(damage) :]
    if damaged != whole:
        with pytest.raises(DamagedKeystoreError):
            check(damaged)
