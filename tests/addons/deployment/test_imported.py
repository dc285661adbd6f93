"""An imported keystore on its host: what was changed since is seen and restored; what a bundle may bring is bounded."""

from __future__ import annotations

import os
import tracemalloc
from collections.abc import Callable
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
from enclave_addons.deployment.bundle_file import sealed_bundle
from enclave_addons.deployment.importing import Restart
from keystore import (
    ChangeOptions,
    DamagedKeystoreError,
    DomainRule,
    Governance,
    KeystoreError,
    Protection,
    RemoveOptions,
    Role,
    Step,
    UnsafeKeystoreError,
    provision,
    remove,
    roll_over,
    set_governance,
    verify,
)
from keystore.disk import layout
from keystore.formats.bundle import pin
from keystore.steps.comparison import differences
from keystore.verb import main
from tests.keystore.kit import contents, filled, options, policy


def exported(ca: Path, output: Path, host: str = "arm", *names: str, accept: bool = False) -> HostBundle:
    chosen = BundleOptions(durable=False, accept_exposures=accept)
    return export_hosts(ca, output, {host: list(names or ("/a", "/b"))}, options=chosen)[0]


def imported(place: Path, bundle: HostBundle, host: str = "arm") -> Path:
    import_bundle(place, bundle.path, options=ImportOptions(host, pinned(bundle.manifest)))
    return place


@pytest.fixture
def ca(tmp_path: Path) -> Path:
    root = filled(tmp_path / "ca", ["/a", "/b", "/old", "/gone"])
    remove(root, ["/old"], options=RemoveOptions(durable=False))
    return root


@pytest.fixture
def earlier_crl(ca: Path) -> bytes:
    content = (ca / layout.CRL).read_bytes()
    remove(ca, ["/gone"], options=RemoveOptions(durable=False))
    return content


@pytest.fixture
def bundle(ca: Path, earlier_crl: bytes, tmp_path: Path) -> HostBundle:
    return exported(ca, tmp_path / "out")


@pytest.fixture
def host(bundle: HostBundle, tmp_path: Path) -> Path:
    return imported(tmp_path / "host", bundle)


def roll_back(host: Path, earlier: bytes) -> None:
    (host / layout.CRL).write_bytes(earlier)


def delete_crl(host: Path, earlier: bytes) -> None:
    (host / layout.CRL).unlink()
    for link in host.resolve().glob("enclaves/**/crl.pem"):
        link.unlink()


def swap_permissions(host: Path, earlier: bytes) -> None:
    (host / "enclaves/a/permissions.p7s").write_bytes((host / "enclaves/b/permissions.p7s").read_bytes())


CHANGES: dict[str, tuple[Callable[[Path, bytes], None], Restart]] = {
    "CRL rolled back": (roll_back, Restart.ALL),
    "CRL deleted": (delete_crl, Restart.ALL),
    "another's permissions": (swap_permissions, Restart.CHANGED),
}


@pytest.mark.parametrize("more", [(), ("--no-revoke",)])
def test_an_enclave_is_removed_where_the_ca_keys_are(
    ca: Path, host: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...]
) -> None:
    assert main(["export", str(ca), "-o", str(tmp_path / "copy"), "--enclave", "*"]) == 0
    for deployed in (host, tmp_path / "copy"):
        before = contents(deployed)
        capsys.readouterr()
        assert main(["remove", str(deployed), "/a", *more]) == 1
        told = capsys.readouterr()
        assert "remove it where the CA keys are, then deploy" in told.err
        assert told.out == "" and told.err.count("\n") == 1
        assert contents(deployed) == before and verify(deployed).is_good
    assert main(["remove", str(ca), "/a", *more]) == 0
    import_bundle(host, exported(ca, tmp_path / "next", "arm", "/b").path, options=ImportOptions("arm"))
    assert not (host / "enclaves/a").exists() and verify(host).is_good


def test_what_was_imported_is_good_and_the_same_bundle_changes_nothing(
    host: Path, bundle: HostBundle
) -> None:
    assert verify(host).is_good and fleet_status([host]).is_good
    version = os.readlink(host)
    assert import_bundle(host, bundle.path).restart is Restart.NOBODY and os.readlink(host) == version
    assert differences(host, policy("/a"), options=options()) == ()


@pytest.mark.parametrize("name", CHANGES)
def test_what_was_changed_since_is_seen_and_restored(
    name: str, host: Path, bundle: HostBundle, earlier_crl: bytes
) -> None:
    change, restart = CHANGES[name]
    change(host, earlier_crl)
    repairs = {finding.code: finding.repair for finding in verify(host).findings}
    assert repairs["bundle-differs"].startswith(f"secure-keystore import {host} HOST.bundle ")
    assert not fleet_status([host]).is_good
    assert differences(host, policy("/a"), options=options())
    with pytest.raises(KeystoreError):
        provision(host, [policy("/a")], options=options())
    report = import_bundle(host, bundle.path)
    assert report.restart is restart and any(note.startswith("restored: ") for note in report.notes)
    assert verify(host).is_good and fleet_status([host]).is_good
    assert import_bundle(host, bundle.path).restart is Restart.NOBODY


def test_an_edited_manifest_is_an_error(host: Path) -> None:
    place = host / layout.BUNDLE
    place.write_bytes(place.read_bytes().replace(b'"crl_number"', b'"crl_numbe_"'))
    assert "bundle-differs" in {finding.code for finding in verify(host).findings}


# Who may do what


def test_an_identity_ca_alone_cannot_become_the_permissions_ca(ca: Path, tmp_path: Path) -> None:
    """Its holder makes a keystore in which it signs everything, and a governance as he likes."""
    good = exported(ca, tmp_path / "good")
    evil = filled(tmp_path / "evil", ["/a", "/b"])
    forged = exported(evil, tmp_path / "forged")
    pins = (
        pin(Role.IDENTITY, forged.manifest.authorities[Role.PERMISSIONS][0]),
        pin(Role.PERMISSIONS, good.manifest.authorities[Role.PERMISSIONS][0]),
    )
    with pytest.raises(UnsafeKeystoreError, match="by another permissions CA"):
        import_bundle(tmp_path / "host", forged.path, options=ImportOptions("arm", pins))
    imported(tmp_path / "host", good)


def test_a_weaker_governance_is_taken_only_by_name(ca: Path, host: Path, tmp_path: Path) -> None:
    weak = Governance((DomainRule(rtps_protection_kind=Protection.NONE),))
    set_governance(ca, weak, options=ChangeOptions(durable=False))
    bundle = exported(ca, tmp_path / "weak", accept=True)
    for accepted in ((), ("discovery_protection_kind",)):
        with pytest.raises(UnsafeKeystoreError, match="--accept-weaker rtps_protection_kind"):
            import_bundle(host, bundle.path, options=ImportOptions(accept_weaker=accepted))
    assert main(["import", str(host), str(bundle.path), "--accept-weaker", "rtps_protection_kind"]) == 0
    provision(ca, [policy("/a", "/more")], options=options())
    import_bundle(host, exported(ca, tmp_path / "next", accept=True).path)  # it was accepted before


# What the file of a bundle may be

MAGIC = b"enclave-launch bundle 1\n"
PAX = b"pax".ljust(156, b"\0") + b"x" + b"ustar".rjust(105, b"\0") + b"1" * 200_000


@pytest.mark.parametrize(
    "content",
    [
        b"", b"x", PAX, MAGIC, MAGIC + b"\n", MAGIC + b"1", MAGIC + b"1\n", MAGIC + b"-1\n" + b"x" * 9,
        MAGIC + b"+1\nx" * 3, MAGIC + b"8000001\n" + b"x" * 8_000_001, MAGIC + b"9" * 5000 + b"\n",
        MAGIC + "\u0663\n".encode() + b"xxx", MAGIC + b"1\nx1\nx", MAGIC + b"1\nx1\nx2\nx",
    ],
)  # fmt: skip
def test_what_is_no_bundle_is_refused_at_once(content: bytes) -> None:
    tracemalloc.start()
    with pytest.raises(DamagedKeystoreError):
        sealed_bundle(content, "x")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000


def test_the_first_parts_of_a_bundle_are_taken_apart_and_no_more(tmp_path: Path) -> None:
    sealed = sealed_bundle(MAGIC + b"1\na2\nbc0\n7\nunread", "x")
    assert (sealed.signed, sealed.authorities, sealed.handover) == (b"a", b"bc", b"")


# Revocation and another CA


def test_a_ca_is_replaced_after_a_revocation_though_one_host_slept(
    ca: Path, host: Path, bundle: HostBundle, tmp_path: Path
) -> None:
    """CRL numbers belong to their issuer: the CRL of the new CA begins a series of its own."""
    sleeper = imported(tmp_path / "sleeper", exported(ca, tmp_path / "s", "leg", "/a"), "leg")
    for step in Step:
        roll_over(ca, step, tuple(Role), options=options())
        import_bundle(host, exported(ca, tmp_path / step.value).path)
        assert verify(host).is_good
        if step is not Step.SWITCH:
            import_bundle(sleeper, exported(ca, tmp_path / step.value, "leg", "/a").path)
    assert verify(sleeper).is_good
