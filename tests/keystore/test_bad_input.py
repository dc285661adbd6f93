"""Whatever is typed or found: one line that says what is wrong, an exit status, never a traceback."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from cryptography.hazmat.backends.openssl.backend import backend

from keystore import (
    DamagedKeystoreError,
    InvalidInputError,
    Secret,
    UnsafeKeystoreError,
    create_keystore,
    provision,
)
from keystore.disk import lock
from keystore.disk.store import opened
from keystore.formats.governance_yaml import parse_governance_yaml
from keystore.formats.validity import parse_end
from keystore.verb import main
from tests.keystore.kit import NOW, created, filled, mode, options, policy

ARGUMENTS = {
    "ends at once": ["create-enclave", "KS", "/n", "--valid-for=0d"],
    "negative": ["create-enclave", "KS", "/n", "--valid-for=-1d"],
    "before the first year": ["create-enclave", "KS", "/n", "--valid-for=0001-01-01T00:00:00+14:00"],
    "after the last year": ["create-enclave", "KS", "/n", "--valid-for=9999-12-31T23:59:59-23:59"],
    "other digits": ["create-enclave", "KS", "/n", "--valid-for=١d"],
    "new keystore that ends at once": ["create", "NEW", "--valid-for=0d"],
    "new CA that ends at once": ["create", "NEW", "--ca-valid-for=0d"],
    "name of the CA too long": ["create", "NEW", "--identity-ca-name", "é" * 33],
    "name of the CA not text": ["create", "NEW", "--identity-ca-name", "\udc80"],
    "name of the CA blank": ["create", "NEW", "--identity-ca-name", " "],
    "domain in other digits": ["create", "NEW", "--domain-id", "٣"],
    "descriptor of nothing": ["create", "NEW", "--encrypt-ca-keys", "--passphrase-fd", "99999999999"],
    "variable of nothing": ["create", "NEW", "--encrypt-ca-keys", "--passphrase-env", "A=B"],
    "no path": ["list", "a\0b"],
    "path too long": ["create", "x" * 300],
    "not a keystore": ["verify", "."],
    "enclave that leaves": ["remove", "KS", "/../private"],
    "enclave with a line break": ["renew", "KS", "/a\n"],
    "bundle below a file": ["export", "KS", "-o", "KS/secure-keystore.json/out", "--enclave", "/a"],
    "bundle in the keystore": ["export", "KS", "-o", "KS/enclaves/out", "--enclave", "/a"],
    "policy is a folder": ["apply-policy", "KS", "."],
    "governance is a folder": ["governance", "KS", "."],
}


@pytest.mark.parametrize("name", ARGUMENTS)
def test_arguments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    filled(tmp_path / "KS", ["/a"])
    monkeypatch.chdir(tmp_path)
    status = main(ARGUMENTS[name])
    told = capsys.readouterr()
    assert status in (1, 2)
    assert told.err.startswith("secure-keystore: error: ") and told.err.count("\n") <= 2
    assert not (tmp_path / "KS/enclaves/n").exists() and not (tmp_path / "NEW/public").exists()


@pytest.mark.parametrize("margin", ["0d", "999999y"])
def test_margins_without_bounds(tmp_path: Path, margin: str) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    assert main(["status", str(root), "--within", margin]) in (0, 3)
    assert main(["renew", str(root), "--within", margin]) == 0


@pytest.mark.parametrize("waiting", ["nan", "inf", "-1", "x"])
def test_how_long_to_wait_is_a_number(tmp_path: Path, waiting: str) -> None:
    with pytest.raises(SystemExit):
        main(["create", str(tmp_path / "ks"), f"--lock-timeout={waiting}"])


YAML = {
    "key that is a list": b"? [a]\n: b\n",
    "key that is a mapping": b"? {a: b}\n: c\n",
    "deep": b"[" * 60_000,
    "long number": b"version: " + b"9" * 5000,
    "no date": b"version: 2001-99-99",
    "no time zone": b"version: 2001-01-01 00:00:00 +99:99",
    "not text": b"\xff\xfe\xfd",
    "version yes": b"version: true\ndomain_rules: [{}]",
    "domain yes": b"version: 1\ndomain_rules: [{domains: true}]",
    "domain with a point": b"version: 1\ndomain_rules: [{domains: 1.0}]",
    "half a character": b'version: 1\ndomain_rules: [{topic_rules: [{topic_expression: "\\ud800"}]}]',
}


@pytest.mark.parametrize("name", YAML)
def test_governance_yaml(name: str) -> None:
    with pytest.raises(InvalidInputError, match=r"^g\.yaml"):
        parse_governance_yaml(YAML[name], "g.yaml")


def test_no_keystore_is_made_for_an_impossible_validity(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="already have expired"):
        provision(tmp_path / "ks", [policy("/a")], options=options(valid_until=NOW.replace(year=2001)))
    assert not (tmp_path / "ks").exists()


def test_ends_are_capped_and_in_utc() -> None:
    assert parse_end("999999y", NOW).year == 2262
    assert parse_end("2040-01-01T00:00:00+02:00", NOW).isoformat() == "2039-12-31T22:00:00+00:00"


def test_a_passphrase_may_come_in_pieces() -> None:
    reading, writing = os.pipe()
    if os.fork() == 0:
        for piece in (b"correct ", b"horse\n"):
            os.write(writing, piece)
            os.sched_yield()
        os._exit(0)
    os.close(writing)
    os.wait()
    assert Secret(descriptor=reading).value() == b"correct horse"
    os.close(reading)


def test_the_lock_is_never_another_file(tmp_path: Path) -> None:
    root = created(tmp_path / "ks")
    (tmp_path / "precious").write_text("mine")
    (root / ".lock").unlink()
    os.link(tmp_path / "precious", root / ".lock")
    with pytest.raises(UnsafeKeystoreError, match="hard link"), opened(root):
        pass
    assert (tmp_path / "precious").read_text() == "mine"


def test_a_lock_file_replaced_while_waiting_is_noticed(tmp_path: Path) -> None:
    """Who removes the file must not let two runs in: the waiting one locks what is there then."""
    root = created(tmp_path / "ks")
    with lock.exclusive(root):
        descriptor = os.open(root / ".lock", os.O_RDWR)
        (root / ".lock").unlink()
        assert not lock._is_in_place(root / ".lock", descriptor)
        os.close(descriptor)


def test_nobody_else_may_put_a_ca_in_waiting(tmp_path: Path) -> None:
    """Whoever can write in private/ could leave a CA of their own there, to be installed by the next run."""
    root = filled(tmp_path / "ks", ["/a"])
    other = filled(tmp_path / "other", [])
    waiting = root / "private/incoming/identity_ca"
    waiting.mkdir(parents=True)
    (waiting / "cert.pem").write_bytes((other / "public/identity_ca.cert.pem").read_bytes())
    (waiting / "key.pem").write_bytes((other / "private/identity_ca.key.pem").read_bytes())
    before = (root / "public/identity_ca.cert.pem").read_bytes()
    (root / "private/incoming").chmod(0o770)
    with pytest.raises(UnsafeKeystoreError, match="chmod -R go-w"):
        provision(root, [policy("/a")], options=options())
    assert (root / "public/identity_ca.cert.pem").read_bytes() == before


def test_a_governance_that_nobody_signed_is_not_signed(tmp_path: Path) -> None:
    root = created(tmp_path / "ks")
    (root / "enclaves/governance.p7s").unlink()
    twin = root / "enclaves/governance.xml"
    twin.write_bytes(twin.read_bytes().replace(b">ENCRYPT<", b">NONE<"))
    with pytest.raises(DamagedKeystoreError, match=r"not the default governance.*rm "):
        create_keystore(root)
    twin.unlink()
    assert create_keystore(root).actions == ("governance signed",)


def test_a_bundle_whose_enclaves_stand_alone_gets_no_other_ca(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    bundle = tmp_path / "bundle"
    assert main(["export", str(root), "-o", str(bundle), "--enclave", "/a", "--public", "copy"]) == 0
    assert not provision(bundle, [policy("/a")], options=options()).changed
    shutil.rmtree(bundle / "public")
    (bundle / "enclaves/governance.p7s").unlink()
    with pytest.raises(DamagedKeystoreError, match="a deployed copy"):
        provision(bundle, [policy("/a")], options=options())
    assert not (bundle / "public/identity_ca.cert.pem").exists()


def test_a_deployed_bundle_serves_a_launch(tmp_path: Path) -> None:
    """No CA keys, no permissions.xml, perhaps a read-only file system: nothing needs doing."""
    root = filled(tmp_path / "ks", ["/a"])
    bundle = tmp_path / "bundle"
    assert main(["export", str(root), "-o", str(bundle), "--enclave", "/a"]) == 0
    assert not provision(bundle, [policy("/a")], options=options()).changed


@pytest.mark.parametrize("umask", [0o000, 0o077])
def test_a_bundle_has_its_own_modes(tmp_path: Path, umask: int) -> None:
    root = filled(tmp_path / "ks", ["/a/b"])
    before = os.umask(umask)
    try:
        assert main(["export", str(root), "-o", str(tmp_path / "out"), "--enclave", "*"]) == 0
    finally:
        os.umask(before)
    below = (path for path in (tmp_path / "out").rglob("*") if stat.S_ISDIR(path.lstat().st_mode))
    folders = [tmp_path / "out", *below]
    assert {mode(path) for path in folders} == {0o755}


DAMAGED = [
    "public/identity_ca.cert.pem", "enclaves/governance.p7s", "enclaves/a/cert.pem", "enclaves/a/key.pem",
    "enclaves/a/permissions.p7s",
]  # fmt: skip


@pytest.mark.parametrize("name", DAMAGED)
def test_damage_is_not_deployed(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    (root / name).write_bytes(b"")
    assert main(["export", str(root), "-o", str(tmp_path / "out"), "--enclave", "/a"]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(
    backend.openssl_version_text().startswith("OpenSSL 1"), reason="OpenSSL 1 reads no providers"
)
def test_an_openssl_configuration_without_its_provider_is_an_error_with_its_cause(tmp_path: Path) -> None:
    (tmp_path / "fips.cnf").write_text(
        "openssl_conf = init\n[init]\nproviders = sect\nalg_section = alg\n[sect]\nfips = fips\n"
        "[fips]\nactivate = 1\n[alg]\ndefault_properties = fips=yes\n"
    )
    words = [sys.executable, "-m", "keystore.verb", "create", str(tmp_path / "ks")]
    for configuration, status in ((tmp_path / "fips.cnf", 1), (Path("/dev/null"), 0)):
        done = subprocess.run(
            words, env={**os.environ, "OPENSSL_CONF": str(configuration)}, capture_output=True, text=True,
            cwd=Path(__file__).parents[2],
        )  # fmt: skip
        assert done.returncode == status and "Traceback" not in done.stderr
        assert ("fips.cnf' configures it: unsupported" in done.stderr) == (status == 1)
