"""A fleet's state from its bundles: who has what until when, who is behind, who trusts or carries what he must not."""

from __future__ import annotations

import json
import shutil
from datetime import timedelta
from pathlib import Path

import pytest

from enclave_addons.deployment import (
    BundleOptions,
    HostBundle,
    ImportOptions,
    export_hosts,
    fleet_status,
    import_bundle,
    pinned,
)
from keystore import InvalidInputError, RemoveOptions, RenewOptions, Role, Step, remove, renew, roll_over
from keystore.formats.validity import utc_now
from keystore.verb import main
from tests.keystore.kit import DAY, filled, options

FLEET = {f"robot{number}": [f"/robot{number}/*"] for number in range(3)}


@pytest.fixture
def ca(tmp_path: Path) -> Path:
    return filled(
        tmp_path / "ca", [f"/robot{number}/{part}" for number in range(3) for part in ("arm", "base")]
    )


def exported(ca: Path, output: Path) -> tuple[HostBundle, ...]:
    return export_hosts(ca, output, FLEET, options=BundleOptions(durable=False))


def found(ca: Path, *places: Path) -> dict[str, tuple[str, ...]]:
    return {one.manifest.host: one.found for one in fleet_status(places, keystore=ca).hosts}


def test_a_fleet_as_it_should_be(ca: Path, tmp_path: Path) -> None:
    exported(ca, tmp_path / "out")
    report = fleet_status([tmp_path / "out"], keystore=ca)
    assert report.is_good
    assert next(one.manifest.names for one in report.hosts) == ("/robot0/arm", "/robot0/base")


def test_imported_keystores_count_like_bundles_and_the_latest_of_a_host_counts(
    ca: Path, tmp_path: Path
) -> None:
    first = exported(ca, tmp_path / "one")[0]
    pins = ImportOptions("robot0", pinned(first.manifest))
    (tmp_path / "hosts").mkdir()
    import_bundle(tmp_path / "hosts/robot0", first.path, options=pins)
    renew(ca, ["/robot0/arm"], options=RenewOptions(provisioning=options()))
    exported(ca, tmp_path / "two")
    behind = found(ca, tmp_path / "hosts")
    assert list(behind) == ["robot0"]
    assert "is behind: number" in behind["robot0"][0]
    assert found(ca, tmp_path / "hosts", tmp_path / "two") == {f"robot{number}": () for number in range(3)}


def test_who_carries_a_revoked_enclave_and_who_lacks_the_crl(ca: Path, tmp_path: Path) -> None:
    exported(ca, tmp_path / "old")
    remove(ca, ["/robot1/arm"], options=RemoveOptions(durable=False))
    exported(ca, tmp_path / "new")
    told = found(ca, tmp_path / "old")
    assert "carries the revoked enclave /robot1/arm" in told["robot1"]
    assert not any("carries" in text for text in told["robot0"])
    assert any("has not got the CRL in force" in text for text in told["robot0"])
    assert found(ca, tmp_path / "new") == {f"robot{number}": () for number in range(3)}


def test_who_still_trusts_the_old_ca(ca: Path, tmp_path: Path) -> None:
    for step in (Step.START, Step.SWITCH):
        roll_over(ca, step, tuple(Role), options=options())
    exported(ca, tmp_path / "switched")
    roll_over(ca, Step.FINISH, tuple(Role), options=options())
    told = found(ca, tmp_path / "switched").values()
    assert all(any("still trusts an old CA" in text for text in texts) for texts in told)
    exported(ca, tmp_path / "finished")
    assert found(ca, tmp_path / "finished") == {f"robot{number}": () for number in range(3)}


def test_what_was_exported_at_a_step_of_a_roll_over_is_in_order_until_the_next(
    ca: Path, tmp_path: Path
) -> None:
    remove(ca, ["/robot1/arm"], options=RemoveOptions(durable=False))  # a CRL, which ends with its CA
    for step in Step:
        roll_over(ca, step, tuple(Role), options=options())
        exported(ca, tmp_path / step.value)
        assert found(ca, tmp_path / step.value) == {f"robot{number}": () for number in range(3)}, step


def test_what_ends_soon_and_what_has_ended(ca: Path, tmp_path: Path) -> None:
    renew(ca, ["/robot2/arm"], options=RenewOptions(provisioning=options(lifetime=20 * DAY)))
    exported(ca, tmp_path / "out")
    soon = {one.manifest.host: one for one in fleet_status([tmp_path / "out"]).hosts}
    assert soon["robot2"].found == ("/robot2/arm expires soon",)
    assert (soon["robot2"].due, soon["robot2"].ended, soon["robot1"].due) == (True, False, False)
    later = fleet_status([tmp_path / "out"], now=utc_now() + timedelta(days=21))
    assert later.hosts[2].ended
    assert later.hosts[2].found == ("/robot2/arm has expired",)


def test_forged_and_foreign_bundles_are_told_where_the_ca_is_at_hand(ca: Path, tmp_path: Path) -> None:
    exported(ca, tmp_path / "out")
    exported(filled(tmp_path / "other", [f"/robot{number}/arm" for number in range(3)]), tmp_path / "foreign")
    shutil.copy(tmp_path / "foreign/robot1.bundle", tmp_path / "out/robot1.bundle")
    (tmp_path / "out/robot2.bundle").write_bytes(b"x")
    report = fleet_status([tmp_path / "out"], keystore=ca)
    assert [place.name for place, _ in report.unreadable] == ["robot1.bundle", "robot2.bundle"]
    assert [one.manifest.host for one in report.hosts] == ["robot0"]
    with pytest.raises(InvalidInputError, match="no bundle"):
        fleet_status([ca])


def test_the_command_and_its_exit_status(
    ca: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    exported(ca, tmp_path / "out")
    assert main(["fleet", "status", out, "--keystore", str(ca)]) == 0
    assert "3 hosts, 3 as expected" in capsys.readouterr().out
    remove(ca, ["/robot1/arm"], options=RemoveOptions(durable=False))
    assert main(["fleet", "status", out, "--keystore", str(ca), "--format", "json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert "carries the revoked enclave /robot1/arm" in document["hosts"][1]["found"]
    assert main(["fleet", "status", out, "--within", "20y"]) == 3
