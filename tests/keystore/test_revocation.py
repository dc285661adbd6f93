"""Enclaves taken out: revoked for everybody, deleted here, nothing else touched."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from cryptography import x509

from enclave_addons.deployment import export
from keystore import (
    DamagedKeystoreError,
    InvalidInputError,
    RemoveOptions,
    RenewOptions,
    list_enclaves,
    provision,
    remove,
    renew,
    status,
)
from keystore.disk import layout
from keystore.disk.crl_file import crl_validity
from keystore.disk.view import KeystoreView
from keystore.formats.certificate import read_certificate
from tests.keystore.kit import (
    DAY,
    NOW,
    certificate_of,
    codes,
    crl_of,
    filled,
    openssl,
    options,
    policy,
    snapshot,
)

NAMES = ("/", "/a", "/a/b", "/c")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return filled(tmp_path / "ks", NAMES)


def quick(**changes: object) -> RemoveOptions:
    return RemoveOptions(**{"durable": False, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize("name", NAMES)
def test_the_enclave_is_gone_and_those_around_it_stay(root: Path, name: str) -> None:
    serial = certificate_of(root, name).serial
    report = remove(root, [name], options=quick())
    assert report.removed == (name,) and report.revoked == 1
    assert list_enclaves(root) == [other for other in NAMES if other != name]
    assert crl_of(root).get_revoked_certificate_by_serial_number(serial) is not None
    assert codes(root) == set()


def test_there_is_no_crl_before_the_first_revocation(root: Path) -> None:
    assert not list(root.rglob("crl.pem"))


def test_every_remaining_enclave_gets_the_crl(root: Path) -> None:
    remove(root, ["/c"], options=quick())
    for name in ("/", "/a", "/a/b"):
        link = root / layout.enclave_directory(name) / "crl.pem"
        assert link.is_symlink() and link.resolve() == (root / "public/crl.pem").resolve()
    provision(root, [policy("/new")], options=options())
    assert (root / "enclaves/new/crl.pem").is_symlink()


def test_openssl_refuses_the_removed_one(root: Path, tmp_path: Path) -> None:
    shutil.copy(root / "enclaves/c/cert.pem", tmp_path / "stolen.pem")
    remove(root, ["/c"], options=quick())
    ca = root / "public/identity_ca.cert.pem"
    check = ("verify", "-crl_check", "-CAfile", ca, "-CRLfile", root / "public/crl.pem")
    openssl(*check, root / "enclaves/a/cert.pem")
    with pytest.raises(AssertionError, match="certificate revoked"):
        openssl(*check, tmp_path / "stolen.pem")


def test_what_an_enclave_had_before_is_revoked_with_it(root: Path, tmp_path: Path) -> None:
    """A copy made before a renewal is as good as the present certificate, until both are revoked."""
    shutil.copy(root / "enclaves/c/cert.pem", tmp_path / "first.pem")
    for _ in range(2):
        renew(root, ["/c"], options=RenewOptions(provisioning=options()))
    assert not (root / "public/crl.pem").exists()
    assert remove(root, ["/c"], options=quick()).revoked == 3
    assert crl_of(root).get_revoked_certificate_by_serial_number(
        read_certificate((tmp_path / "first.pem").read_bytes()).serial
    )
    assert codes(root) == set()


def test_a_key_that_was_copied_is_replaced_and_its_certificate_revoked(root: Path) -> None:
    stolen = certificate_of(root, "/c").serial
    for _ in range(2):
        renew(root, ["/c"], options=RenewOptions(new_keys=True, revoke_old=True, provisioning=options()))
    revoked = {entry.serial_number for entry in crl_of(root)}
    assert stolen in revoked and len(revoked) == 2
    assert certificate_of(root, "/c").serial not in revoked
    assert codes(root) == set()


def test_the_number_of_a_crl_only_grows(root: Path) -> None:
    """Though the clock was set back."""
    numbers = []
    for name, moment in (("/c", NOW), ("/a/b", NOW - DAY), ("/a", NOW - DAY)):
        remove(root, [name], options=quick(now=moment))
        numbers.append(crl_of(root).extensions.get_extension_for_class(x509.CRLNumber).value.crl_number)
    assert numbers == sorted(set(numbers))


def test_a_removal_is_completed_by_the_same_command(root: Path) -> None:
    name = KeystoreView(root).enclaves()[0]
    first, again = (remove(root, [name], options=quick()) for _ in range(2))
    assert (first.removed, first.gone, again.removed, again.gone) == ((name,), (), (), (name,))
    assert again.revoked == first.revoked == 1
    with pytest.raises(InvalidInputError, match="no enclave /never"):
        remove(root, ["/never"], options=quick())


def test_a_revoked_certificate_stays_on_the_list_while_its_ca_is_trusted(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a", "/b"], now=NOW, lifetime=10 * DAY)
    serial = certificate_of(root, "/b").serial
    remove(root, ["/b"], options=quick(now=NOW))
    provision(root, [policy("/a")], options=options(now=NOW + 900 * DAY, lifetime=10 * DAY))
    assert crl_of(root).get_revoked_certificate_by_serial_number(serial) is not None


def test_a_launch_renews_a_crl_that_has_ended(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a", "/c"], now=NOW - 300 * DAY, lifetime=30 * DAY)
    remove(root, ["/c"], options=quick(now=NOW - 300 * DAY))
    later = NOW + 100 * DAY
    wished = [policy("/a")]
    provision(root, wished, options=options(now=NOW))
    assert not provision(root, wished, options=options(now=NOW)).created
    assert provision(root, wished, options=options(now=later)).created == (
        "CRL published again: the CRL has expired",
    )
    assert not provision(root, wished, options=options(now=later)).changed
    assert len(crl_of(root)) == 1
    assert codes(root, now=later) == set()


def test_revocations_add_up(root: Path) -> None:
    remove(root, ["/c"], options=quick(now=NOW))
    assert remove(root, ["/a", "/a/b"], options=quick(now=NOW + DAY)).revoked == 3
    assert len(crl_of(root)) == 3
    assert list_enclaves(root) == ["/"]
    assert not (root / "enclaves/a").exists(), "empty directories go too"


def test_a_restored_backup_of_a_revoked_enclave_is_found_and_not_exported(root: Path, tmp_path: Path) -> None:
    shutil.copytree(root / "enclaves/c", tmp_path / "backup", symlinks=True)
    remove(root, ["/c"], options=quick())
    shutil.copytree(tmp_path / "backup", root / "enclaves/c", symlinks=True)
    assert "revoked" in codes(root)
    with pytest.raises(DamagedKeystoreError, match=r"enclave /c is not fit for a host: .*revoked"):
        export(root, tmp_path / "out", ["/c"])


def test_only_deleting(root: Path) -> None:
    report = remove(root, ["/c"], options=quick(revoke=False))
    assert report.revoked == 0 and not (root / "public/crl.pem").exists()


def test_an_unknown_enclave_changes_nothing(root: Path) -> None:
    before = snapshot(root)
    with pytest.raises(InvalidInputError, match="no enclave /nowhere"):
        remove(root, ["/a", "/nowhere"], options=quick())
    assert snapshot(root) == before


def test_a_crl_lasts_as_long_as_the_certificates_in_force(tmp_path: Path) -> None:
    """Both DDS refuse every participant once the CRL has ended, so it may not end before what it is for."""
    root = filled(tmp_path / "ks", ["/a", "/b"], now=NOW, lifetime=900 * DAY)
    remove(root, ["/b"], options=quick(now=NOW))
    assert crl_validity(KeystoreView(root)).not_after == certificate_of(root, "/a").validity.not_after


def test_the_crl_is_renewed_before_it_ends(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a", "/b"], now=NOW, lifetime=100 * DAY)
    remove(root, ["/b"], options=quick(now=NOW))
    late = NOW + 350 * DAY
    assert "CRL" in [one.what for one in status(root, now=late).due(30 * DAY)]
    assert "crl-expired" in codes(root, now=NOW + 400 * DAY)
    renew(root, options=RenewOptions(provisioning=options(now=late)))
    assert crl_validity(KeystoreView(root)).not_after == late + 365 * DAY
    assert len(crl_of(root)) == 1
    assert codes(root, now=NOW + 400 * DAY) == set()


def test_a_forged_crl_is_replaced_by_what_the_register_says(root: Path, tmp_path: Path) -> None:
    other = filled(tmp_path / "other", ["/x"])
    remove(other, ["/x"], options=quick())
    shutil.copy(other / "public/crl.pem", root / "public/crl.pem")
    assert "crl" in codes(root)
    assert remove(root, ["/a"], options=quick()).revoked == 1
    assert codes(root) == set()
