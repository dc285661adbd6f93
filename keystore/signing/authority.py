"""The two CAs of a keystore: made, loaded, and put to work. Bytes in, bytes out; nothing is written here.

Identity CA and permissions CA are different keys with different names by default. DDS implementations before
Cyclone DDS 11.0 and Fast DDS 2.6.5 let anything that chains to the permissions CA sign permissions and
governance; with SROS2's single CA that is every enclave (CVE-2023-24010, CVE-2023-24011).
"""

from __future__ import annotations

import ipaddress
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import cached_property

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.x509.oid import ExtendedKeyUsageOID

from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError, SigningUnavailableError
from keystore.formats.certificate import CertificateFacts, read_der
from keystore.formats.role import Role
from keystore.formats.validity import Validity
from keystore.signing.private_key import PrivateKey, PublicKey, spki
from keystore.signing.token_key import builder_key


@dataclass(frozen=True)
class Authority:
    """A CA that can sign: its certificate and the matching key."""

    facts: CertificateFacts
    key: PrivateKey = field(repr=False)

    @property
    def validity(self) -> Validity:
        return self.facts.validity

    @cached_property
    def _key_id(self) -> x509.AuthorityKeyIdentifier:
        """Take the CA's own SKI if it has one (SROS2's have none), as RFC 5280 section 4.2.1.1 asks."""
        key_id = self.facts.extension(x509.SubjectKeyIdentifier)
        if key_id is None:
            return x509.AuthorityKeyIdentifier.from_issuer_public_key(self.key.public_key())
        return x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(key_id)

    def issue(
        self, common_name: str, key: PublicKey, validity: Validity, hosts: Sequence[str] = ()
    ) -> CertificateFacts:
        """Issue a certificate for an already valid common name; it does not outlive the CA.

        CA:FALSE, digitalSignature, EKU serverAuth + clientAuth, SKI, AKI, random 159-bit serial. The EKU is what keeps
        a leaf from signing S/MIME where both CAs are one (an extended SROS2 keystore).

        With ``hosts`` (names and addresses): of a server that is found there, and of nothing else.
        """
        uses = [ExtendedKeyUsageOID.SERVER_AUTH, *([] if hosts else [ExtendedKeyUsageOID.CLIENT_AUTH])]
        issuer = self.facts.certificate.subject
        builder = (
            _builder(_name(common_name), issuer, validity.within(self.validity), key)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_key_usage(None), critical=True)
            .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
            .add_extension(x509.SubjectKeyIdentifier.from_public_key(key), critical=False)
            .add_extension(self._key_id, critical=False)
        )
        if hosts:
            builder = builder.add_extension(_alternative_names(hosts), critical=False)
        return _signed(builder, self.key)

    def revocation_list(
        self, serials: dict[int, datetime], now: datetime, next_update: datetime, number: int
    ) -> bytes:
        """Sign a CRL of these serial numbers, each with its date of revocation; as PEM."""
        builder = (
            x509.CertificateRevocationListBuilder()
            .issuer_name(self.facts.certificate.subject)
            .last_update(now)
            .next_update(next_update)
            .add_extension(self._key_id, critical=False)
            .add_extension(x509.CRLNumber(number), critical=False)
        )
        for serial, revoked_at in sorted(serials.items()):
            entry = x509.RevokedCertificateBuilder().serial_number(serial).revocation_date(revoked_at).build()
            builder = builder.add_revoked_certificate(entry)
        return builder.sign(builder_key(self.key), hashes.SHA256()).public_bytes(serialization.Encoding.PEM)


def authority_of(facts: CertificateFacts, key: PrivateKey, place: str) -> Authority:
    """Join a certificate to its key; raises SigningUnavailableError if it is another one's."""
    if spki(key.public_key()) != facts.public_key:
        raise SigningUnavailableError(f"{place} and the private key beside it do not belong together")
    return Authority(facts, key)


def default_ca_name(role: Role) -> str:
    """Return a common name that no other CA has, so that documents of two CAs are never confused."""
    return f"ROS {role.use} CA {os.urandom(4).hex()}"


def self_signed_ca(role: Role, name: str, key: PrivateKey, validity: Validity) -> Authority:
    """Make a CA certificate for ``key``: CA:TRUE, pathlen 0, key usage after the role.

    keyCertSign + cRLSign for identities; the permissions CA also needs digitalSignature, without which both
    implementations refuse its documents. Raises InvalidInputError for a name that is empty or over 64 bytes.
    """
    refuse_ca_name(name)
    subject, public = _name(name), key.public_key()
    builder = (
        _builder(subject, subject, validity, public)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_key_usage(role), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public), critical=False)
    )
    return Authority(_signed(builder, key), key)


def refuse_ca_name(name: str) -> None:
    """Raise InvalidInputError for what X.509 cannot carry, or DDS implementations read as more than one piece."""
    fits = name.strip() and name.isprintable() and len(name.encode()) <= 64
    if not fits or any(char in name for char in ',+"\\=/|<>;#'):
        raise InvalidInputError('a CA name has 1 to 64 bytes of UTF-8 and none of , + " \\ = / | < > ; #')


def _key_usage(role: Role | None) -> x509.KeyUsage:
    is_leaf = role is None
    return x509.KeyUsage(
        digital_signature=is_leaf or role is Role.PERMISSIONS, key_cert_sign=not is_leaf,
        crl_sign=role is Role.IDENTITY, content_commitment=False, key_encipherment=False,
        data_encipherment=False, key_agreement=False, encipher_only=False, decipher_only=False,
    )  # fmt: skip


def _alternative_names(hosts: Sequence[str]) -> x509.SubjectAlternativeName:
    names: list[x509.GeneralName] = []
    for host in hosts:
        try:
            names.append(x509.IPAddress(ipaddress.ip_address(host)))
        except ValueError:
            names.append(x509.DNSName(host))
    return x509.SubjectAlternativeName(names)


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, common_name)])


def _builder(
    subject: x509.Name, issuer: x509.Name, validity: Validity, key: PublicKey
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .serial_number(x509.random_serial_number())
        .not_valid_before(validity.not_before.astimezone(timezone.utc))
        .not_valid_after(validity.not_after.astimezone(timezone.utc))
        .public_key(key)
    )


def _signed(builder: x509.CertificateBuilder, key: PrivateKey) -> CertificateFacts:
    made = builder.sign(builder_key(key), hashes.SHA256())
    return read_der(made.public_bytes(serialization.Encoding.DER))


def check_can_serve(facts: CertificateFacts, role: Role, now: datetime, place: str) -> None:
    """Raise InvalidInputError if DDS implementations would refuse what this CA signs."""
    if not facts.validity.covers(now):
        raise InvalidInputError(f"{place} is not valid now")
    constraints, usage = facts.extension(x509.BasicConstraints), facts.extension(x509.KeyUsage)
    if constraints is None or not constraints.ca:
        why = "no basicConstraints" if constraints is None else "basicConstraints CA:FALSE"
        raise InvalidInputError(f"{place} is not a CA certificate ({why})")
    if usage is not None and role is Role.IDENTITY and not usage.key_cert_sign:
        raise InvalidInputError(f"{place} may not sign certificates (key usage lacks keyCertSign)")
    if usage is not None and role is Role.PERMISSIONS and not usage.digital_signature:
        raise InvalidInputError(f"{place} may not sign documents (key usage lacks digitalSignature)")
    if facts.issuer != facts.subject:
        raise InvalidInputError(
            f"{place} is an intermediate CA, issued by {quoted(facts.certificate.issuer.rfc4514_string())}: Cyclone "
            "DDS refuses what it signs, even with the root in the same file. Give a self-signed CA, such as the root, "
            "or let secure-keystore create one"
        )
