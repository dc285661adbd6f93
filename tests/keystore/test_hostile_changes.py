"""Some eighty kinds of hostile or corrupt change to a keystore: none that matters ends in "good".

Each is what a thief, a careless backup, an editor or a failing disk leaves behind; beside them the changes that harm
nobody, which stay good.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID

from enclave_addons.deployment import PublicFiles, export
from keystore import (
    CaAccess,
    DomainRule,
    Domains,
    Governance,
    Protection,
    RemoveOptions,
    Requirements,
    Role,
    Severity,
    TopicRule,
    remove,
    verify,
)
from keystore.disk.view import KeystoreView
from keystore.formats.governance import governance_document
from tests.dds import sros2_style
from tests.keystore.kit import filled, options, policy, snapshot
from tests.keystore.test_verification import by_an_enclave, resign, sign

Change = Callable[[Path], object]
CERT, KEY, CA_KEY = "enclaves/a/cert.pem", "enclaves/a/key.pem", "private/identity_ca.key.pem"
ANCHOR = "public/identity_ca.cert.pem"


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The keystore before enclave /gone was removed and /a lost a topic."""
    from keystore import provision

    root = filled(tmp_path_factory.mktemp("past") / "ks", ["/a", "/b", "/a/c", "/gone", "/old"])
    provision(root, [policy("/a", "/chatter", "/secret")], options=options())
    remove(root, ["/old"], options=RemoveOptions(durable=False))
    return root


@pytest.fixture(scope="module")
def present(past: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    from keystore import provision

    root = tmp_path_factory.mktemp("present") / "ks"
    shutil.copytree(past, root, symlinks=True)
    provision(root, [policy("/a", "/chatter")], options=options())
    remove(root, ["/gone"], options=RemoveOptions(durable=False))
    return root


# How a change is made


def append(name: str, content: bytes | Callable[[Path], bytes]) -> Change:
    def change(root: Path) -> None:
        more = content(root) if callable(content) else content
        (root / name).write_bytes((root / name).read_bytes() + more)

    return change


def of(name: str) -> Callable[[Path], bytes]:
    return lambda root: (root / name).read_bytes()


def der_of(name: str) -> Callable[[Path], bytes]:
    def content(root: Path) -> bytes:
        key = serialization.load_pem_private_key((root / name).read_bytes(), None)
        encoding, none = serialization.Encoding.DER, serialization.NoEncryption()
        return key.private_bytes(encoding, serialization.PrivateFormat.TraditionalOpenSSL, none)

    return content


def new(name: str, content: Callable[[Path], bytes]) -> Change:
    return lambda root: (root / name).write_bytes(content(root))


def bare_base64(root: Path) -> bytes:
    return b"backup:\n" + b"".join((root / KEY).read_bytes().splitlines()[1:-1]) + b"\n"


def back(name: str) -> Callable[[Path, Path], object]:
    def change(root: Path, past: Path) -> None:
        (root / name).unlink(missing_ok=True)
        shutil.copy(past / name, root / name, follow_symlinks=False)

    return change


def govern(governance: Governance) -> Change:
    def change(root: Path) -> None:
        document = governance_document(governance)
        (root / "enclaves/governance.xml").write_bytes(document)
        (root / "enclaves/governance.p7s").write_bytes(sign(root, document))

    return change


def govern_domain(**changes: object) -> Change:
    return govern(Governance((DomainRule(**changes),)))  # type: ignore[arg-type]


def govern_topic(**changes: object) -> Change:
    return govern_domain(topic_rules=(TopicRule(**changes),))  # type: ignore[arg-type]


NONE = Protection.NONE


def certify(
    *, is_ca: bool = False, usage: str = "digital_signature", extended: bool = True, key_of: str = KEY
) -> Change:
    """A certificate that the identity CA signed, because somebody had its key for an hour."""

    def change(root: Path) -> None:
        old = x509.load_pem_x509_certificate((root / CERT).read_bytes())
        ca = KeystoreView(root).authority(Role.IDENTITY, CaAccess())
        signer = serialization.load_pem_private_key((root / "private/identity_ca.key.pem").read_bytes(), None)
        key = serialization.load_pem_private_key((root / key_of).read_bytes(), None)
        builder = (
            x509.CertificateBuilder()
            .subject_name(old.subject)
            .issuer_name(x509.load_der_x509_certificate(ca.facts.der).subject)
            .serial_number(x509.random_serial_number())
            .not_valid_before(ca.validity.not_before + timedelta(days=1))
            .not_valid_after(ca.validity.not_after - timedelta(days=1))
            .public_key(key.public_key())  # type: ignore[arg-type]
            .add_extension(x509.BasicConstraints(ca=is_ca, path_length=None), critical=True)
        )
        if usage:
            names = ("digital_signature", "content_commitment", "key_encipherment", "data_encipherment",
                     "key_agreement", "key_cert_sign", "crl_sign", "encipher_only", "decipher_only")  # fmt: skip
            flags = {name: name == usage for name in names}
            builder = builder.add_extension(x509.KeyUsage(**flags), critical=True)
        if extended:
            oids = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
            builder = builder.add_extension(x509.ExtendedKeyUsage(oids), critical=False)
        made = builder.sign(signer, hashes.SHA256())  # type: ignore[arg-type]
        (root / CERT).write_bytes(made.public_bytes(serialization.Encoding.PEM))
        (root / KEY).write_bytes((root / key_of).read_bytes())

    return change


def foreign_ca(root: Path) -> bytes:
    return sros2_style.issue("sros2CA", is_ca=True).certificate_pem


def first_foreign_ca(root: Path) -> None:
    anchor = root / "public/identity_ca.cert.pem"
    anchor.write_bytes(foreign_ca(root) + anchor.read_bytes())


def key_in_der(root: Path) -> None:
    (root / KEY).write_bytes(der_of(KEY)(root))


def certificate_in_der(root: Path) -> None:
    certificate = x509.load_pem_x509_certificate((root / CERT).read_bytes())
    (root / CERT).write_bytes(certificate.public_bytes(serialization.Encoding.DER))


def fresh_key(root: Path) -> bytes:
    none = serialization.NoEncryption()
    key = ec.generate_private_key(ec.SECP256R1())
    return key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, none)


def both_enclaves_one_key(root: Path) -> None:
    certify(key_of="enclaves/b/key.pem")(root)


def with_a_key_of_the_ca(root: Path) -> None:
    certify(key_of="private/permissions_ca.key.pem")(root)


def without_crl(root: Path) -> None:
    for path in [root / "public/crl.pem", *root.glob("enclaves/**/crl.pem")]:
        path.unlink()


def open_parent(root: Path) -> None:
    root.parent.chmod(0o777)


def of_another_user(name: str) -> Change:
    return lambda root: os.chown(root / name, 65534, 65534)


def hard_link(name: str) -> Change:
    return lambda root: os.link(root / name, root.parent / "kept")


def truncated(name: str) -> Change:
    return lambda root: os.truncate(root / name, 100)


def changed_at(name: str, before: bytes) -> Change:
    """One character behind ``before`` is another one."""

    def change(root: Path) -> None:
        content = bytearray((root / name).read_bytes())
        at = content.index(before) + len(before)
        content[at] = ord("A") if content[at] != ord("A") else ord("B")
        (root / name).write_bytes(content)

    return change


ROOT_ONLY = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")


def swapped_before(name: str, end: bytes) -> Change:
    """The last two different characters before ``end`` change places."""

    def change(root: Path) -> None:
        content = bytearray((root / name).read_bytes())
        at = content.rindex(end) - 8
        while content[at] == content[at - 1]:
            at -= 1
        content[at - 1], content[at] = content[at], content[at - 1]
        (root / name).write_bytes(content)

    return change


HOSTILE: dict[str, tuple[str, Change]] = {
    # private keys where they do not belong, in whatever form
    "key behind a certificate": ("private-key", append(CERT, of(KEY))),
    "key in the CRL": ("private-key", append("public/crl.pem", of(KEY))),
    "key in the trust anchor": ("private-key", append(ANCHOR, of(CA_KEY))),
    "key in a signed document": ("private-key", append("enclaves/a/permissions.p7s", of(KEY))),
    "key in a comment of the XML": (
        "private-key", append("enclaves/a/permissions.xml", lambda root: b"<!--" + of(KEY)(root) + b"-->"),
    ),
    "key in the settings": ("private-key", append("secure-keystore.json", of(KEY))),
    "key in DER behind a certificate": ("private-key", append(CERT, der_of(KEY))),
    "key in bare base64 behind a certificate": ("private-key", append(CERT, bare_base64)),
    "key in DER among the public files": ("stray-key", new("public/k.bin", der_of(KEY))),
    "key far behind text": ("stray-key", new("public/notes.txt", lambda r: b"x" * 100_000 + b"\n" + of(KEY)(r))),
    "key in bare base64 as a note": ("stray-key", new("enclaves/a/note", bare_base64)),
    "CA key in an enclave": ("stray-key", new("enclaves/a/ca.key.pem", of(CA_KEY))),
    "CA key as an editor's backup": ("stray-key", new("private/identity_ca.key.pem~", of(CA_KEY))),
    # another form than ours, in which DDS implementations may read something else
    "text before a certificate": (
        "other-form",
        lambda root: (root / CERT).write_bytes(b"for robot 1\n" + (root / CERT).read_bytes()),
    ),
    # more, or something else, than one block
    "two certificates": ("several-blocks", append(CERT, of("enclaves/b/cert.pem"))),
    "the CA behind the certificate": ("several-blocks", append(CERT, of(ANCHOR))),
    "two keys": ("several-blocks", append(KEY, of("enclaves/b/key.pem"))),
    "certificate behind the key": ("several-blocks", append(KEY, of(CERT))),
    "two CRLs": ("several-blocks", append("public/crl.pem", of("public/crl.pem"))),
    "CRL in the trust anchor": ("several-blocks", append(ANCHOR, of("public/crl.pem"))),
    "two keys of a CA": ("several-blocks", append(CA_KEY, fresh_key)),
    "key in DER": ("key", key_in_der),
    "certificate in DER": ("certificate", certificate_in_der),
    # certificates that say too much
    "certificate of a CA": ("leaf-is-ca", certify(is_ca=True)),
    "may sign certificates": ("leaf-can-certify", certify(usage="key_cert_sign")),
    "may sign CRLs": ("leaf-can-certify", certify(usage="crl_sign")),
    "may not sign": ("key-usage", certify(usage="key_agreement")),
    "without key usage": ("no-key-usage", certify(usage="")),
    "without extended key usage": ("no-extended-key-usage", certify(extended=False)),
    "another certificate by our CA": ("not-issued-here", certify()),
    "key of another enclave": ("shared-key", both_enclaves_one_key),
    "key of a CA": ("shared-key", with_a_key_of_the_ca),
    # trust anchors
    "second CA": ("foreign-ca", append(ANCHOR, foreign_ca)),
    "second permissions CA": ("foreign-ca", append("public/permissions_ca.cert.pem", foreign_ca)),
    "another CA in front": ("foreign-ca", first_foreign_ca),
    "anchors swapped": ("foreign-ca", new(ANCHOR, of("public/permissions_ca.cert.pem"))),
    # governance
    "unauthenticated participants": (
        "governance-weak", govern_domain(allow_unauthenticated_participants=True, rtps_protection_kind=NONE),
    ),
    "no join control": ("governance-weak", govern_domain(enable_join_access_control=False)),
    "discovery in clear": ("governance-weak", govern_domain(discovery_protection_kind=NONE)),
    "discovery signed only": ("governance-weak", govern_domain(discovery_protection_kind=Protection.SIGN)),
    "liveliness in clear": ("governance-weak", govern_domain(liveliness_protection_kind=NONE)),
    "messages in clear": ("governance-weak", govern_domain(rtps_protection_kind=NONE)),
    "endpoints announced in clear": ("governance-weak", govern_topic(enable_discovery_protection=False)),
    "liveliness of topics in clear": ("governance-weak", govern_topic(enable_liveliness_protection=False)),
    "everybody reads": ("governance-weak", govern_topic(enable_read_access_control=False)),
    "everybody writes": ("governance-weak", govern_topic(enable_write_access_control=False)),
    "headers in clear": ("governance-weak", govern_topic(metadata_protection_kind=NONE)),
    "data in clear": ("governance-weak", govern_topic(data_protection_kind=NONE)),
    "data of one topic in clear": (
        "governance-weak", govern_topic(topic_expression="rt/camera", data_protection_kind=NONE),
    ),
    "governance for another domain": ("domain-not-governed", govern_domain(domains=Domains.single(7))),
    "another governance by our CA": ("governance-not-last", govern_domain(rtps_protection_kind=Protection.ENCRYPT)),
    # permissions
    "default ALLOW": ("other-form", lambda root: resign(root, b"<default>DENY", b"<default>ALLOW")),
    "every topic": (
        "everything", lambda root: resign(root, b"<publish><topics>\n", b"<publish><topics>\n<topic>*</topic>\n"),
    ),
    "another topic by our CA": ("permissions-not-last", lambda root: resign(root, b"rt/chatter", b"rt/cmd_vel")),
    "permissions for every domain": (
        "domain-not-governed",
        lambda root: resign(root, b"<id>0</id>", b"<id_range><min>0</min><max>230</max></id_range>"),
    ),
    "signed by an enclave": ("permissions", by_an_enclave),
    # who else can change it
    "parent open to everybody": ("replaceable", open_parent),
    "second name of a key": ("hard-link", hard_link(KEY)),
    "second name of a CA key": ("hard-link", hard_link(CA_KEY)),
    "second name of the register": ("hard-link", hard_link("private/register.json")),
    # the register and the files of a failing disk
    "register lost": ("no-register", lambda root: (root / "private/register.json").unlink()),
    "register garbled": ("register", truncated("private/register.json")),
    "register open to others": ("readable-by-others", lambda root: (root / "private/register.json").chmod(0o644)),
    "certificate cut off": ("certificate", truncated(CERT)),
    "permissions cut off": ("permissions", truncated("enclaves/a/permissions.p7s")),
    "a character of a certificate": ("certificate", changed_at(CERT, b"-----\nMIIB")),
    "a character of the last line of a certificate": ("wrong-ca", swapped_before(CERT, b"\n-----END")),
    "a character of what is signed": ("permissions", changed_at("enclaves/a/permissions.p7s", b"<topic>rt/")),
    "a character of the signature": ("permissions", swapped_before("enclaves/a/permissions.p7s", b"\r\n\r\n------")),
    "a character of the type": ("permissions", changed_at("enclaves/a/permissions.p7s", b"multipart/sig")),
    "a character of the second type": ("other-form", changed_at("enclaves/a/permissions.p7s", b"Type: application/x")),
    "a character of the governance": ("governance", changed_at("enclaves/governance.p7s", b"<id>")),
    "CRL deleted everywhere": ("crl-not-last", without_crl),
}  # fmt: skip

PUT_BACK: dict[str, tuple[str, Callable[[Path, Path], object]]] = {
    "an older CRL": ("crl-not-last", back("public/crl.pem")),
    "older permissions": ("permissions-not-last", back("enclaves/a/permissions.p7s")),
    "an older register": ("permissions-not-last", back("private/register.json")),
    "a removed enclave": (
        "revoked", lambda root, past: shutil.copytree(past / "enclaves/gone", root / "enclaves/gone", symlinks=True)
    ),
    "everything public": (
        "crl-not-last", lambda root, past: shutil.copytree(past / "public", root / "public", dirs_exist_ok=True)
    ),
}  # fmt: skip

GIVEN_AWAY = [
    "enclaves/a/cert.pem",
    "enclaves/a",
    "enclaves/governance.p7s",
    "public",
    "enclaves/a/key.pem",
    ".",
]

HARMLESS: dict[str, Change] = {
    "modes closed further": lambda root: (root / CERT).chmod(0o400),
    "an empty note": lambda root: (root / "README").write_text("who to call"),
    "times touched": lambda root: os.utime(root / KEY, (0, 0)),
}


def copy_of(present: Path, tmp_path: Path) -> Path:
    root = tmp_path / "place" / "ks"
    shutil.copytree(present, root, symlinks=True)
    return root


def assert_not_good(root: Path, code: str, name: str) -> None:
    found = {finding.code: finding for finding in verify(root).findings}
    assert code in found, found.keys()
    assert found[code].repair, name
    assert found[code].severity in (Severity.ERROR, Severity.EXPOSURE) or not verify(root).is_good


def test_the_keystore_itself_is_good(present: Path) -> None:
    assert verify(present).findings == ()


@pytest.mark.parametrize("name", HOSTILE)
def test_nothing_that_matters_ends_in_good(name: str, present: Path, tmp_path: Path) -> None:
    code, change = HOSTILE[name]
    root = copy_of(present, tmp_path)
    change(root)
    assert_not_good(root, code, name)


@pytest.mark.parametrize("name", PUT_BACK)
def test_what_is_put_back_is_told_from_what_was_issued_last(
    name: str, present: Path, past: Path, tmp_path: Path
) -> None:
    code, change = PUT_BACK[name]
    root = copy_of(present, tmp_path)
    change(root, past)
    assert_not_good(root, code, name)


@ROOT_ONLY
@pytest.mark.parametrize("name", GIVEN_AWAY)
def test_what_belongs_to_another_user_is_an_error(name: str, present: Path, tmp_path: Path) -> None:
    root = copy_of(present, tmp_path)
    of_another_user(name)(root)
    codes = {finding.code for finding in verify(root).findings if finding.severity is Severity.ERROR}
    assert codes & {"foreign-owner", "unsafe-owner"}


@pytest.mark.parametrize("name", GIVEN_AWAY)
def test_a_start_refuses_what_belongs_to_another_user(name: str, present: Path, tmp_path: Path) -> None:
    from keystore import UnsafeKeystoreError, provision

    root = copy_of(present, tmp_path)
    provision(root, [policy("/a", "/chatter")], options=options())
    of_another_user(name)(root)
    with pytest.raises(UnsafeKeystoreError, match=r"belongs to user 65534.*chown -R 0"):
        provision(root, [policy("/a", "/chatter")], options=options())
    if name.startswith("enclaves/a"):  # that of another enclave is no concern of this start
        provision(root, [policy("/b", "/chatter")], options=options())


@pytest.mark.parametrize("mode", [0o777, 0o755], ids=["open", "closed"])
def test_the_folder_of_a_link_is_judged_as_the_folders_above(
    mode: int, present: Path, tmp_path: Path
) -> None:
    from keystore import provision

    root = copy_of(present, tmp_path)
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(mode)
    link = tmp_path / "shared" / "ks"
    link.symlink_to(root)
    second = tmp_path / "second"
    second.symlink_to(link)
    beside = tmp_path / "beside"  # a link to a link of the same folder
    beside.symlink_to(second)
    is_open = mode == 0o777
    for given in (link, second, beside):
        assert {(finding.code, finding.place) for finding in verify(given).findings} == (
            {("replaceable", str(tmp_path / "shared"))} if is_open else set()
        )
        report = provision(given, [policy("/a", "/chatter")], options=options())
        assert any("put another keystore in this place" in text for text in report.warnings) is is_open
    assert verify(root).is_good


@pytest.mark.parametrize("name", HARMLESS)
def test_what_harms_nobody_stays_good(name: str, present: Path, tmp_path: Path) -> None:
    root = copy_of(present, tmp_path)
    HARMLESS[name](root)
    assert verify(root).is_good


def test_verify_changes_nothing(present: Path) -> None:
    before = snapshot(present)
    verify(present)
    assert snapshot(present) == before


@pytest.mark.parametrize("public", PublicFiles)
def test_a_bundle_is_verified_by_itself(public: PublicFiles, present: Path, tmp_path: Path) -> None:
    (tmp_path / "host").mkdir()
    bundle = tmp_path / "host" / "bundle"
    export(present, bundle, ["/a"], public=public)
    report = verify(bundle)
    assert report.is_good and {finding.code for finding in report.findings} == {"no-ca-key"}
    assert "SHA-256" in report.findings[0].message
    append(ANCHOR, foreign_ca)(bundle)
    assert "several-cas" in {finding.code for finding in verify(bundle).findings}
    assert not verify(bundle).is_good


def test_the_cas_of_a_bundle_can_be_pinned(present: Path, tmp_path: Path) -> None:
    export(present, tmp_path / "bundle", ["/a"])
    pins = [
        x509.load_pem_x509_certificate((present / f"public/{role.value}.cert.pem").read_bytes())
        .fingerprint(hashes.SHA256())
        .hex(":")
        .upper()
        for role in Role
    ]
    assert verify(tmp_path / "bundle", required=Requirements(authorities=tuple(pins))).is_good
    assert not verify(tmp_path / "bundle", required=Requirements(authorities=(pins[0],))).is_good


@pytest.mark.parametrize("name", ["second CA", "key behind a certificate", "default ALLOW", "data in clear"])
def test_nothing_of_it_is_exported(name: str, present: Path, tmp_path: Path) -> None:
    from keystore import DamagedKeystoreError

    root = copy_of(present, tmp_path)
    HOSTILE[name][1](root)
    with pytest.raises(DamagedKeystoreError):
        export(root, tmp_path / "out", ["/a"])
    assert not (tmp_path / "out").exists()


EXPOSED_AT_LAUNCH: dict[str, tuple[str, Change]] = {
    "parent open to everybody": ("put another keystore in this place", open_parent),
    "CA keys readable": ("the CA keys can be read by others", lambda root: (root / CA_KEY).chmod(0o644)),
}


@pytest.mark.parametrize("name", EXPOSED_AT_LAUNCH)
def test_a_launch_says_what_is_exposed_though_nothing_is_to_be_done(
    name: str, present: Path, tmp_path: Path
) -> None:
    from keystore import provision

    told, change = EXPOSED_AT_LAUNCH[name]
    root = copy_of(present, tmp_path)
    assert not provision(root, [policy("/a", "/chatter")], options=options()).warnings
    change(root)
    report = provision(root, [policy("/a", "/chatter")], options=options())
    assert [warning for warning in report.warnings if told in warning]


def test_a_launch_says_where_its_governance_is_weak(present: Path, tmp_path: Path) -> None:
    from keystore import ChangeOptions, provision, set_governance

    root = copy_of(present, tmp_path)
    weak = Governance((DomainRule(rtps_protection_kind=NONE),))
    set_governance(root, weak, options=ChangeOptions(durable=False))
    for _ in range(2):
        report = provision(root, [policy("/a", "/chatter")], options=options())
        assert any("rtps_protection_kind NONE" in warning for warning in report.warnings)
