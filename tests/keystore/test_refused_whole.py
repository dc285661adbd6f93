"""A change that cannot be completed is refused before its first write: the keystore stays as it was, and works."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from keystore import Role, Step, renew, roll_over, verify
from keystore.signing.ca_access import CaAccess, Secret
from keystore.verb import main
from tests.dds import sros2_style
from tests.keystore.kit import codes, filled, openssl, options, snapshot

NAMES = ("/robot/talker", "/talker")


@pytest.fixture
def sros2(tmp_path: Path) -> Path:
    grants = {name: sros2_style.Grant(publish=("/chatter",)) for name in NAMES}
    sros2_style.create(tmp_path / "sros2", 0, grants)
    return tmp_path / "sros2"


@pytest.fixture
def secret(tmp_path: Path) -> Path:
    (tmp_path / "passphrase").write_text("correct horse\n")
    return tmp_path / "passphrase"


def refused(root: Path, capsys: pytest.CaptureFixture[str], *words: str, status: int = 1) -> str:
    """The one line that is told; nothing in the keystore is touched."""
    before = snapshot(root)
    capsys.readouterr()
    assert main([words[0], str(root), *words[1:]]) == status
    told = capsys.readouterr()
    assert snapshot(root) == before
    assert told.out == "" and told.err.count("\n") == 1
    return told.err


def first_lines(root: Path, pattern: str = "private/*.key.pem") -> set[str]:
    return {file.read_text().partition("\n")[0] for file in root.glob(pattern)}


PLAIN, ENCRYPTED = "-----BEGIN PRIVATE KEY-----", "-----BEGIN ENCRYPTED PRIVATE KEY-----"


@pytest.mark.parametrize("named", [(), ("/talker",)])
@pytest.mark.parametrize("private", ["gone", "empty"])
def test_an_sros2_keystore_on_a_robot_is_repaired_elsewhere(
    sros2: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], private: str, named: tuple[str, ...]
) -> None:
    robot = tmp_path / "robot"
    shutil.copytree(sros2, robot, symlinks=True)
    shutil.rmtree(robot / "private")
    if private == "empty":
        (robot / "private").mkdir()
    told = refused(robot, capsys, "renew", *named)
    assert "private/identity_ca.key.pem" in told
    assert "is not here, so nothing can be signed; run this where the CA keys are, then deploy" in told
    assert main(["renew", str(sros2), *named]) == 0, "there it is repaired"
    assert "shared-ca" not in codes(sros2)


def test_a_deployed_copy_starts_no_ca(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = filled(tmp_path / "ks")
    assert main(["export", str(root), "-o", str(tmp_path / "robot"), "--enclave", "*"]) == 0
    for role in ("both", "identity", "permissions"):
        told = refused(tmp_path / "robot", capsys, "renew", "--ca", "start", "--ca-role", role)
        assert "private/permissions_ca.key.pem" in told and "then deploy" in told
    assert not (tmp_path / "robot/private").exists()
    assert main(["renew", str(root), "--ca", "start"]) == 0


@pytest.mark.parametrize("role", ["both", "identity", "permissions"])
def test_locked_ca_keys_start_and_switch_no_ca(
    tmp_path: Path, secret: Path, capsys: pytest.CaptureFixture[str], role: str
) -> None:
    root, given = tmp_path / "ks", ("--passphrase-file", str(secret))
    assert main(["create", str(root), "--encrypt-ca-keys", *given]) == 0
    assert main(["create-enclave", str(root), "/a", *given]) == 0
    step = ("renew", "--ca-role", role, "--ca")
    (tmp_path / "wrong").write_text("tr0ub4dor")
    for name in ("start", "switch"):
        assert "is encrypted; give its passphrase" in refused(root, capsys, *step, name) or name == "switch"
        told = refused(root, capsys, *step, name, "--passphrase-file", str(tmp_path / "wrong"))
        assert "is the passphrase right" in told
        assert main([step[0], str(root), *step[1:], name, *given]) == 0
        assert first_lines(root) | first_lines(root, "private/next/*/key.pem") == {ENCRYPTED}
    assert main([step[0], str(root), *step[1:], "finish", *given]) == 0
    assert first_lines(root) == {ENCRYPTED}
    for file in root.glob("private/*.key.pem"):
        openssl("pkey", "-in", file, "-passin", f"file:{secret}", "-noout")
    assert verify(root, access=CaAccess(passphrase=Secret(file=secret))).is_good


def test_a_switch_needs_the_passphrase_of_the_new_ca(
    tmp_path: Path, secret: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root, given = tmp_path / "ks", ("--passphrase-file", str(secret))
    assert main(["create", str(root), *given]) == 0
    assert main(["create-enclave", str(root), "/a", *given]) == 0
    assert main(["renew", str(root), "--ca", "start", *given]) == 0
    told = refused(root, capsys, "renew", "--ca", "switch")
    assert "private/next/identity_ca" in told and "give its passphrase" in told
    assert main(["renew", str(root), "--ca", "switch", *given]) == 0


def test_a_switch_of_both_needs_the_start_of_both(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = filled(tmp_path / "ks")
    roll_over(root, Step.START, (Role.IDENTITY,), options=options())
    told = refused(root, capsys, "renew", "--ca", "switch", status=2)
    assert "no new permissions CA yet" in told
    roll_over(root, Step.SWITCH, (Role.IDENTITY,), options=options())
    assert codes(root) == set()


def test_the_separated_permissions_ca_is_locked_as_the_ca_before(
    sros2: Path, tmp_path: Path, secret: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    key, given = sros2 / "private/ca.key.pem", ("--passphrase-file", str(secret))
    openssl("pkcs8", "-topk8", "-in", key, "-out", tmp_path / "key", "-passout", f"file:{secret}")
    key.write_bytes((tmp_path / "key").read_bytes())
    assert "give its passphrase" in refused(sros2, capsys, "renew")
    assert main(["renew", str(sros2), *given]) == 0
    assert first_lines(sros2) == {ENCRYPTED}
    assert main(["create", str(tmp_path / "plain")]) == 0
    assert first_lines(tmp_path / "plain") == {PLAIN}


def by_a_stranger(root: Path, name: str, stranger: sros2_style.Credential) -> None:
    file = root / name
    file.write_bytes(stranger.sign(file.with_suffix(".xml").read_text()))


@pytest.mark.parametrize(
    "name",
    ["enclaves/talker/permissions.p7s", "enclaves/robot/talker/permissions.p7s", "enclaves/governance.p7s"],
)
def test_a_document_of_a_stranger_costs_nobody_the_keystore(
    sros2: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    by_a_stranger(sros2, name, sros2_style.issue("stranger", is_ca=True))
    told = refused(sros2, capsys, "renew")
    assert name in told and "not the permissions CA" in told
    assert f"secure-keystore {'governance' if 'governance' in name else 'apply-policy'}" in told
    by_a_stranger(sros2, name, sros2_style.Credential.of_ca(sros2))
    renew(sros2)
    assert codes(sros2) == set()


def test_what_else_stops_the_repair_stops_it_before_it_begins(
    sros2: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = refused(sros2, capsys, "renew", "--compatible-subjects", status=2)
    assert "/robot/talker" in told and "--allow-subject-overlap" in told
    assert main(["renew", str(sros2), "--compatible-subjects", "--allow-subject-overlap"]) == 0


def test_a_switch_signs_all_or_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = filled(tmp_path / "ks")
    roll_over(root, Step.START, options=options())
    file = root / "enclaves/a/permissions.p7s"
    good = file.read_bytes()
    by_a_stranger(root, "enclaves/a/permissions.p7s", sros2_style.issue("stranger", is_ca=True))
    (root / "enclaves/a/permissions.xml").write_bytes(b"")
    told = refused(root, capsys, "renew", "--ca", "switch")
    assert "enclaves/a/permissions.p7s" in told
    file.write_bytes(good)
    roll_over(root, Step.SWITCH, options=options())
    assert codes(root) == set()
