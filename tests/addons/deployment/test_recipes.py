"""The recipes of docs/deployment.md are run as they stand there."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from enclave_addons.deployment import (
    BundleOptions,
    ImportOptions,
    export_hosts,
    import_bundle,
    pinned,
    request,
)
from keystore import Policy, RenewOptions, renew, verify
from keystore.formats.policy_xml import policy_xml
from tests.addons.deployment.kit import TALK, made, tool
from tests.keystore.kit import filled, openssl, options, policy
from tests.keystore.test_external_ca import ExternalCa
from tests.programs import PYTHON

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "docs/deployment.md").read_text(encoding="utf-8")
RECIPES = dict(re.findall(r"<!-- recipe: (.*?) -->\n```sh\n(.*?)```", TEXT, re.DOTALL))


def test_the_recipes_are_found() -> None:
    assert set(RECIPES) == {"restart", "external ca", "age", "systemd-creds"}


def follow(name: str, folder: Path, **environment: str) -> str:
    """What the recipe prints, run in ``folder`` with our commands on PATH."""
    programs = folder / "programs"
    programs.mkdir()
    (programs / "secure-keystore").write_text(f'#!/bin/sh\nexec {PYTHON} -m keystore.verb "$@"\n')
    (programs / "secure-keystore").chmod(0o755)
    env = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT), **environment}
    done = subprocess.run(
        ["sh", "-euc", RECIPES[name]], cwd=folder, env=env, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def next_bundle(folder: Path, enclaves: str = "/base*") -> None:
    """A host ``ks`` that has imported once, and ``base.bundle``, which is newer."""
    ca = folder / "ca"
    if not ca.exists():
        filled(ca, ["/base"])
    for number in range(2):
        bundle = export_hosts(ca, folder, {"base": [enclaves]}, options=BundleOptions(durable=False))[0]
        if number == 0:
            pins = ImportOptions("base", pinned(bundle.manifest))
            import_bundle(folder / "ks", bundle.path, options=pins)
            renew(ca, options=RenewOptions(everything=True, provisioning=options()))


def test_an_encrypted_bundle_is_imported(tmp_path: Path) -> None:
    tool("age", "apt-get install age")
    next_bundle(tmp_path)
    before = os.readlink(tmp_path / "ks")
    follow("age", tmp_path)
    assert os.readlink(tmp_path / "ks") != before
    assert b"PRIVATE KEY" in (tmp_path / "base.bundle").read_bytes()
    assert b"PRIVATE KEY" not in (tmp_path / "base.bundle.age").read_bytes()


def test_certificates_come_from_elsewhere(tmp_path: Path) -> None:
    external = ExternalCa(tmp_path / "company")
    shutil.copy(external.cert, tmp_path / "company-ca.pem")
    asked = request(tmp_path / "host-ks", ["/base"])  # made again, unchanged, by the recipe
    (tmp_path / "company/issued").write_bytes(external.issue(asked))
    (tmp_path / "sign-elsewhere").write_text(
        "#!/bin/sh\nopenssl req -in $1 -noout -verify >&2\ncat company/issued\n"
    )
    (tmp_path / "sign-elsewhere").chmod(0o755)
    (tmp_path / "policy.xml").write_bytes(policy_xml(Policy((policy("/base"),))))
    follow("external ca", tmp_path)
    assert (tmp_path / "out/base.bundle").is_file()
    assert verify(tmp_path / "ks").is_good
    openssl("verify", "-CAfile", external.cert, tmp_path / "ks/enclaves/base/cert.pem")


def test_a_key_is_bound_to_the_machine(tmp_path: Path) -> None:
    tool("systemd-analyze", "apt-get install systemd")
    secret = {**os.environ, "SYSTEMD_CREDENTIAL_SECRET": str(tmp_path / "secret")}
    try_out = [
        "systemd-creds",
        "encrypt",
        "--with-key=host",
        "--name=x",
        "/dev/null",
        str(tmp_path / "tried"),
    ]
    tried = subprocess.run(try_out, env=secret, capture_output=True, text=True)
    if tried.returncode != 0:  # not root, or a container without a machine id
        pytest.skip(f"this machine has no secret of its own for systemd-creds: {tried.stderr}")
    made("systemd", tmp_path)
    (tmp_path / "out").rename(tmp_path / "deploy")
    follow("systemd-creds", tmp_path, SYSTEMD_CREDENTIAL_SECRET=str(tmp_path / "secret"))
    key = (tmp_path / "ks/enclaves/front/speaker/key.pem").read_bytes()
    assert key not in (tmp_path / "speaker.key.cred").read_bytes()
    shown = subprocess.run(
        ["systemd-creds", "decrypt", "--name=key.pem", tmp_path / "speaker.key.cred", "-"],
        env=secret, capture_output=True, check=True,
    )  # fmt: skip
    assert shown.stdout == key


def test_an_import_is_followed_by_restarts_in_order(tmp_path: Path) -> None:
    """With a systemctl for which everything runs; a real one is in test_booted.py."""
    made("systemd", tmp_path, TALK, "--host-keystore", str(tmp_path / "ks-of-host"))
    (tmp_path / "out").rename(tmp_path / "deploy")
    for unit in (tmp_path / "deploy").glob("*.service"):
        unit.write_text(unit.read_text().replace("ks-of-host", "ks"))
    (tmp_path / "ks").rename(tmp_path / "ca")
    next_bundle(tmp_path, "*")
    (tmp_path / "fake").mkdir()
    (tmp_path / "fake/systemctl").write_text(
        f'#!/bin/sh\necho "$@" >> {tmp_path}/asked\necho ActiveState=inactive\necho Result=success\n'
    )
    (tmp_path / "fake/systemctl").chmod(0o755)
    printed = follow("restart", tmp_path, PATH=f"{tmp_path}/programs:{tmp_path}/fake:{os.environ['PATH']}")
    assert "to restart: the changed enclaves, one after the other" in printed
    assert re.findall("^restart (.*)$", (tmp_path / "asked").read_text(), re.M) == [
        "ros-robot-front-speaker.service",
        "ros-robot-ear.service",
    ]
