"""A keystore as SROS2 makes it, written independently of ours: the yardstick that lets the attack tests fail.

One CA for identity and permissions, subjects ``CN=<enclave path>``, certificates without key usage
(sros2 0.13.0: _utilities.py, keystore/_enclave.py, keystore/_permission.py).
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import pkcs7
from cryptography.x509.oid import NameOID

_DAY = datetime.timedelta(days=1)
_LISTED = "                <topic>{}</topic>"


@dataclass(frozen=True)
class Credential:
    """A key and its certificate."""

    key: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate

    @classmethod
    def read(cls, directory: Path) -> Credential:
        """The identity in an enclave directory: what an attacker who copied it holds."""
        key = serialization.load_pem_private_key((directory / "key.pem").read_bytes(), None)
        assert isinstance(key, ec.EllipticCurvePrivateKey)
        return cls(key, x509.load_pem_x509_certificate((directory / "cert.pem").read_bytes()))

    @classmethod
    def of_ca(cls, keystore: Path) -> Credential:
        """The identity CA of a keystore with its key on disk."""
        key = serialization.load_pem_private_key(
            (keystore / "private/identity_ca.key.pem").read_bytes(), None
        )
        assert isinstance(key, ec.EllipticCurvePrivateKey)
        certificate = (keystore / "public/identity_ca.cert.pem").read_bytes()
        return cls(key, x509.load_pem_x509_certificate(certificate))

    @property
    def key_pem(self) -> bytes:
        return self.key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )

    @property
    def certificate_pem(self) -> bytes:
        return self.certificate.public_bytes(serialization.Encoding.PEM)

    def sign(self, document: str) -> bytes:
        """S/MIME, detached, as DDS Security wants governance and permissions."""
        builder = pkcs7.PKCS7SignatureBuilder().set_data(document.encode())
        return builder.add_signer(self.certificate, self.key, hashes.SHA256()).sign(
            serialization.Encoding.SMIME, [pkcs7.PKCS7Options.Text, pkcs7.PKCS7Options.DetachedSignature]
        )


def issue(
    common_name: str, issuer: Credential | None = None, days: int = 3650, is_ca: bool = False
) -> Credential:
    """``days`` until the end; negative: it ended so many days ago."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])
    now = datetime.datetime.now(datetime.timezone.utc)
    builder = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer.certificate.subject if issuer else subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _DAY if days > 0 else now + (days - 30) * _DAY)
        .not_valid_after(now + days * _DAY)
        .add_extension(x509.BasicConstraints(is_ca, 1 if is_ca else None), critical=is_ca)
    )
    return Credential(key, builder.sign(issuer.key if issuer else key, hashes.SHA256()))


GOVERNANCE = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      <domains><id>{domain}</id></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>SIGN</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>ENCRYPT</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
"""

PERMISSIONS = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="{path}">
      <subject_name>CN={path}</subject_name>
      <validity>
        <not_before>{not_before:%Y-%m-%dT%H:%M:%S}</not_before>
        <not_after>{not_after:%Y-%m-%dT%H:%M:%S}</not_after>
      </validity>
      <allow_rule>
        <domains><id>{domain}</id></domains>
{rules}
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
"""


@dataclass(frozen=True)
class Grant:
    """ROS topic names, absolute."""

    publish: tuple[str, ...] = ()
    subscribe: tuple[str, ...] = ()

    def rules(self) -> str:
        """Every grant may take part in discovery, as in ROS."""
        return _rule("publish", self.publish) + "\n" + _rule("subscribe", self.subscribe)


def _rule(verb: str, topics: tuple[str, ...]) -> str:
    names = ("ros_discovery_info", *(f"rt{topic}" for topic in topics))
    listed = "\n".join(_LISTED.format(name) for name in names)
    return f"        <{verb}>\n            <topics>\n{listed}\n            </topics>\n        </{verb}>"


def directory_of(keystore: Path, path: str) -> Path:
    return keystore / "enclaves" / path.lstrip("/")


def create(keystore: Path, domain: int, grants: Mapping[str, Grant]) -> Credential:
    """Write ``keystore`` and return its CA."""
    ca = issue("sros2CA", is_ca=True)
    for folder, name, content in (("public", "cert", ca.certificate_pem), ("private", "key", ca.key_pem)):
        (keystore / folder).mkdir(parents=True)
        (keystore / folder / f"ca.{name}.pem").write_bytes(content)
        for role in ("identity_ca", "permissions_ca"):
            (keystore / folder / f"{role}.{name}.pem").symlink_to(f"ca.{name}.pem")
    governance = GOVERNANCE.format(domain=domain)
    (keystore / "enclaves").mkdir()
    (keystore / "enclaves" / "governance.xml").write_text(governance, encoding="utf-8")
    (keystore / "enclaves" / "governance.p7s").write_bytes(ca.sign(governance))
    for path, grant in grants.items():
        _create_enclave(keystore, path, domain, grant, ca)
    return ca


def _create_enclave(keystore: Path, path: str, domain: int, grant: Grant, ca: Credential) -> None:
    directory = directory_of(keystore, path)
    directory.mkdir(parents=True, exist_ok=True)
    now = datetime.datetime.now(datetime.timezone.utc)
    permissions = PERMISSIONS.format(
        path=path, domain=domain, rules=grant.rules(), not_before=now - _DAY, not_after=now + 3650 * _DAY
    )
    identity = issue(path, ca)
    files = {
        "cert.pem": identity.certificate_pem,
        "key.pem": identity.key_pem,
        "permissions.xml": permissions.encode(),
        "permissions.p7s": ca.sign(permissions),
    }
    for name, content in files.items():
        (directory / name).write_bytes(content)
    depth = len([part for part in path.split("/") if part])
    for role in ("identity_ca", "permissions_ca"):
        (directory / f"{role}.cert.pem").symlink_to(f"{'../' * (depth + 1)}public/{role}.cert.pem")
    if depth:
        (directory / "governance.p7s").symlink_to(f"{'../' * depth}governance.p7s")
