"""A life that is asked for is what existing enclaves get too, and short lives are renewed in time."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import pytest

from enclave_addons.deployment import export
from keystore import Policy, apply_policy, create_enclaves, provision
from keystore.disk import layout
from keystore.formats.certificate import read_certificate
from keystore.formats.domains import Domains
from keystore.formats.permissions_document import parse_permissions
from keystore.verb import main
from tests.keystore.kit import DAY, NOW, actions, filled, options, policy, snapshot


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return filled(tmp_path / "ks", ["/a"], now=NOW, lifetime=100 * DAY)


def left(root: Path, name: str = "/a") -> timedelta:
    cert = (root / layout.enclave_directory(name) / "cert.pem").read_bytes()
    return read_certificate(cert).validity.not_after - NOW


@pytest.mark.parametrize("days", [1, 30, 98, 101, 300])
def test_apply_policy_gives_existing_enclaves_the_life_that_is_asked_for(root: Path, days: int) -> None:
    report = apply_policy(root, Policy((policy("/a"),)), options=options(now=NOW, lifetime=days * DAY))
    assert "certificate" in actions(report)["/a"] and left(root) == days * DAY
    assert ("old certificate revoked" in actions(report)["/a"]) is (days < 100), (
        "the longer one must not stay"
    )


def test_an_absolute_end_is_reached_once(root: Path) -> None:
    chosen = options(now=NOW, valid_until=NOW + 40 * DAY)
    apply_policy(root, Policy((policy("/a"),)), options=chosen)
    before = snapshot(root)
    assert not apply_policy(root, Policy((policy("/a"),)), options=chosen).changed
    assert snapshot(root) == before and left(root) == 40 * DAY


def test_without_a_life_asked_for_nothing_is_issued_anew(root: Path) -> None:
    assert not apply_policy(root, Policy((policy("/a"),)), options=options(now=NOW)).changed
    assert not create_enclaves(root, ["/a"], options=options(now=NOW)).changed


def test_a_ca_that_ends_sooner_is_not_asked_again_and_again(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"], now=NOW)
    chosen = options(now=NOW, lifetime=9999 * DAY)
    apply_policy(root, Policy((policy("/a"),)), options=chosen)
    assert not apply_policy(root, Policy((policy("/a"),)), options=chosen).changed


def test_short_lives_are_renewed_when_two_thirds_are_over(root: Path) -> None:
    def start(day: int) -> dict[str, tuple[str, ...]]:
        now = NOW + day * DAY
        chosen = options(now=now, valid_until=now + 30 * DAY, renew_within=10 * DAY)
        return actions(provision(root, [policy("/a")], options=chosen))

    assert "old certificate revoked" in start(0)["/a"], "it had a hundred days"
    assert [bool(start(day)) for day in (1, 10, 19, 21, 22, 40)] == [False, False, False, True, False, False]


def test_create_enclave_takes_a_domain(tmp_path: Path) -> None:
    root = str(tmp_path / "ks")
    assert main(["create", root, "--domain-id", "0-10"]) == 0
    assert main(["create-enclave", root, "/a", "--allow-all", "--domain-id", "7"]) == 0
    permissions = parse_permissions((tmp_path / "ks/enclaves/a/permissions.xml").read_bytes())
    assert permissions.domains == Domains.parse("7")


@pytest.mark.parametrize("name", ["a/b", "a/b/bundle.tar.gz"])
def test_export_makes_the_folders_above_its_output(tmp_path: Path, name: str) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    export(root, tmp_path / "out" / name, ["/a"])
    assert (tmp_path / "out" / name).exists()
