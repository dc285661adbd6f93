"""A check reads exactly what DDS implementations read: OpenSSL is the judge, for they read by OpenSSL.

Each attack is shown to work on OpenSSL first. The mutated files (some 2 700 in a run) may be refused at will;
whatever is accepted must be what OpenSSL reads.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from enclave_addons.deployment import export, export_hosts
from keystore import (
    CaAccess,
    DamagedKeystoreError,
    DomainRule,
    Governance,
    KeystoreError,
    Protection,
    RemoveOptions,
    RenewOptions,
    Role,
    provision,
    remove,
    renew,
    verify,
)
from keystore.disk import layout
from keystore.disk.crl_file import is_crl
from keystore.disk.view import KeystoreView
from keystore.formats.certificate import read_certificate, read_certificates
from keystore.formats.governance import governance_document
from keystore.signing import smime
from keystore.signing.public_key import is_our_form, key_matches
from keystore.steps.comparison import differences
from keystore.steps.inventory import governance_facts
from tests.dds import sros2_style
from tests.keystore.kit import filled, options, policy

GOVERNANCE, PERMISSIONS = layout.GOVERNANCE, "enclaves/a/permissions.p7s"
CERT, KEY, ANCHOR = "enclaves/a/cert.pem", "enclaves/a/key.pem", "public/identity_ca.cert.pem"


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """/a may publish a secret, and /b is not revoked yet."""
    root = filled(tmp_path_factory.mktemp("past") / "ks", ["/a", "/b", "/c"])
    provision(root, [policy("/a", "/chatter", "/secret")], options=options())
    remove(root, ["/c"], options=RemoveOptions(durable=False))
    return root


@pytest.fixture(scope="module")
def present(past: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("present") / "ks"
    shutil.copytree(past, root, symlinks=True)
    provision(root, [policy("/a", "/chatter")], options=options())
    remove(root, ["/b"], options=RemoveOptions(durable=False))
    return root


@pytest.fixture
def root(present: Path, tmp_path: Path) -> Path:
    (tmp_path / "place").mkdir()
    return Path(shutil.copytree(present, tmp_path / "place/ks", symlinks=True))


def openssl(*arguments: str | Path, data: bytes) -> bytes | None:
    """What openssl makes of it; None where it refuses."""
    done = subprocess.run(["openssl", *map(str, arguments)], input=data, capture_output=True, timeout=30)
    return done.stdout if done.returncode == 0 else None


def signed_text(p7s: bytes) -> bytes | None:
    """The document as OpenSSL, and so a DDS implementation, finds it."""
    found = openssl("smime", "-verify", "-text", "-noverify", data=p7s)
    return found.replace(b"\r\n", b"\n") if found is not None else None


def certificate(pem: bytes) -> bytes | None:
    return openssl("x509", "-outform", "DER", data=pem)


def crl(pem: bytes) -> bytes | None:
    return openssl("crl", "-outform", "DER", data=pem)


def private_key(pem: bytes) -> bytes | None:
    return openssl("pkey", "-pubout", "-outform", "DER", data=pem)


# The attacks, as they were found


def weak_governance(root: Path) -> bytes:
    """Signed here, once."""
    ca = KeystoreView(root).authority(Role.PERMISSIONS, CaAccess())
    rule = DomainRule(allow_unauthenticated_participants=True, rtps_protection_kind=Protection.NONE)
    return smime.sign_document(governance_document(Governance((rule,))), ca)


def two_boundaries(shown: bytes, read: bytes) -> bytes:
    """An earlier header speaks of the boundary of ``shown``, Content-Type of that of ``read``."""
    boundary = shown.partition(b'boundary="')[2].partition(b'"')[0]
    head, _, body = read.partition(b"This is an S/MIME signed message\r\n")
    return (
        b'X-Note: boundary="' + boundary + b'"\r\n' + head + shown.partition(b"\r\n\r\n")[2] + b"\r\n" + body
    )


def behind_a_remark(present: bytes, past: bytes) -> bytes:
    """The block in force is no block for OpenSSL; the older one is."""
    return b"".join(b"# " + line for line in present.splitlines(keepends=True)) + past


def relabelled(pem: bytes, label: bytes) -> bytes:
    old = pem.partition(b"-----BEGIN ")[2].partition(b"-----")[0]
    return pem.replace(b" " + old + b"-----", b" " + label + b"-----")


def foreign_ca() -> bytes:
    return sros2_style.issue("sros2CA", is_ca=True).certificate_pem


def governance_with_two_boundaries(root: Path, past: Path) -> None:
    shown, read = (root / GOVERNANCE).read_bytes(), weak_governance(root)
    attack = two_boundaries(shown, read)
    assert signed_text(attack) == smime.read(read, "read").document
    (root / GOVERNANCE).write_bytes(attack)


def permissions_with_two_boundaries(root: Path, past: Path) -> None:
    attack = two_boundaries((root / PERMISSIONS).read_bytes(), (past / PERMISSIONS).read_bytes())
    found = signed_text(attack)
    assert found is not None and b"rt/secret" in found
    (root / PERMISSIONS).write_bytes(attack)


def certificate_behind_a_remark(root: Path, past: Path) -> None:
    attack = behind_a_remark((root / CERT).read_bytes(), (past / CERT).read_bytes())
    assert (
        certificate(attack)
        == certificate((past / CERT).read_bytes())
        != certificate((root / CERT).read_bytes())
    )
    (root / CERT).write_bytes(attack)


def crl_behind_a_remark(root: Path, past: Path) -> None:
    attack = behind_a_remark((root / layout.CRL).read_bytes(), (past / layout.CRL).read_bytes())
    assert crl(attack) == crl((past / layout.CRL).read_bytes()) != crl((root / layout.CRL).read_bytes())
    (root / layout.CRL).write_bytes(attack)


def ca_under_an_old_label(root: Path, past: Path) -> None:
    extra = relabelled(foreign_ca(), b"X509 CERTIFICATE")
    assert certificate(extra) is not None
    (root / ANCHOR).write_bytes((root / ANCHOR).read_bytes() + extra)


def key_as(label: bytes) -> Callable[[Path, Path], None]:
    def change(root: Path, past: Path) -> None:
        other = relabelled((past / "enclaves/b/key.pem").read_bytes(), label)
        (root / KEY).write_bytes((root / KEY).read_bytes() + other)

    return change


ATTACKS: dict[str, Callable[[Path, Path], None]] = {
    "governance with two boundaries": governance_with_two_boundaries,
    "permissions with two boundaries": permissions_with_two_boundaries,
    "certificate behind a remark": certificate_behind_a_remark,
    "CRL behind a remark": crl_behind_a_remark,
    "CA labelled X509 CERTIFICATE": ca_under_an_old_label,
    "another's key labelled EC PARAMETERS": key_as(b"EC PARAMETERS"),
    "another's key labelled ANY PRIVATE KEY": key_as(b"ANY PRIVATE KEY"),
}


def test_what_is_as_it_was_written_passes_every_door(root: Path, tmp_path: Path) -> None:
    assert verify(root).findings == ()
    assert differences(root, policy("/a"), options=options()) == ()
    assert not provision(root, [policy("/a")], options=options()).changed
    assert export(root, tmp_path / "out", ["/a"]) == ("/a",)


@pytest.mark.parametrize("name", ATTACKS)
def test_no_door_says_good(name: str, root: Path, past: Path, tmp_path: Path) -> None:
    ATTACKS[name](root, past)
    assert not verify(root).is_good
    try:
        told = differences(root, policy("/a"), options=options())
    except KeystoreError:
        told = ("refused",)
    assert told, "before a process starts"
    for out, act in (
        (tmp_path / "out", lambda: export(root, tmp_path / "out", ["/a"])),
        (tmp_path / "hosts", lambda: export_hosts(root, tmp_path / "hosts", {"arm": ["/a"]})),
    ):
        with pytest.raises(KeystoreError):
            act()
        assert not out.exists()
    if "governance" in name:
        with pytest.raises(DamagedKeystoreError):
            governance_facts(root)  # what the evidence states


@pytest.mark.parametrize("name", ATTACKS)
def test_renew_repairs_it(name: str, root: Path, past: Path) -> None:
    ATTACKS[name](root, past)
    renew(root, ["/a"], options=RenewOptions(provisioning=options()))
    assert verify(root).is_good
    assert b"rt/secret" not in (signed_text((root / PERMISSIONS).read_bytes()) or b"rt/secret")


@pytest.mark.parametrize("name", ATTACKS)
def test_a_start_repairs_it_or_refuses(name: str, root: Path, past: Path) -> None:
    ATTACKS[name](root, past)
    try:
        provision(root, [policy("/a")], options=options())
    except KeystoreError:
        return
    assert verify(root).is_good


@pytest.mark.parametrize("name", ATTACKS)
def test_a_host_without_the_ca_refuses_to_start(name: str, root: Path, past: Path, tmp_path: Path) -> None:
    ATTACKS[name](root, past)
    shutil.rmtree(root / "private")
    with pytest.raises(KeystoreError):
        provision(root, [policy("/a")], options=options())


# Mutated files


def lines_of(data: bytes) -> list[bytes]:
    return data.splitlines(keepends=True)


def insert(data: bytes, position: int, line: bytes) -> bytes:
    lines = lines_of(data)
    at = position % (len(lines) + 1)
    return b"".join((*lines[:at], line, *lines[at:]))


def rewrapped(data: bytes, width: int) -> bytes:
    lines = lines_of(data)
    body = b"".join(line.strip() for line in lines[1:-1])
    wrapped = b"".join(body[at : at + width] + b"\n" for at in range(0, len(body), width))
    return b"".join((lines[0], wrapped, lines[-1])) if lines else data


INSERTED = (
    b"X-Note: y\r\n", b'X-Note: boundary="x"\r\n', b'Content-Type: multipart/signed; boundary="y"\r\n', b"\r\n",
    b"Proc-Type: 4,ENCRYPTED\n", b"# text\n", b" ", b"\t", b"=\n", b"--\r\n", b"-----BEGIN CERTIFICATE-----\n",
    b"-----END X509 CRL-----\n", b"\0", b"\xef\xbb\xbf",
)  # fmt: skip
LABELS = (
    b"CERTIFICATE", b"X509 CERTIFICATE", b"TRUSTED CERTIFICATE", b"X509 CRL", b"PRIVATE KEY", b"EC PRIVATE KEY",
    b"ANY PRIVATE KEY", b"EC PARAMETERS", b"PKCS7",
)  # fmt: skip

Mutation = Callable[[bytes, bytes], bytes]
mutations: st.SearchStrategy[Mutation] = st.one_of(
    st.builds(
        lambda at, line: lambda data, other: insert(data, at, line), st.integers(0, 60), st.sampled_from(INSERTED)
    ),
    st.builds(lambda label: lambda data, other: relabelled(data, label), st.sampled_from(LABELS)),
    st.builds(lambda width: lambda data, other: rewrapped(data, width), st.sampled_from((1, 40, 63, 65, 76, 5000))),
    st.sampled_from([
        lambda data, other: data + other,
        lambda data, other: other + data,
        lambda data, other: behind_a_remark(data, other),
        lambda data, other: two_boundaries(data, other),
        lambda data, other: two_boundaries(other, data),
        lambda data, other: other,
        lambda data, other: data.replace(b"\r\n", b"\n"),
        lambda data, other: data.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n"),
        lambda data, other: data.rstrip(b"\r\n"),
        lambda data, other: data + b"\n",
        lambda data, other: data.lower(),
    ]),
    st.builds(
        lambda at, byte: lambda data, other: data[: at % max(len(data), 1)] + byte + data[at % max(len(data), 1) + 1 :],
        st.integers(0, 4000),
        st.binary(min_size=0, max_size=2),
    ),
)  # fmt: skip
many = settings(
    max_examples=450, derandomize=True, deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip
chain = st.lists(mutations, min_size=1, max_size=4)


def mutated(data: bytes, other: bytes, steps: list[Mutation]) -> bytes:
    for step in steps:
        data = step(data, other)
    return data


def reads(read: Callable[[], bytes]) -> bytes | None:
    try:
        return read()
    except DamagedKeystoreError:
        return None


@many
@given(chain, st.sampled_from((GOVERNANCE, PERMISSIONS)))
def test_signed_documents(present: Path, past: Path, steps: list[Mutation], name: str) -> None:
    other = weak_governance(present) if name == GOVERNANCE else (past / name).read_bytes()
    file = mutated((present / name).read_bytes(), other, steps)
    ours = reads(lambda: smime.read(file, name).document)
    assert ours is None or ours == signed_text(file)


@many
@given(chain)
def test_certificates(present: Path, past: Path, steps: list[Mutation]) -> None:
    file = mutated((present / CERT).read_bytes(), (past / CERT).read_bytes(), steps)
    ours = reads(lambda: read_certificate(file).der)
    assert ours is None or ours == certificate(file)


@many
@given(chain)
def test_trust_anchors(present: Path, steps: list[Mutation]) -> None:
    """Fast DDS reads each block, Cyclone DDS the first: there must be no other than those that we see."""
    file = mutated((present / ANCHOR).read_bytes(), foreign_ca(), steps)
    ours = reads(lambda: b"".join(one.der for one in read_certificates(file, ANCHOR)))
    if ours is not None:
        blocks = file.count(b"-----BEGIN ")
        listed = openssl("crl2pkcs7", "-nocrl", "-certfile", "/dev/stdin", data=file) or b""
        assert ours.startswith(certificate(file) or b"?")
        found = openssl("pkcs7", "-print_certs", data=listed) or b""
        assert found.count(b"-----BEGIN CERTIFICATE-----") == blocks == len(read_certificates(file, ANCHOR))


@many
@given(chain)
def test_crls(present: Path, past: Path, steps: list[Mutation]) -> None:
    file = mutated((present / layout.CRL).read_bytes(), (past / layout.CRL).read_bytes(), steps)
    if is_crl(file):
        ours = x509.load_pem_x509_crl(file).public_bytes(serialization.Encoding.DER)
        assert ours == crl(file)


@many
@given(chain)
def test_private_keys(present: Path, past: Path, steps: list[Mutation]) -> None:
    facts = read_certificate((present / CERT).read_bytes())
    file = mutated((present / KEY).read_bytes(), (past / "enclaves/b/key.pem").read_bytes(), steps)
    if key_matches(file, facts):
        assert is_our_form(file) and private_key(file) == facts.public_key


@many
@given(chain)
def test_what_openssl_reads_differently_is_never_good(
    present: Path, past: Path, steps: list[Mutation]
) -> None:
    """The other way round, so that the judge is seen to work: OpenSSL is asked first."""
    original = (present / PERMISSIONS).read_bytes()
    file = mutated(original, (past / PERMISSIONS).read_bytes(), steps[:2])
    theirs = signed_text(file)
    if theirs is not None and theirs != signed_text_of(original):
        assert reads(lambda: smime.read(file, "x").document) in (None, theirs)


def signed_text_of(p7s: bytes) -> bytes:
    return smime.read(p7s, "x").document
