"""The two CAs of a keystore: made, loaded, and put to work. Bytes in, bytes out; nothing is written here.

Identity CA and permissions CA are different keys with different names by default. DDS implementations before
Cyclone DDS 11.0 and Fast DDS 2.6.5 let anything that chains to the permissions CA sign permissions and
governance; with SROS2's single CA that is every enclave (CVE-2023-24010, CVE-2023-24011).
"""

from __future__ import annotations

import binascii
import ipaddress
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from enum import Enum
from typing import TYPE_CHECKING

from keystore.errors import InvalidInputError, SigningUnavailableError
from keystore.formats import certificate
from keystore.formats.certificate import CertificateFacts, read_certificate
from keystore.formats.role import Role
from keystore.formats.validity import Validity
from keystore.signing.ca_access import Secret
from keystore.signing.signer import FileSigner, Signer

if TYPE_CHECKING:
    from cryptography import x509

    from keystore.signing.signer import PrivateKey, PublicKey


class Curve(str, Enum):
    """The elliptic curves of keys that are made here."""

    P256 = "P-256"
    P384 = "P-384"  # Fast DDS only: Cyclone DDS refuses EC keys that are not 256 bits


@dataclass(frozen=True, slots=True)
class Authority:
    """A CA that can sign: its certificate and the signer that holds the matching key."""

    facts: CertificateFacts
    signer: Signer = field(repr=False)

    @property
    def validity(self) -> Validity:
        return self.facts.validity

    def pem(self) -> bytes:
        return pem_certificate(self.facts.der)


def authority_of(cert_pem: bytes, signer: Signer, place: str) -> Authority:
    """Bind a certificate to its signer; raises SigningUnavailableError when the key is another one's."""
    facts = read_certificate(cert_pem, place)
    if spki(signer.public_key()) != facts.public_key:
        raise SigningUnavailableError(f"{place} and the private key beside it do not belong together")
    return Authority(facts, signer)


def spki(key: PublicKey) -> bytes:
    """DER of a public key (SubjectPublicKeyInfo, RFC 5280 section 4.1)."""
    from cryptography.hazmat.primitives import serialization

    return key.public_bytes(serialization.Encoding.DER, serialization.PublicFormat.SubjectPublicKeyInfo)


def pem_certificate(der: bytes) -> bytes:
    """A certificate in PEM (RFC 7468)."""
    text = binascii.b2a_base64(der, newline=False)
    lines = b"\n".join(text[at : at + 64] for at in range(0, len(text), 64))
    return b"-----BEGIN CERTIFICATE-----\n" + lines + b"\n-----END CERTIFICATE-----\n"


def default_ca_name(role: Role) -> str:
    """A common name of its own for each CA ever made, so that documents of two CAs are never confused."""
    return f"ROS {role.value.removesuffix('_ca')} CA {os.urandom(4).hex()}"


def new_key(curve: Curve) -> FileSigner:
    """A new private key on ``curve``, in memory."""
    from cryptography.hazmat.primitives.asymmetric import ec

    return FileSigner(ec.generate_private_key(ec.SECP256R1() if curve is Curve.P256 else ec.SECP384R1()))


def key_pem(signer: FileSigner, passphrase: Secret | None = None) -> bytes:
    """PKCS#8 PEM, encrypted when a passphrase is given."""
    from cryptography.hazmat.primitives import serialization

    protection: serialization.KeySerializationEncryption = serialization.NoEncryption()
    if passphrase is not None:
        protection = serialization.BestAvailableEncryption(passphrase.value())
    return signer.private_key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, protection
    )


def self_signed_ca(role: Role, name: str, signer: Signer, validity: Validity) -> Authority:
    """A CA certificate for the key of ``signer``: CA:TRUE, pathlen 0, key usage after the role.

    keyCertSign + cRLSign for identities; the permissions CA also needs digitalSignature, without which both
    implementations refuse its documents. Raises InvalidInputError for a name that is empty or over 64 bytes.
    """
    from cryptography import x509

    refuse_ca_name(name)
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    builder = (
        _builder(subject, subject, validity, signer.public_key())
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_key_usage(role), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(signer.public_key()), critical=False)
    )
    return Authority(certificate.read_der(_sign(builder, signer)), signer)


def refuse_ca_name(name: str) -> None:
    """Raises InvalidInputError for what X.509 cannot carry, or DDS implementations read as more than one piece."""
    fits = name.strip() and name.isprintable() and len(name.encode()) <= 64
    if not fits or any(char in name for char in ',+"\\=/|<>;#'):
        raise InvalidInputError('a CA name has 1 to 64 bytes of UTF-8 and none of , + " \\ = / | < > ; #')


def _key_usage(role: Role | None) -> x509.KeyUsage:
    """Of the CA for ``role``; None: of an enclave."""
    from cryptography import x509

    is_leaf = role is None
    return x509.KeyUsage(
        digital_signature=is_leaf or role is Role.PERMISSIONS, key_cert_sign=not is_leaf,
        crl_sign=role is Role.IDENTITY, content_commitment=False, key_encipherment=False,
        data_encipherment=False, key_agreement=False, encipher_only=False, decipher_only=False,
    )  # fmt: skip


class IdentityIssuer:
    """The identity CA at work: prepared once, then one certificate per enclave.

    Profile: CA:FALSE, digitalSignature, EKU serverAuth + clientAuth, SKI, AKI, random 159-bit serial. The EKU
    is what keeps a leaf from signing S/MIME where both CAs are one (an extended SROS2 keystore).
    """

    def __init__(self, authority: Authority):
        from cryptography import x509
        from cryptography.x509.oid import ExtendedKeyUsageOID

        ca = x509.load_der_x509_certificate(authority.facts.der)
        self._authority = authority
        self._issuer = ca.subject
        self._x509 = x509
        self._constraints = x509.BasicConstraints(ca=False, path_length=None)
        self._usage = _key_usage(None)
        server, client = ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH
        self._extended, self._server = (
            x509.ExtendedKeyUsage([server, client]),
            x509.ExtendedKeyUsage([server]),
        )
        self._authority_key = _authority_key_id(ca, authority.signer)

    def issue(
        self, common_name: str, key: PublicKey, validity: Validity, hosts: Sequence[str] = ()
    ) -> CertificateFacts:
        """A certificate for an already valid common name, which does not outlive the CA. With ``hosts`` (names and
        addresses): of a server that is found there, and of nothing else."""
        x509 = self._x509
        name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, common_name)])
        builder = (
            _builder(name, self._issuer, validity.within(self._authority.validity), key)
            .add_extension(self._constraints, critical=True)
            .add_extension(self._usage, critical=True)
            .add_extension(self._server if hosts else self._extended, critical=False)
            .add_extension(x509.SubjectKeyIdentifier.from_public_key(key), critical=False)
            .add_extension(self._authority_key, critical=False)
        )
        if hosts:
            builder = builder.add_extension(_alternative_names(hosts), critical=False)
        return certificate.read_der(_sign(builder, self._authority.signer))

    def revocation_list(
        self, serials: dict[int, datetime], now: datetime, next_update: datetime, number: int
    ) -> bytes:
        """A PEM CRL of these serial numbers, each with its date of revocation."""
        from cryptography import x509
        from cryptography.hazmat.primitives import hashes, serialization

        builder = (
            x509.CertificateRevocationListBuilder()
            .issuer_name(self._issuer)
            .last_update(now)
            .next_update(next_update)
            .add_extension(self._authority_key, critical=False)
            .add_extension(x509.CRLNumber(number), critical=False)
        )
        for serial, moment in sorted(serials.items()):
            entry = x509.RevokedCertificateBuilder().serial_number(serial).revocation_date(moment).build()
            builder = builder.add_revoked_certificate(entry)
        crl = builder.sign(signing_key(self._authority.signer), hashes.SHA256())
        return crl.public_bytes(serialization.Encoding.PEM)


def _alternative_names(hosts: Sequence[str]) -> x509.SubjectAlternativeName:
    from cryptography import x509

    names: list[x509.GeneralName] = []
    for host in hosts:
        try:
            names.append(x509.IPAddress(ipaddress.ip_address(host)))
        except ValueError:
            names.append(x509.DNSName(host))
    return x509.SubjectAlternativeName(names)


def _authority_key_id(ca: x509.Certificate, signer: Signer) -> x509.AuthorityKeyIdentifier:
    """From the CA's own SKI when it has one (SROS2's have none), as RFC 5280 section 4.2.1.1 asks."""
    from cryptography import x509

    try:
        key_id = ca.extensions.get_extension_for_class(x509.SubjectKeyIdentifier).value
    except x509.ExtensionNotFound:
        return x509.AuthorityKeyIdentifier.from_issuer_public_key(signer.public_key())
    return x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(key_id)


def _builder(
    subject: x509.Name, issuer: x509.Name, validity: Validity, key: PublicKey
) -> x509.CertificateBuilder:
    from cryptography import x509

    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .serial_number(x509.random_serial_number())
        .not_valid_before(validity.not_before.astimezone(timezone.utc))
        .not_valid_after(validity.not_after.astimezone(timezone.utc))
        .public_key(key)
    )


def _sign(builder: x509.CertificateBuilder, signer: Signer) -> bytes:
    from cryptography.hazmat.primitives import hashes, serialization

    return builder.sign(signing_key(signer), hashes.SHA256()).public_bytes(serialization.Encoding.DER)


def signing_key(signer: Signer) -> PrivateKey:
    """What ``cryptography``'s builders sign with: its own key, or a shell around the token's."""
    if isinstance(signer, FileSigner):
        return signer.private_key
    from keystore.signing.signer_key import builder_key

    return builder_key(signer)


def check_can_serve(certificate_der: bytes, role: Role, now: datetime, place: str) -> None:
    """Raises InvalidInputError when DDS implementations would refuse what this CA signs."""
    from cryptography import x509

    try:
        cert = x509.load_der_x509_certificate(certificate_der)
        extensions = cert.extensions
    except (ValueError, x509.UnsupportedGeneralNameType, x509.DuplicateExtension):
        raise InvalidInputError(f"{place} is not a usable certificate") from None
    facts = read_certificate(pem_certificate(certificate_der), place)
    if not facts.validity.covers(now):
        raise InvalidInputError(f"{place} is not valid now")
    try:
        if not extensions.get_extension_for_class(x509.BasicConstraints).value.ca:
            raise InvalidInputError(f"{place} is not a CA certificate (basicConstraints CA:FALSE)")
        usage = extensions.get_extension_for_class(x509.KeyUsage).value
    except x509.ExtensionNotFound as error:
        if error.oid == x509.OID_BASIC_CONSTRAINTS:
            raise InvalidInputError(f"{place} is not a CA certificate (no basicConstraints)") from None
        return
    if role is Role.IDENTITY and not usage.key_cert_sign:
        raise InvalidInputError(f"{place} may not sign certificates (key usage lacks keyCertSign)")
    if role is Role.PERMISSIONS and not usage.digital_signature:
        raise InvalidInputError(f"{place} may not sign documents (key usage lacks digitalSignature)")
