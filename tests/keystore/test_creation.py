"""Keystores made: own, imported, encrypted, completed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric import ec

from keystore import (
    CaAccess,
    CreateOptions,
    DomainRule,
    Domains,
    Governance,
    ImportedCa,
    InvalidInputError,
    NotAKeystoreError,
    Protection,
    Role,
    Secret,
    SigningUnavailableError,
    Validity,
    create_keystore,
    provision,
    verify,
)
from keystore.disk.view import KeystoreView
from keystore.signing import authority
from keystore.signing.authority import Authority
from keystore.signing.private_key import key_pem, new_key
from tests.keystore.kit import DAY, NOW, actions, created, mode, openssl, options, policy, snapshot

SENTENCE = b"correct horse battery staple"


def findings(root: Path, access: CaAccess | None = None) -> set[str]:
    return {finding.code for finding in verify(root, access=access).findings}


def test_a_keystore_without_enclaves_is_good(tmp_path: Path) -> None:
    root = created(tmp_path / "deep/er/ks")
    assert findings(root) == set()
    assert mode(root / "private") == 0o700


def test_creating_again_changes_nothing(tmp_path: Path) -> None:
    root = created(tmp_path / "ks")
    before = snapshot(root)
    assert create_keystore(root, CreateOptions(durable=False)).actions == ()
    assert snapshot(root) == before


@pytest.mark.parametrize("role", Role)
def test_a_lost_ca_certificate_is_restored_and_no_other_ca_made(tmp_path: Path, role: Role) -> None:
    root = created(tmp_path / "ks")
    provision(root, [policy("/a")], options=options())
    lost = root / "public" / f"{role.value}.cert.pem"
    before = lost.read_bytes()
    lost.unlink()
    assert create_keystore(root).actions == (f"{role.label} restored from the register",)
    assert lost.read_bytes() == before
    assert findings(root) == set()


def test_an_empty_directory_is_used(tmp_path: Path) -> None:
    assert findings(created(tmp_path)) == set()


def test_a_file_and_a_full_directory_are_not(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    for path in (tmp_path / "file", tmp_path):
        with pytest.raises(NotAKeystoreError):
            created(path)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_names_and_validity(tmp_path: Path) -> None:
    root = created(tmp_path / "ks", names={Role.IDENTITY: "acme robots"}, ca_lifetime=90 * DAY, now=NOW)
    ca = KeystoreView(root).ca(Role.IDENTITY)
    assert ca.common_name == "acme robots"
    assert ca.validity == Validity(NOW - DAY, NOW + 90 * DAY)
    assert "ASN1 OID: prime256v1" in openssl(
        "x509", "-noout", "-text", "-in", root / "public/identity_ca.cert.pem"
    )


def test_imported_cas_with_p384_are_warned_about(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(ec, "SECP256R1", ec.SECP384R1)
        imported = {role: made_ca(role, tmp_path)[1] for role in Role}
    report = create_keystore(tmp_path / "ks", CreateOptions(imported=imported, durable=False, now=NOW))
    (warning,) = report.warnings
    assert "identity CA key is P-384: Cyclone DDS refuses it" in warning, "a permissions CA may have any"


def test_domains_and_governance(tmp_path: Path) -> None:
    root = created(tmp_path / "a", domains=Domains.parse("3,7-9"))
    text = (root / "enclaves/governance.xml").read_text()
    assert "<domains><id>3</id><id_range><min>7</min><max>9</max></id_range></domains>" in text
    loose = Governance((DomainRule(rtps_protection_kind=Protection.NONE),))
    document = created(tmp_path / "b", governance=loose) / "enclaves/governance.xml"
    assert "<rtps_protection_kind>NONE<" in document.read_text()


def made_ca(role: Role, directory: Path, **kind: object) -> tuple[Authority, ImportedCa]:
    private = new_key()
    validity = Validity.starting(NOW, 9000 * DAY)
    made = authority.self_signed_ca(role, f"imported {role.value}", private, validity)
    cert, key = directory / f"{role.value}.crt", directory / f"{role.value}.key"
    cert.write_bytes(made.facts.pem)
    key.write_bytes(key_pem(private))
    return made, ImportedCa(cert, key)


def test_existing_cas_are_imported(tmp_path: Path) -> None:
    pairs = {role: made_ca(role, tmp_path) for role in Role}
    imported = {role: pair[1] for role, pair in pairs.items()}
    root = created(tmp_path / "ks", imported=imported, now=NOW)
    for role in Role:
        assert KeystoreView(root).ca(role).der == pairs[role][0].facts.der
    provision(root, [policy("/a")], options=options(now=NOW))
    assert verify(root, now=NOW).findings == ()


def test_importing_again_is_nothing_new_but_another_ca_is_refused(tmp_path: Path) -> None:
    _, mine = made_ca(Role.IDENTITY, tmp_path)
    root = created(tmp_path / "ks", imported={Role.IDENTITY: mine}, now=NOW)
    assert create_keystore(root, CreateOptions(imported={Role.IDENTITY: mine}, now=NOW)).actions == ()
    (tmp_path / "other").mkdir()
    _, other = made_ca(Role.IDENTITY, tmp_path / "other")
    with pytest.raises(InvalidInputError, match="renew KEYSTORE --ca start"):
        create_keystore(root, CreateOptions(imported={Role.IDENTITY: other}, now=NOW))


def test_cas_that_cannot_serve_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    made, pair = made_ca(Role.IDENTITY, tmp_path)
    swapped = {Role.PERMISSIONS: pair}  # may not sign documents
    with pytest.raises(InvalidInputError, match="digitalSignature"):
        created(tmp_path / "ks", imported=swapped, now=NOW)
    _, other = made_ca(Role.PERMISSIONS, tmp_path)
    with pytest.raises(SigningUnavailableError, match="do not belong together"):
        created(tmp_path / "ks2", imported={Role.IDENTITY: ImportedCa(pair.certificate, other.key)}, now=NOW)
    with pytest.raises(InvalidInputError, match="not valid now"):
        created(tmp_path / "ks3", imported={Role.IDENTITY: pair}, now=NOW - 90 * DAY)
    assert made.facts.common_name == "imported identity_ca"


def test_encrypted_ca_keys(tmp_path: Path) -> None:
    (tmp_path / "sentence").write_bytes(SENTENCE + b"\n")
    access = CaAccess(passphrase=Secret(file=tmp_path / "sentence"))
    root = created(tmp_path / "ks", encrypt_ca_keys=True, access=access)
    assert (
        (root / "private/identity_ca.key.pem")
        .read_bytes()
        .startswith(b"-----BEGIN ENCRYPTED PRIVATE KEY-----")
    )
    provision(root, [policy("/a")], options=options(access=access))
    assert findings(root, access) == set()
    assert findings(root) == {"ca-key-locked"}
    with pytest.raises(SigningUnavailableError, match="is encrypted; give its passphrase"):
        provision(root, [policy("/b")], options=options())
    assert not (root / "enclaves/b").exists()


def test_a_passphrase_encrypts_new_ca_keys_whoever_makes_them(tmp_path: Path) -> None:
    (tmp_path / "sentence").write_bytes(SENTENCE)
    access = CaAccess(passphrase=Secret(file=tmp_path / "sentence"))
    created(tmp_path / "ks", access=access)
    provision(tmp_path / "launched", [policy("/a")], options=options(access=access))
    created(tmp_path / "plain")
    for name, kind in (("ks", b"ENCRYPTED "), ("launched", b"ENCRYPTED "), ("plain", b"")):
        for role in Role:
            pem = (tmp_path / name / f"private/{role.value}.key.pem").read_bytes()
            assert pem.startswith(b"-----BEGIN " + kind + b"PRIVATE KEY-----")


def test_an_unreadable_passphrase_makes_no_keystore(tmp_path: Path) -> None:
    access = CaAccess(passphrase=Secret(file=tmp_path / "absent"))
    with pytest.raises(InvalidInputError, match="cannot read the passphrase"):
        created(tmp_path / "ks", access=access)
    with pytest.raises(InvalidInputError, match="cannot read the passphrase"):
        provision(tmp_path / "launched", [policy("/a")], options=options(access=access))
    assert not (tmp_path / "ks").exists() and not (tmp_path / "launched/public").exists()


def test_an_unchanged_launch_needs_no_passphrase(tmp_path: Path) -> None:
    (tmp_path / "sentence").write_bytes(SENTENCE)
    access = CaAccess(passphrase=Secret(file=tmp_path / "sentence"))
    root = created(tmp_path / "ks", encrypt_ca_keys=True, access=access)
    provision(root, [policy("/a")], options=options(access=access))
    assert not provision(root, [policy("/a")], options=options()).changed


def test_a_wrong_passphrase_is_told_without_showing_anything(tmp_path: Path) -> None:
    (tmp_path / "sentence").write_bytes(SENTENCE)
    right = CaAccess(passphrase=Secret(file=tmp_path / "sentence"))
    root = created(tmp_path / "ks", encrypt_ca_keys=True, access=right)
    (tmp_path / "wrong").write_bytes(b"tr0ub4dor")
    wrong = CaAccess(passphrase=Secret(file=tmp_path / "wrong"))
    with pytest.raises(SigningUnavailableError, match="is the passphrase right") as caught:
        provision(root, [policy("/a")], options=options(access=wrong))
    assert {finding.repair for finding in verify(root, access=wrong).findings} == {
        "give the passphrase or PIN that belongs to it, or restore it from a backup"
    }
    frames = [entry.frame.f_locals for entry in caught.traceback]
    assert "tr0ub4dor" not in repr(frames) + str(caught.value) + repr(wrong)
    assert caught.value.__cause__ is None and caught.value.__suppress_context__


def test_passphrases_from_descriptor_and_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    reading, writing = os.pipe()
    os.write(writing, SENTENCE + b"\n")
    os.close(writing)
    secret = Secret(descriptor=reading)
    assert secret.value() == SENTENCE
    assert secret.value() == SENTENCE, "read once, remembered"
    os.close(reading)
    monkeypatch.setenv("KEYSTORE_SENTENCE", SENTENCE.decode())
    assert Secret(variable="KEYSTORE_SENTENCE").value() == SENTENCE
    with pytest.raises(InvalidInputError, match=r"\$NOT_SET"):
        Secret(variable="NOT_SET").value()


def test_no_key_material_in_representations(monkeypatch: pytest.MonkeyPatch) -> None:
    key = new_key()
    secret = Secret(variable="X")
    monkeypatch.setenv("X", SENTENCE.decode())
    assert secret.value() == SENTENCE
    made = authority.self_signed_ca(Role.IDENTITY, "x", key, Validity.starting(NOW, DAY))
    shown = repr((key, made, secret, CaAccess(passphrase=secret)))
    assert SENTENCE.decode() not in shown and "PRIVATE" not in shown and "$X" in shown


def test_a_key_without_certificate_is_kept(tmp_path: Path) -> None:
    """What an interrupted `ros2 security create_keystore` leaves: the key is written first."""
    root = created(tmp_path / "ks")
    key = (root / "private/identity_ca.key.pem").read_bytes()
    (root / "public/identity_ca.cert.pem").unlink()
    created(root)
    assert (root / "private/identity_ca.key.pem").read_bytes() == key
    assert findings(root) == set()


def test_where_the_ca_keys_are_not_nothing_is_signed_but_a_launch_works(tmp_path: Path) -> None:
    root = created(tmp_path / "ks")
    provision(root, [policy("/a")], options=options())
    for path in (root / "private").iterdir():
        path.unlink()
    (root / "private").rmdir()
    assert actions(provision(root, [policy("/a")], options=options())) == {}
    with pytest.raises(
        SigningUnavailableError, match=r"has no CA keys.*(?s:.)*/a: other permissions; lacks publish rt/new"
    ):
        provision(root, [policy("/a", "/new")], options=options())
    assert findings(root) == {"no-ca-key"}


def test_sros2_accepts_ours(tmp_path: Path) -> None:
    """The five files its is_valid_keystore demands, and the glob of its list_enclaves."""
    root = created(tmp_path / "ks")
    provision(root, [policy("/a/b")], options=options())
    for name in ("public/permissions_ca.cert.pem", "public/identity_ca.cert.pem", "private/permissions_ca.key.pem",
                 "private/identity_ca.key.pem", "enclaves/governance.p7s"):  # fmt: skip
        assert (root / name).is_file()
    assert [path.parent.name for path in (root / "enclaves").glob("**/key.pem")] == ["b"]


def test_keys_never_travel_in_arguments() -> None:
    """The command offers no option that takes a secret itself."""
    done = subprocess.run(
        [sys.executable, "-m", "keystore.verb", "create", "--help"], capture_output=True, text=True
    )
    offered = {word.strip("[],") for word in done.stdout.split() if word.strip("[").startswith("--")}
    secrets = {word for word in offered if "pass" in word or "pin" in word}
    assert secrets == {
        "--ca-passphrase-file",
        "--ca-passphrase-fd",
        "--ca-passphrase-env",
        "--pin-file",
        "--pin-env",
    }
