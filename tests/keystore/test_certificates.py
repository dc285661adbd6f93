"""Certificates as the profile wants them, judged by openssl and by cryptography."""

from __future__ import annotations

import base64
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import load_der_public_key
from hypothesis import example, given
from hypothesis import strategies as st

from keystore import DamagedKeystoreError, InvalidInputError, Role, SigningUnavailableError, Validity
from keystore.disk.crl_file import is_crl
from keystore.formats import certificate
from keystore.signing import authority
from keystore.signing.authority import Authority
from keystore.signing.certificate_request import new_request, request_key
from keystore.signing.private_key import new_key, spki
from keystore.signing.public_key import issued_by
from tests.keystore.kit import DAY, NOW, openssl

VALIDITY = Validity.starting(NOW, 90 * DAY)


def ca(role: Role) -> Authority:
    return authority.self_signed_ca(role, authority.default_ca_name(role), new_key(), VALIDITY)


@pytest.fixture(scope="module")
def identity_ca() -> Authority:
    return ca(Role.IDENTITY)


def test_openssl_accepts_an_enclave_below_its_ca(identity_ca: Authority, tmp_path: Path) -> None:
    made = identity_ca.issue("ros.a.b", new_key().public_key(), VALIDITY)
    (tmp_path / "ca.pem").write_bytes(identity_ca.facts.pem)
    (tmp_path / "cert.pem").write_bytes(made.pem)
    at = str(int(NOW.timestamp()))
    openssl("verify", "-x509_strict", "-attime", at, "-CAfile", tmp_path / "ca.pem", tmp_path / "cert.pem")
    assert (
        openssl("x509", "-noout", "-subject", "-in", tmp_path / "cert.pem").strip() == "subject=CN = ros.a.b"
    )


def test_the_profile_of_an_enclave(identity_ca: Authority) -> None:
    made = identity_ca.issue("ros.a", new_key().public_key(), VALIDITY)
    cert = x509.load_pem_x509_certificate(made.pem)
    usage = cert.extensions.get_extension_for_class(x509.KeyUsage)
    assert usage.critical and usage.value.digital_signature and not usage.value.key_cert_sign
    constraints = cert.extensions.get_extension_for_class(x509.BasicConstraints)
    assert constraints.critical and not constraints.value.ca
    extended = cert.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    assert [usage.dotted_string for usage in extended] == ["1.3.6.1.5.5.7.3.1", "1.3.6.1.5.5.7.3.2"]
    assert cert.extensions.get_extension_for_class(x509.AuthorityKeyIdentifier)
    assert cert.serial_number.bit_length() > 100
    key = load_der_public_key(made.public_key)
    assert isinstance(key, ec.EllipticCurvePublicKey) and key.curve.name == "secp256r1"


@pytest.mark.parametrize(("role", "documents"), [(Role.IDENTITY, False), (Role.PERMISSIONS, True)])
def test_the_profile_of_each_ca(role: Role, documents: bool) -> None:
    cert = x509.load_der_x509_certificate(ca(role).facts.der)
    usage = cert.extensions.get_extension_for_class(x509.KeyUsage).value
    assert usage.key_cert_sign and usage.digital_signature is documents
    constraints = cert.extensions.get_extension_for_class(x509.BasicConstraints)
    assert constraints.critical and constraints.value.ca and constraints.value.path_length == 0


def test_cas_have_names_of_their_own() -> None:
    assert ca(Role.IDENTITY).facts.subject != ca(Role.IDENTITY).facts.subject
    for name in ("", "a" * 65, "a,b", "a/b", "a=b", 'a"b', "a\\b"):
        with pytest.raises(InvalidInputError):
            authority.self_signed_ca(Role.IDENTITY, name, new_key(), VALIDITY)


def test_an_enclave_never_outlives_its_ca(identity_ca: Authority) -> None:
    made = identity_ca.issue("ros.a", new_key().public_key(), Validity.starting(NOW, 900 * DAY))
    assert made.validity == VALIDITY


def test_a_ca_and_another_ones_key_are_told_apart(identity_ca: Authority) -> None:
    with pytest.raises(SigningUnavailableError, match="do not belong together"):
        authority.authority_of(identity_ca.facts, ca(Role.IDENTITY).key, "ca.pem")


def test_facts_agree_with_cryptography(identity_ca: Authority) -> None:
    made = identity_ca.issue("ros.a", new_key().public_key(), VALIDITY)
    cert = x509.load_pem_x509_certificate(made.pem)
    facts = certificate.given_certificates(
        b"text before the block\n" + made.pem + identity_ca.facts.pem, "x"
    )[0]
    assert facts.serial == cert.serial_number
    assert facts.common_name == "ros.a" and facts.name_parts == 1
    assert facts.subject == cert.subject.public_bytes() and facts.issuer == cert.issuer.public_bytes()
    assert facts.validity.not_before.replace(tzinfo=None) == cert.not_valid_before
    assert facts.validity.not_after.replace(tzinfo=None) == cert.not_valid_after
    assert facts.public_key == spki(made_public(cert))
    assert issued_by(facts, identity_ca.facts) and not issued_by(facts, ca(Role.IDENTITY).facts)
    assert not facts.can_sign_mail and ca(Role.PERMISSIONS).facts.can_sign_mail


def made_public(cert: x509.Certificate) -> ec.EllipticCurvePublicKey | rsa.RSAPublicKey:
    key = cert.public_key()
    assert isinstance(key, (ec.EllipticCurvePublicKey, rsa.RSAPublicKey))
    return key


@given(st.binary(max_size=60))
def test_garbage_is_refused_with_one_kind_of_error(data: bytes) -> None:
    with pytest.raises(ValueError):
        certificate.read_der(data)


@given(st.integers(0, 400), st.binary(min_size=1, max_size=3))
@example(12, b"\x01")  # a version that X.509 does not have
def test_damaged_certificates_are_read_or_refused(position: int, damage: bytes) -> None:
    whole = _SAMPLE.facts.der
    data = whole[:position] + damage + whole[position + len(damage) :]
    try:
        facts = certificate.read_der(data)
    except ValueError:
        pem = base64.encodebytes(data).decode()
        with pytest.raises(DamagedKeystoreError):
            certificate.read_certificate(
                f"-----BEGIN CERTIFICATE-----\n{pem}-----END CERTIFICATE-----\n".encode()
            )
        return
    assert facts.can_sign_mail in (True, False) and issued_by(facts, _SAMPLE.facts) in (True, False)


def test_a_request_and_a_crl_of_a_version_that_x509_does_not_have_are_refused() -> None:
    request = new_request("ros.a", new_key())
    assert request_key(request, "it").common_name == "ros.a"
    # cryptography 3.4, of Ubuntu 22.04, reads it: there its signature is what is wrong.
    refused = "it is not a certificate request|it is not signed by the key that it is for"
    with pytest.raises(DamagedKeystoreError, match=refused):
        request_key(with_version(request, b"\x00", b"\x07"), "it")
    crl = _SAMPLE.revocation_list({}, NOW, NOW + DAY, 1)
    assert is_crl(crl) and not is_crl(with_version(crl, b"\x01", b"\x07"))


def with_version(pem: bytes, old: bytes, new: bytes) -> bytes:
    head, *lines, foot = pem.splitlines()
    der = base64.b64decode(b"".join(lines)).replace(b"\x02\x01" + old, b"\x02\x01" + new, 1)
    return b"\n".join((head, base64.b64encode(der), foot, b""))


_SAMPLE = ca(Role.IDENTITY)
