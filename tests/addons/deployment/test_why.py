"""``secure-keystore why``: one cause, the first in order, and the repair that works on this machine."""

from __future__ import annotations

import json
import os
import shutil
from datetime import timedelta
from pathlib import Path

import pytest

from enclave_addons.deployment.diagnosis import STEPS, SilenceCause, diagnose
from keystore import Domains, verify
from keystore.formats.validity import utc_now
from keystore.verb import main
from tests.keystore.kit import filled

FAST = {"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}
CYCLONE = {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}


def cause(root: Path, enclave: str | None = None, **environment: str) -> SilenceCause:
    found = diagnose(root, enclave, {**FAST, **environment}, root.parent)
    assert found.cause is not None
    assert list(found.passed) == list(STEPS[: STEPS.index(found.cause.step)])
    return found.cause


def test_a_sound_keystore_passes_every_step(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks")
    for environment in (FAST, CYCLONE, {}):
        found = diagnose(root, "/a", environment, tmp_path)
        assert (found.cause, found.passed) == (None, STEPS)


def test_a_clock_before_the_keystore_is_the_only_cause_that_is_named(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", now=utc_now() + timedelta(days=400))
    (root / "enclaves/a/key.pem").chmod(0o644)
    found = cause(root)
    assert found.step == "clock" and found.repair == "timedatectl"


def test_the_first_in_order_is_named_and_after_its_repair_the_next(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks")
    key = root / "enclaves/a/key.pem"
    key.chmod(0o644)
    found = cause(root, ROS_DISCOVERY_SERVER="127.0.0.1:11811")
    assert found.step == "owner" and found.repair.startswith("chmod go-rwx ")
    key.chmod(0o600)
    found = cause(root, ROS_DISCOVERY_SERVER="127.0.0.1:11811")
    assert (found.step, found.repair) == ("discovery", "unset ROS_DISCOVERY_SERVER")
    assert diagnose(root, None, {**CYCLONE, "ROS_DISCOVERY_SERVER": "x"}, tmp_path).cause is None


def test_what_is_wrong_with_another_enclave_does_not_count(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks")
    (root / "enclaves/b/permissions.p7s").unlink()
    assert diagnose(root, "/a", FAST, tmp_path).cause is None
    assert cause(root, "/b").step == "files"
    assert cause(root).step == "files"


def test_what_has_expired_is_renewed_where_the_ca_keys_are_and_imported_elsewhere(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", now=utc_now() - timedelta(days=30), lifetime=timedelta(days=10))
    found = cause(root, "/a")
    assert found.step == "validity" and found.repair == f"secure-keystore renew {root} /a"
    host = tmp_path / "host"
    shutil.copytree(root, host, symlinks=True)
    shutil.rmtree(host / "private")
    found = cause(host, "/a")
    here, _, elsewhere = found.repair.partition("  # ")
    assert here == f"secure-keystore import {host} HOST.bundle"
    assert "secure-keystore renew KEYSTORE /a and secure-keystore export" in elsewhere


def test_a_domain_that_the_permissions_do_not_name(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", domains=Domains.single(7))
    found = cause(root, ROS_DOMAIN_ID="3")
    assert found.step == "domain" and found.repair.startswith("export ROS_DOMAIN_ID=7")
    assert diagnose(root, None, {**FAST, "ROS_DOMAIN_ID": "7"}, tmp_path).cause is None


def test_a_key_in_a_token_is_not_for_cyclone_dds(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks")
    (root / "enclaves/a/key.pem").unlink()
    (root / "enclaves/a/key.p11").write_text("pkcs11:object=a?module-path=/no/such/module.so\n")
    assert cause(root, "/a", **CYCLONE).repair == "export RMW_IMPLEMENTATION=rmw_fastrtps_cpp"
    assert "/no/such/module.so" in cause(root, "/a").text


def test_a_middleware_without_enclaves(tmp_path: Path) -> None:
    found = cause(filled(tmp_path / "ks"), RMW_IMPLEMENTATION="rmw_email_cpp")
    assert found.step == "middleware" and "has no security of its own" in found.text


def test_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    root = str(filled(tmp_path / "ks"))
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
    for words in ([root], ["/a", root], [root, "/a"]):
        assert main(["why", *words]) == 0
    monkeypatch.setenv("ROS_DISCOVERY_SERVER", "127.0.0.1:11811")
    capsys.readouterr()
    assert main(["why", "/a", root]) == 1
    well, what, repair = capsys.readouterr().out.splitlines()
    assert well.startswith("well: clock, owner, CRL") and what.startswith("cause (discovery): ")
    assert repair == "repair: unset ROS_DISCOVERY_SERVER"
    assert main(["why", "/a", root, "--format", "json"]) == 1
    assert json.loads(capsys.readouterr().out)["cause"]["step"] == "discovery"
    assert main(["why", "/none", root]) == 2
    assert main(["why", "/a", "/b", root]) == 2


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_keystore_of_another_user_is_one_finding(tmp_path: Path) -> None:
    root = filled(tmp_path / "home/ks")
    for place in (root.parent, root, *root.rglob("*")):
        os.chown(place, 12345, 12345, follow_symlinks=False)
    (finding,) = verify(root).findings
    assert finding.code == "foreign-owner" and finding.repair.startswith(f"chown -R 0 {root}")
    assert f"sudo -u '#12345' secure-keystore verify {root}" in finding.repair
    assert cause(root).step == "owner"
    os.chown(root / "enclaves/a/cert.pem", 54321, 54321)
    assert {one.place for one in verify(root).findings} == {".", "enclaves/a/cert.pem"}, "a third user counts"
    (root / "enclaves/a/key.pem").chmod(0o644)
    assert "readable-by-others" in {one.code for one in verify(root).findings}, "and so do modes"
