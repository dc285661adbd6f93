"""Findings of ``verify`` that no other test names: each where it belongs, and not where all is well.

Found by asking for each code of ``keystore/verification`` which test would miss it.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from datetime import timedelta
from pathlib import Path

import asn1crypto.x509
import pytest
from asn1crypto import cms
from cryptography.hazmat.primitives.asymmetric import ec

from enclave_addons.zenoh.writing import write_zenoh
from keystore import (
    CaAccess,
    CreateOptions,
    DomainRule,
    Domains,
    Finding,
    Governance,
    ImportedCa,
    Protection,
    RemoveOptions,
    RenewOptions,
    Requirements,
    Role,
    Severity,
    SubjectScheme,
    Validity,
    create_keystore,
    provision,
    remove,
    renew,
    verify,
)
from keystore.disk import layout
from keystore.disk.view import KeystoreView
from keystore.formats.certificate import read_certificate, read_der
from keystore.formats.validity import utc_now
from keystore.signing import smime
from keystore.signing.authority import Authority
from keystore.signing.certificate_request import public_half
from keystore.signing.public_key import fingerprint
from keystore.signing.smime import sign_document
from tests.keystore import kit

YEAR = timedelta(days=365)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return kit.filled(tmp_path_factory.mktemp("made") / "ks")


@pytest.fixture
def root(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "ks", symlinks=True))


def found(root: Path, code: str, **options: object) -> list[Finding]:
    return [one for one in verify(root, **options).findings if one.code == code]  # type: ignore[arg-type]


def of_enclave(root: Path, code: str, **options: object) -> Severity:
    """Of the one finding with this code, which is about /a; /b is as it was."""
    (one,) = found(root, code, **options)
    assert one.place.startswith("enclaves/a") and one.repair, one
    return one.severity


def test_a_keystore_that_is_well_has_nothing_to_be_told(root: Path) -> None:
    assert verify(root).findings == ()


def test_an_earlier_certificate_that_was_put_back(root: Path, tmp_path: Path) -> None:
    shutil.copy(root / "enclaves/a/cert.pem", tmp_path / "old.pem")
    renew(root, ["/a"], options=RenewOptions(provisioning=kit.options()))
    assert found(root, "certificate-not-last") == []
    shutil.copy(tmp_path / "old.pem", root / "enclaves/a/cert.pem")
    assert of_enclave(root, "certificate-not-last") is Severity.ERROR


def test_an_enclave_that_is_gone_but_not_revoked(root: Path) -> None:
    shutil.rmtree(root / "enclaves/a")
    assert of_enclave(root, "enclave-gone") is Severity.WARNING
    assert found(root, "enclave-gone", now=utc_now() + 11 * YEAR) == [], "its certificate has ended"
    remove(root, ["/b"], options=RemoveOptions(durable=False))
    assert of_enclave(root, "enclave-gone") is Severity.WARNING


def test_subjects_as_sros2_writes_them(root: Path, tmp_path: Path) -> None:
    assert found(root, "compatible-subjects") == []
    kit.filled(tmp_path / "other", ["/a"], subjects=SubjectScheme.COMPATIBLE)
    (one,) = found(tmp_path / "other", "compatible-subjects")
    assert one.severity is Severity.NOTE and "1 enclave with" in one.message and one.repair.count(" /a ") == 1


def test_a_domain_that_no_permissions_name(root: Path) -> None:
    both = Domains(((0, 1),))
    kit.filled(root, domains=both)
    assert found(root, "domain-unused") == []
    kit.filled(root, domains=both, enclave_domains={name: Domains.single(0) for name in ("/a", "/b")})
    (one,) = found(root, "domain-unused")
    assert one.severity is Severity.NOTE and "domains 1," in one.message


def test_what_somebody_decided_it_must_be(root: Path) -> None:
    default = Governance.for_domains(Domains.single(0))
    weaker = Governance((DomainRule(rtps_protection_kind=Protection.NONE),))
    pins = tuple(fingerprint(KeystoreView(root).ca(role).der) for role in Role)
    colons = tuple(":".join(pin[at : at + 2] for at in range(0, 64, 2)).upper() for pin in pins)
    for good in (Requirements(default), Requirements(authorities=pins), Requirements(authorities=colons)):
        assert verify(root, required=good).findings == ()
    (one,) = found(root, "governance-not-required", required=Requirements(weaker))
    assert one.severity is Severity.ERROR
    for role, pin in zip(Role, reversed(pins), strict=True):
        (one,) = found(root, "ca-not-required", required=Requirements(authorities=(pin,)))
        assert one.severity is Severity.ERROR and one.place == layout.ca_cert(role)


def test_keys_that_cyclone_dds_refuses(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:  # as another tool may make them
        patch.setattr(ec, "SECP256R1", ec.SECP384R1)
        other = kit.filled(tmp_path / "other", ["/a"])
    assert of_enclave_without_repair(other, "key-kind") is Severity.WARNING
    (kind,) = found(other, "ca-key-kind")
    assert kind.place == layout.ca_cert(Role.IDENTITY), "as permissions CA it takes any"
    assert kind.severity is Severity.WARNING and "P-384" in kind.message and verify(other).is_good
    assert found(root, "key-kind") == found(root, "ca-key-kind") == []


@pytest.mark.parametrize("role", Role)
@pytest.mark.parametrize(
    ("kind", "is_weak", "cyclone_takes"),
    [
        ("RSA-1024", True, False),
        ("RSA-2048", False, True),
        ("RSA-3072", False, False),
        ("P-224", True, False),
        ("P-256", False, True),
    ],
)
def test_a_ca_with_a_weak_key(
    tmp_path: Path, role: Role, kind: str, is_weak: bool, cyclone_takes: bool
) -> None:
    family, _, size = kind.partition("-")
    key = ("rsa:" + size,) if family == "RSA" else ("ec", "-pkeyopt", f"ec_paramgen_curve:{kind}")
    given = ImportedCa(tmp_path / "ca.pem", tmp_path / "ca.key")
    usage = ("-addext", "keyUsage=critical,keyCertSign,cRLSign,digitalSignature", "-subj", "/CN=ca")
    kit.openssl(
        "req", "-x509", "-newkey", *key, "-nodes", *usage, "-days", "9", "-keyout", tmp_path / "ca.key",
        "-out", given.certificate,
    )  # fmt: skip
    made = create_keystore(tmp_path / "ks", CreateOptions(durable=False, imported={role: given}))
    expected = {"weak-key": Severity.EXPOSURE} if is_weak else {}
    if role is Role.IDENTITY and not cyclone_takes:
        expected["ca-key-kind"] = Severity.WARNING
    assert {one.code: one.severity for one in verify(tmp_path / "ks").findings} == expected
    assert len(made.warnings) == len(expected) and all(kind in one for one in made.warnings)


def test_enclaves_with_weak_keys(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(ec, "SECP256R1", ec.SECP224R1)
        other = kit.filled(tmp_path / "other", ["/a"])
    weak = {one.place: one.severity for one in found(other, "weak-key")}
    places = ("enclaves/a/cert.pem", *(layout.ca_cert(role) for role in Role))
    assert weak == dict.fromkeys(places, Severity.EXPOSURE) and found(root, "weak-key") == []


def of_enclave_without_repair(root: Path, code: str) -> Severity:
    (one,) = found(root, code)
    assert one.place.startswith("enclaves/a")
    return one.severity


def test_a_ca_that_is_not_valid_now(root: Path) -> None:
    assert found(root, "ca-unfit", now=utc_now() + 9 * YEAR) == []
    unfit = found(root, "ca-unfit", now=utc_now() + 11 * YEAR)
    assert [one.place for one in unfit] == sorted(layout.ca_cert(role) for role in Role)
    assert all(one.severity is Severity.ERROR and "--ca start" in one.repair for one in unfit)
    assert found(root, "ca-unfit", now=utc_now() - YEAR) == [], "one that has not begun: the clock is wrong"


def test_a_ca_whose_own_signature_is_wrong(root: Path) -> None:
    place = root / layout.ca_cert(Role.IDENTITY)
    der = read_certificate(place.read_bytes()).der
    place.write_bytes(read_der(der[:-1] + bytes((der[-1] ^ 1,))).pem)
    (one,) = found(root, "ca-signature")
    assert one.severity is Severity.ERROR and one.place == layout.ca_cert(Role.IDENTITY)


def authority(root: Path, role: Role) -> Authority:
    return KeystoreView(root).authority(role, CaAccess())


class PromisingAuthority(Authority):
    """A CA that does not know when it ends."""

    validity = Validity.starting(utc_now(), 200 * YEAR)


def issued(root: Path, *, lifetime: timedelta = YEAR, hosts: Sequence[str] = ()) -> None:
    """Issue another certificate for the key of /a by our own CA, even one that outlives the CA."""
    ca = authority(root, Role.IDENTITY)
    public = public_half((root / "enclaves/a/key.pem").read_bytes(), "key")
    validity = Validity.starting(utc_now(), lifetime)
    made = PromisingAuthority(ca.facts, ca.key).issue("ros.a", public, validity, hosts)
    (root / "enclaves/a/cert.pem").write_bytes(made.pem)


def test_a_certificate_that_outlives_its_ca(root: Path) -> None:
    issued(root)
    assert found(root, "outlives-ca") == []
    issued(root, lifetime=100 * YEAR)
    assert of_enclave_without_repair(root, "outlives-ca") is Severity.WARNING


def test_an_enclave_that_could_play_the_router(root: Path) -> None:
    write_zenoh(root, ["/a", "/b"], options=kit.options())
    issued(root)
    assert found(root, "zenoh-impostor") == []
    issued(root, hosts=("localhost",))
    assert of_enclave(root, "zenoh-impostor") is Severity.EXPOSURE


def test_what_zenoh_cannot_grant(root: Path) -> None:
    write_zenoh(root, ["/a", "/b"], options=kit.options())
    assert found(root, "zenoh-gap") == []
    provision(root, [kit.policy("/a", "/camera/*"), kit.policy("/b", "/camera?")], options=kit.options())
    (one,) = found(root, "zenoh-gap")
    assert one.severity is Severity.WARNING and "enclave /b" in one.message and "/camera?" in one.message


def test_a_certificate_signed_with_a_broken_hash(root: Path, tmp_path: Path) -> None:
    request, extensions = tmp_path / "a.csr", tmp_path / "extensions"
    extensions.write_text("basicConstraints=CA:FALSE\n")
    kit.openssl("req", "-new", "-key", root / "enclaves/a/key.pem", "-subj", "/CN=ros.a", "-out", request)
    for digest in ("sha256", "sha1"):
        kit.openssl(
            "x509", "-req", "-in", request, f"-{digest}", "-days", "90", "-out", root / "enclaves/a/cert.pem",
            "-extfile", extensions, "-CA", root / layout.ca_cert(Role.IDENTITY),
            "-CAkey", root / layout.ca_key(Role.IDENTITY),
        )  # fmt: skip
        if digest == "sha256":
            assert found(root, "weak-signature") == []
    assert of_enclave(root, "weak-signature") is Severity.EXPOSURE


def with_another_certificate(document: bytes, root: Path) -> bytes:
    ca, other = authority(root, Role.PERMISSIONS), authority(root, Role.IDENTITY)
    signed = sign_document(document, ca)
    message = cms.ContentInfo.load(smime.read(signed, "x").pkcs7)
    carried = asn1crypto.x509.Certificate.load(other.facts.der)
    message["content"]["certificates"] = cms.CertificateSet([cms.CertificateChoices("certificate", carried)])
    return smime._framed(smime._content(document), message.dump(force=True))


def test_signed_permissions_with_another_certificate_in_them(root: Path) -> None:
    document = (root / "enclaves/a/permissions.xml").read_bytes()
    plain = sign_document(document, authority(root, Role.PERMISSIONS))
    (root / "enclaves/a/permissions.p7s").write_bytes(plain)
    assert verify(root).findings == ()
    (root / "enclaves/a/permissions.p7s").write_bytes(with_another_certificate(document, root))
    assert of_enclave(root, "embedded-differs") is Severity.ERROR


def permits(root: Path, old: str, new: str) -> set[str]:
    """The codes that are found in the permissions of /a, signed with this change."""
    twin = root / "enclaves/a/permissions.xml"
    assert old in twin.read_text()
    twin.write_text(twin.read_text().replace(old, new))
    signed = sign_document(twin.read_bytes(), authority(root, Role.PERMISSIONS))
    (root / "enclaves/a/permissions.p7s").write_bytes(signed)
    return {one.code for one in verify(root).findings} - {"permissions-not-last", "wildcard"}


def listed(*topics: str) -> str:
    return "</topic>\n<topic>".join(sorted({"ros_discovery_info", *topics}))


OPEN = [
    ("*",), ("**",), ("?*",), ("[!x]*",), ("r*",), ("*/*",), ("rt/*", "rq/*Request", "rr/*Reply"),
    ("r[a-q]/*", "r[r-z]/*"), tuple(f"r{kind}/{first}*" for kind in "qrt" for first in "acfprtxz"),
]  # fmt: skip


@pytest.mark.parametrize("topics", OPEN)
def test_a_grant_of_everything_in_any_spelling_and_in_parts(root: Path, topics: tuple[str, ...]) -> None:
    assert permits(root, listed("rt/chatter"), listed(*topics)) == {"everything"}
    assert of_enclave(root, "everything") is Severity.EXPOSURE
    (one,) = found(root, "everything")
    assert "* also matches /" in one.message


@pytest.mark.parametrize(
    "topics", [("rt/*",), ("rt/*", "rq/*Request"), ("rt/camera/*",), ("[!r]*",), ("*/image",), ("r",), ("?",)]
)
def test_a_grant_of_a_kind_of_topics_is_told_and_not_one_of_everything(
    root: Path, topics: tuple[str, ...]
) -> None:
    assert permits(root, listed("rt/chatter"), listed(*topics)) == set()
    told = [one.message for one in found(root, "wildcard")]
    assert len(told) == (topics != ("r",)) and all("* also matches /" in one for one in told)
    assert any("it may publish every topic" in one for one in told) == ("rt/*" in topics)


def test_who_is_denied_everything_is_not_granted_it(root: Path) -> None:
    provision(root, [kit.policy("/a")], options=kit.options())
    text = (root / "enclaves/a/permissions.xml").read_text()
    rule = text[text.index("<allow_rule>") : text.index("</allow_rule>") + len("</allow_rule>\n")]
    everything = rule.replace(listed("rt/chatter"), "*")
    assert (
        permits(root, rule, rule.replace("allow", "deny").replace(listed("rt/chatter"), "*") + everything)
        == set()
    )
    assert permits(root, rule.replace("allow", "deny").replace(listed("rt/chatter"), "*"), "") == {
        "everything"
    }


def test_a_copy_of_an_enclave_holds_a_second_key(root: Path) -> None:
    copy = root / "enclaves/a.bak"
    shutil.copytree(root / "enclaves/a", copy, symlinks=True)
    (one,) = found(root, "stray-key")
    assert one.severity is Severity.ERROR and one.place == "enclaves/a.bak/key.pem"
    (copy / "key.pem").unlink()
    assert found(root, "stray-key") == [] and verify(root).is_good, "what is left is a stray"


def test_a_governance_with_another_certificate_in_it(root: Path) -> None:
    document = (root / layout.GOVERNANCE_XML).read_bytes()
    (root / layout.GOVERNANCE).write_bytes(with_another_certificate(document, root))
    (one,) = found(root, "embedded-differs")
    assert one.severity is Severity.ERROR and one.place == layout.GOVERNANCE
