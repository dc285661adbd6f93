"""From the CA's machine to a host: signed bundles, atomic import, and what is refused on the way."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping
from datetime import timedelta
from pathlib import Path

import pytest
from cryptography import x509

from enclave_addons.deployment import (
    BundleOptions,
    HostBundle,
    ImportOptions,
    ImportReport,
    export_hosts,
    import_bundle,
    pinned,
)
from enclave_addons.deployment.bundle_file import bundle_bytes
from enclave_addons.deployment.host_bundles import enclaves_of_hosts
from enclave_addons.deployment.hosts import parse_hosts
from enclave_addons.deployment.importing import Restart
from keystore import (
    DamagedKeystoreError,
    InvalidInputError,
    KeystoreError,
    NotAKeystoreError,
    RemoveOptions,
    RenewOptions,
    Role,
    Step,
    UnsafeKeystoreError,
    provision,
    remove,
    renew,
    roll_over,
    verify,
)
from keystore.disk import layout
from keystore.disk.container_copies import ContainerUser
from keystore.formats.validity import utc_now
from keystore.verb import main
from tests.addons.deployment.kit import files_of_bundle
from tests.keystore.fault_driver import KILLED, install_fault
from tests.keystore.kit import contents, filled, mode, options, policy

NAMES = ("/base", "/base/camera", "/arm", "/arm/hand")
HOSTS = {"base": ["/base*"], "arm": ["/arm*"]}


@pytest.fixture
def ca(tmp_path: Path) -> Path:
    return filled(tmp_path / "ca", NAMES)


def exported(ca: Path, output: Path, host: str = "base", patterns: list[str] | None = None) -> HostBundle:
    assigned = {host: patterns or HOSTS[host]}
    return export_hosts(ca, output, assigned, options=BundleOptions(durable=False))[0]


def first_import(place: Path, bundle: HostBundle) -> ImportReport:
    pins = ImportOptions(host=bundle.manifest.host, authorities=pinned(bundle.manifest))
    return import_bundle(place, bundle.path, options=pins)


def renewed(ca: Path, *names: str) -> None:
    renew(ca, names, options=RenewOptions(provisioning=options()))


def test_one_bundle_for_each_host_holds_its_enclaves_and_nothing_that_signs(ca: Path, tmp_path: Path) -> None:
    made = export_hosts(ca, tmp_path / "out", HOSTS)
    assert [one.path.name for one in made] == ["base.bundle", "arm.bundle"]
    ca_keys = {path.read_bytes() for path in (ca / "private").glob("*.pem")}
    for one in made:
        found = files_of_bundle(one.path.read_bytes())
        assert one.manifest.names == tuple(sorted(HOSTS_ENCLAVES[one.manifest.host]))
        assert set(found) == layout.bundle_files([(name, True) for name in one.manifest.names], crl=False) | {
            layout.BUNDLE
        }
        assert not ca_keys & set(found.values())
        assert mode(one.path) == 0o600


HOSTS_ENCLAVES = {"base": {"/base", "/base/camera"}, "arm": {"/arm", "/arm/hand"}}


def test_the_same_keystore_gives_the_same_bytes_and_another_one_a_higher_number(
    ca: Path, tmp_path: Path
) -> None:
    one, two = exported(ca, tmp_path / "one"), exported(ca, tmp_path / "two")
    assert one.path.read_bytes() == two.path.read_bytes()
    assert (one.is_new, two.is_new) == (True, False)
    renewed(ca, "/arm")
    assert exported(ca, tmp_path / "other").path.read_bytes() == one.path.read_bytes(), "not on this host"
    renewed(ca, "/base")
    three = exported(ca, tmp_path / "three")
    assert three.is_new
    assert three.manifest.number > one.manifest.number


def test_an_imported_keystore_is_good_and_stands_alone(ca: Path, tmp_path: Path) -> None:
    place = tmp_path / "etc/keystore"
    place.parent.mkdir()
    report = first_import(place, exported(ca, tmp_path / "out"))
    assert report.changed == ("/base", "/base/camera")
    assert {finding.code for finding in verify(place).findings} <= {"no-ca-key"}
    assert mode(place / "enclaves/base/key.pem") == 0o600
    assert not (place / "private").exists()
    for name in layout.RUNTIME_FILES:
        assert (place / "enclaves/base/camera" / name).is_file()


def test_a_newer_bundle_replaces_the_one_before_and_its_keys(ca: Path, tmp_path: Path) -> None:
    first_import(tmp_path / "ks", exported(ca, tmp_path / "one"))
    renewed(ca, "/base")
    report = import_bundle(tmp_path / "ks", exported(ca, tmp_path / "two").path)
    assert (report.changed, report.restart) == (("/base",), Restart.CHANGED)
    assert len(list((tmp_path / "ks.d").glob("[0-9]*"))) == 1, "the version before is gone"


def test_an_enclave_that_left_the_host_is_gone_with_its_key(ca: Path, tmp_path: Path) -> None:
    first_import(tmp_path / "ks", exported(ca, tmp_path / "one"))
    report = import_bundle(tmp_path / "ks", exported(ca, tmp_path / "two", patterns=["/base"]).path)
    assert report.removed == ("/base/camera",)
    assert not (tmp_path / "ks/enclaves/base/camera").exists()


# Attacks: each is refused, and the host keeps what it had


@pytest.fixture
def host(ca: Path, tmp_path: Path) -> Path:
    first_import(tmp_path / "ks", exported(ca, tmp_path / "first"))
    return tmp_path / "ks"


def refused(
    host: Path, bundle: Path, kind: type[KeystoreError], match: str, named: str | None = None
) -> None:
    before = contents(host.resolve()), os.readlink(host)
    with pytest.raises(kind, match=match):
        import_bundle(host, bundle, options=ImportOptions(host=named))
    assert (contents(host.resolve()), os.readlink(host)) == before
    assert sorted(path.name for path in host.with_name("ks.d").iterdir()) == [".lock", os.readlink(host)[5:]]


def test_an_older_bundle_is_refused(ca: Path, host: Path, tmp_path: Path) -> None:
    renewed(ca, "/base")
    import_bundle(host, exported(ca, tmp_path / "new").path)
    refused(host, tmp_path / "first/base.bundle", UnsafeKeystoreError, "is in force here: an earlier bundle")


def test_a_replay_after_revocation_is_refused(ca: Path, host: Path, tmp_path: Path) -> None:
    remove(ca, ["/base/camera"], options=RemoveOptions(durable=False))
    report = import_bundle(host, exported(ca, tmp_path / "new").path)
    assert report.removed == ("/base/camera",)
    assert report.restart is Restart.ALL, "all that must refuse the revoked one read the CRL at their start"
    refused(host, tmp_path / "first/base.bundle", UnsafeKeystoreError, "an earlier bundle")


def exported_later(ca: Path, output: Path) -> Path:
    """Numbers are times: a later one than any bundle of this test has."""
    later = BundleOptions(durable=False, now=utc_now() + timedelta(minutes=2))
    return export_hosts(ca, output, {"base": ["/base"]}, options=later)[0].path


def revoked_here(host: Path) -> int:
    return len(x509.load_pem_x509_crl((host / layout.CRL).read_bytes()))


def test_a_ca_restored_from_a_backup_does_not_take_revocations_back(
    ca: Path, host: Path, tmp_path: Path
) -> None:
    shutil.copytree(ca, tmp_path / "backup", symlinks=True)
    remove(ca, ["/base/camera", "/arm"], options=RemoveOptions(durable=False))
    import_bundle(host, exported(ca, tmp_path / "two").path)
    shutil.rmtree(ca)
    shutil.copytree(tmp_path / "backup", ca, symlinks=True)
    refused(host, exported_later(ca, tmp_path / "none"), UnsafeKeystoreError, "earlier CRL|knows as revoked")
    later = utc_now() + timedelta(minutes=1)
    remove(ca, ["/arm/hand"], options=RemoveOptions(durable=False, now=later))
    refused(host, exported_later(ca, tmp_path / "three"), UnsafeKeystoreError, "--adopt-crl FILE")

    given = RenewOptions(adopt_crl=host / layout.CRL, provisioning=options())
    told = renew(ca, ["/base"], options=given).created
    assert "lists revoked serial numbers that were not on record" in told[0]
    import_bundle(host, exported_later(ca, tmp_path / "four"))
    assert revoked_here(host) == 3
    other = filled(tmp_path / "other", ["/a", "/b"])
    remove(other, ["/b"], options=RemoveOptions(durable=False))
    with pytest.raises(InvalidInputError, match="not a CRL that an identity CA of this keystore signed"):
        renew(ca, options=RenewOptions(adopt_crl=other / layout.CRL, provisioning=options()))


def test_a_ca_restored_from_a_backup_does_not_replace_a_bundle_that_revokes_more(
    ca: Path, tmp_path: Path
) -> None:
    shutil.copytree(ca, tmp_path / "backup", symlinks=True)
    remove(ca, ["/base/camera"], options=RemoveOptions(durable=False))
    bundle = exported(ca, tmp_path / "out").path
    content = bundle.read_bytes()
    revoking = (ca / layout.CRL).read_bytes()
    exported_later(ca, tmp_path / "out")  # the same list again is no loss
    shutil.rmtree(ca)
    shutil.copytree(tmp_path / "backup", ca, symlinks=True)
    with pytest.raises(UnsafeKeystoreError, match=r"restored from a backup.*--adopt-crl FILE"):
        exported_later(ca, tmp_path / "out")
    assert bundle.read_bytes() == content
    (tmp_path / "crl.pem").write_bytes(revoking)
    renew(ca, ["/base"], options=RenewOptions(adopt_crl=tmp_path / "crl.pem", provisioning=options()))
    exported_later(ca, tmp_path / "out")


@pytest.mark.parametrize("damage", ["deleted", "damaged"])
def test_without_its_manifest_an_imported_keystore_is_nothing(
    ca: Path, host: Path, tmp_path: Path, damage: str
) -> None:
    """Also with the CRL gone and a revoked enclave put back, which would be a keystore that never was imported."""
    camera = tmp_path / "camera"
    shutil.copytree(host / "enclaves/base/camera", camera, symlinks=True)
    remove(ca, ["/base/camera"], options=RemoveOptions(durable=False))
    bundle = exported(ca, tmp_path / "two").path
    import_bundle(host, bundle)
    shutil.copytree(camera, host / "enclaves/base/camera", symlinks=True)
    for crl in (host / layout.CRL, *host.rglob("enclaves/**/crl.pem")):
        crl.unlink()
    (host / layout.BUNDLE).unlink()
    if damage == "damaged":
        (host / layout.BUNDLE).write_bytes(b"x")
    assert "bundle-differs" in {one.code for one in verify(host).findings}
    with pytest.raises(DamagedKeystoreError, match=r"bundle\.p7s.*Import the bundle again"):
        provision(host, [policy("/base/camera")], options=options(create=False))

    refused_earlier = tmp_path / "first/base.bundle"
    with pytest.raises(UnsafeKeystoreError, match="an earlier bundle"):
        import_bundle(host, refused_earlier)
    import_bundle(host, bundle)
    assert {finding.code for finding in verify(host).findings} <= {"no-ca-key"}
    assert revoked_here(host) == 1 and not (host / "enclaves/base/camera").exists()


def test_another_hosts_bundle_is_refused(ca: Path, host: Path, tmp_path: Path) -> None:
    other = exported(ca, tmp_path / "out", "arm")
    refused(host, other.path, UnsafeKeystoreError, "is for host arm; this is base")
    refused(host, other.path, InvalidInputError, "that of host base, not of arm", named="arm")


def test_a_foreign_bundle_is_refused(host: Path, tmp_path: Path) -> None:
    other = exported(filled(tmp_path / "other", NAMES), tmp_path / "out")
    refused(host, other.path, UnsafeKeystoreError, "by another permissions CA than the one pinned here")


def test_the_first_import_needs_pins_and_holds_to_them(ca: Path, tmp_path: Path) -> None:
    bundle = exported(ca, tmp_path / "out")
    with pytest.raises(UnsafeKeystoreError, match="nothing is pinned on this host yet"):
        import_bundle(tmp_path / "ks", bundle.path, options=ImportOptions(host="base"))
    with pytest.raises(UnsafeKeystoreError, match="trusts a CA that is not pinned"):
        digest = bundle.manifest.authorities[Role.PERMISSIONS][0]
        only = (f"permissions={digest}", f"identity={digest}")
        import_bundle(tmp_path / "ks", bundle.path, options=ImportOptions("base", only))
    for unclear in ((digest,), (f"permissions={digest}",), (f"root={digest}",)):
        with pytest.raises(InvalidInputError, match="identity=SHA256"):
            import_bundle(tmp_path / "ks", bundle.path, options=ImportOptions("base", unclear))
    with pytest.raises(InvalidInputError, match="which host is this"):
        import_bundle(tmp_path / "ks", bundle.path, options=ImportOptions(None, pinned(bundle.manifest)))
    assert not os.path.lexists(tmp_path / "ks")
    first_import(tmp_path / "ks", bundle)


def tampered(source: Path, target: Path, change: Callable[[dict[str, bytes]], None]) -> Path:
    files = files_of_bundle(source.read_bytes())
    change(files)
    target.write_bytes(bundle_bytes(files.pop(layout.BUNDLE, b""), files))
    return target


def newer(ca: Path, tmp_path: Path) -> Path:
    renewed(ca, "/base")
    return exported(ca, tmp_path / "newer").path


def test_a_bundle_with_an_added_ca_is_refused(ca: Path, host: Path, tmp_path: Path) -> None:
    other = filled(tmp_path / "other", ["/a"])
    name = layout.ca_cert(Role.IDENTITY)

    def add(files: dict[str, bytes]) -> None:
        files[name] += (other / name).read_bytes()

    bundle = tampered(newer(ca, tmp_path), tmp_path / "t", add)
    refused(host, bundle, UnsafeKeystoreError, "is not the file that was signed")


CHANGES: Mapping[str, tuple[Callable[[dict[str, bytes]], object], str]] = {
    "a file more": (lambda files: files.update({"enclaves/x/key.pem": b"x"}), "longer than its manifest"),
    "a path out": (lambda files: files.update({"../../etc/passwd": b"x"}), "cut off|not the file|longer"),
    "a file less": (lambda files: files.pop("enclaves/base/cert.pem"), "cut off|not the file that was signed"),
    "another key": (lambda files: files.update({"enclaves/base/key.pem": b"x"}), "not the file that was signed"),
    "no manifest": (lambda files: files.pop(layout.BUNDLE), "not in the form"),
    "another manifest": (
        lambda files: files.update({layout.BUNDLE: files[layout.BUNDLE].replace(b'"base"', b'"arm"')}),
        "not in the form",
    ),
    "governance as manifest": (
        lambda files: files.update({layout.BUNDLE: files[layout.GOVERNANCE]}),
        "is not the manifest of a bundle",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CHANGES)
def test_a_changed_bundle_is_refused(ca: Path, host: Path, tmp_path: Path, name: str) -> None:
    change, told = CHANGES[name]
    bundle = tampered(newer(ca, tmp_path), tmp_path / "t", change)  # type: ignore[arg-type]
    refused(host, bundle, KeystoreError, told)
    import_bundle(host, tmp_path / "newer/base.bundle")


def test_a_bundle_that_is_cut_off_anywhere_is_refused(ca: Path, host: Path, tmp_path: Path) -> None:
    whole = newer(ca, tmp_path).read_bytes()
    end = len(whole)
    for length in [0, 1, 24, 25, 30, *range(1000, end, max(1, end // 12)), end - 1]:
        (tmp_path / "cut").write_bytes(whole[:length])
        refused(host, tmp_path / "cut", KeystoreError, "not a host's bundle|copy it again")


def test_a_keystore_that_was_not_imported_is_never_replaced(ca: Path, tmp_path: Path) -> None:
    filled(tmp_path / "own", ["/a"])
    before = contents(tmp_path / "own")
    with pytest.raises(NotAKeystoreError, match="exists and was not imported"):
        first_import(tmp_path / "own", exported(ca, tmp_path / "out"))
    (tmp_path / "link").symlink_to("own")
    with pytest.raises(NotAKeystoreError, match="exists and was not imported"):
        first_import(tmp_path / "link", exported(ca, tmp_path / "out"))
    assert contents(tmp_path / "own") == before


def test_killed_at_every_step_of_an_import_the_host_has_the_old_keystore_or_the_new_one(
    ca: Path, host: Path, tmp_path: Path
) -> None:
    old = contents(host.resolve())
    bundle = newer(ca, tmp_path)
    new = files_of_bundle(bundle.read_bytes())
    seen = set()
    for at in range(1, 200):
        copy = tmp_path / f"at{at}"
        shutil.copytree(tmp_path / "ks.d", copy / "ks.d", symlinks=True)
        (copy / "ks").symlink_to(os.readlink(host))
        status = _import_killed(copy / "ks", bundle, at)
        found = {
            name: data for name, data in contents((copy / "ks").resolve()).items() if isinstance(data, bytes)
        }
        assert found in (_files(old), new), f"half-imported at step {at}"
        seen.add(found == new)
        if status == 0:
            break
        assert status == KILLED
        assert import_bundle(copy / "ks", bundle).manifest.number > 0, "and the next run completes it"
        assert _files(contents((copy / "ks").resolve())) == new
        assert len(list((copy / "ks.d").iterdir())) == 2
        shutil.rmtree(copy)
    assert status == 0
    assert at > 20
    assert seen == {True, False}


def _files(found: Mapping[str, bytes | str]) -> dict[str, bytes]:
    return {name: data for name, data in found.items() if isinstance(data, bytes)}


def _import_killed(place: Path, bundle: Path, at: int) -> int:
    child = os.fork()
    if child == 0:
        status = 1
        try:
            install_fault(str(place), "kill", at)
            import_bundle(place, bundle)
            status = 0
        finally:
            os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


# Replacing a CA


def test_a_new_ca_comes_by_the_bundles_of_the_old_one(ca: Path, host: Path, tmp_path: Path) -> None:
    for step in (Step.START, Step.SWITCH, Step.FINISH):
        roll_over(ca, step, tuple(Role), options=options())
        report = import_bundle(host, exported(ca, tmp_path / step.value).path)
        assert report.restart is (Restart.TOGETHER if step is Step.SWITCH else Restart.ALL)
    assert verify(host).is_good


@pytest.mark.parametrize("missed", ["start", "start and switch"])
@pytest.mark.parametrize("revokes", [False, True])
def test_a_host_that_slept_through_steps_follows_since_the_old_ca_named_the_new_one(
    ca: Path, host: Path, tmp_path: Path, missed: str, revokes: bool
) -> None:
    """After a revocation, too: the numbers of the new CA's CRLs are a series of their own."""
    if revokes:
        remove(ca, ["/arm"], options=RemoveOptions(durable=False))
        import_bundle(host, exported(ca, tmp_path / "revoked").path)
    for step in (Step.START, Step.SWITCH):
        roll_over(ca, step, tuple(Role), options=options())
    if missed == "start":
        assert import_bundle(host, exported(ca, tmp_path / "switch").path).restart is Restart.TOGETHER
    roll_over(ca, Step.FINISH, tuple(Role), options=options())
    import_bundle(host, exported(ca, tmp_path / "finish").path)
    assert verify(host).is_good
    remove(ca, ["/base/camera"], options=RemoveOptions(durable=False))
    assert import_bundle(host, exported(ca, tmp_path / "next").path).restart is Restart.ALL


def test_only_the_ca_that_a_host_trusts_can_name_the_one_that_follows(
    ca: Path, host: Path, tmp_path: Path
) -> None:
    other = filled(tmp_path / "other", NAMES)
    roll_over(other, Step.START, tuple(Role), options=options())
    roll_over(other, Step.SWITCH, tuple(Role), options=options())
    refused(
        host, exported(other, tmp_path / "foreign").path, UnsafeKeystoreError, "by another permissions CA"
    )


def test_a_host_that_slept_through_two_replacements_has_to_be_told_the_new_ca(
    ca: Path, host: Path, tmp_path: Path
) -> None:
    for step in (Step.START, Step.SWITCH, Step.FINISH) * 2:
        roll_over(ca, step, tuple(Role), options=options())
    bundle = exported(ca, tmp_path / "late")
    refused(host, bundle.path, UnsafeKeystoreError, "pin the new ones with --require-ca")
    pins = ImportOptions(authorities=pinned(bundle.manifest))
    assert import_bundle(host, bundle.path, options=pins).restart is Restart.TOGETHER


# Which enclaves go where


def test_hosts_are_given_by_patterns_and_an_enclave_on_two_of_them_is_refused(
    ca: Path, tmp_path: Path
) -> None:
    hosts = parse_hosts(
        b"version: 1\nhosts:\n  a: {enclaves: ['/base*', /arm]}\n  b: {enclaves: ['/arm*']}\n", "h"
    )
    assert enclaves_of_hosts(NAMES, hosts) == {"a": ["/base", "/base/camera", "/arm"], "b": ["/arm/hand"]}
    vague = parse_hosts(
        b"version: 1\nhosts:\n  a: {enclaves: ['/*']}\n  b: {enclaves: ['/arm*']}\n", "h.yaml"
    )
    with pytest.raises(InvalidInputError, match=r"h.yaml: enclave /arm belongs to several hosts: a, b"):
        enclaves_of_hosts(NAMES, vague)
    with pytest.raises(InvalidInputError, match="would live on several hosts"):
        export_hosts(ca, tmp_path / "out", {"a": ["/arm"], "b": ["/arm*"]})
    shared = BundleOptions(durable=False, accept_shared=True)
    assert len(export_hosts(ca, tmp_path / "out", {"a": ["/arm"], "b": ["/arm*"]}, options=shared)) == 2


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("hosts: {}", "version"),
        ("version: 2", "version: 2 is not known"),
        ("version: 1\nhosts: {../x: {}}", "is not a host name"),
        ("version: 1\nhosts: {a: {enclave: [/x]}}", "hosts.a"),
        ("version: 1\nhosts: {a: {}, a: {}}", "written twice"),
        ("version: 1\nneeds: [{nodes: [/x], devices: [/etc/shadow]}]", "not a path below /dev"),
        ("version: 1\nneeds: [{nodes: [/x], memory: a lot}]", "not a size"),
        ("- 1", "not a mapping"),
    ],
)
def test_a_hosts_file_with_a_mistake_is_refused_with_its_place(text: str, told: str) -> None:
    with pytest.raises(InvalidInputError, match=r"^h\.yaml.*") as error:
        parse_hosts(text.encode(), "h.yaml")
    assert told in str(error.value)


def test_the_commands_from_the_ca_to_the_host(
    ca: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "hosts.yaml").write_text("version: 1\nhosts: {base: {enclaves: ['/base*']}}\n")
    out = tmp_path / "out"
    assert main(["export", str(ca), "-o", str(out), "--hosts", str(tmp_path / "hosts.yaml")]) == 0
    printed = capsys.readouterr()
    assert "on no host: /arm, /arm/hand" in printed.err
    pins = printed.err.rpartition(": ")[2].split()
    assert len(pins) == 4
    bundle = str(out / "base.bundle")
    assert main(["import", str(tmp_path / "ks"), bundle, "--host", "base", *pins]) == 0
    assert "to restart: the changed enclaves" in capsys.readouterr().out
    assert main(["import", str(tmp_path / "ks"), bundle, "--host", "arm"]) == 2
    assert "error: this keystore is that of host base" in capsys.readouterr().err


def test_a_host_that_left_the_hosts_file_is_reported_until_its_keys_are_revoked(
    ca: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hosts, out = tmp_path / "hosts.yaml", tmp_path / "out"
    words = ["export", str(ca), "-o", str(out), "--hosts", str(hosts)]
    hosts.write_text("version: 1\nhosts:\n  base: {enclaves: ['/base*']}\n  arm: {enclaves: ['/arm*']}\n")
    assert main(words) == 0
    assert "any more" not in capsys.readouterr().err
    hosts.write_text("version: 1\nhosts:\n  base: {enclaves: ['/base*', '/arm']}\n")
    assert main(words) == 0
    assert (
        "host arm is not in" in (told := capsys.readouterr().err) and "good keys of /arm, /arm/hand" in told
    )
    assert sorted(path.name for path in out.iterdir()) == ["base.bundle"]
    remove(ca, ["/arm/hand"], options=RemoveOptions(durable=False))
    assert main(words) == 0
    assert "good keys of /arm: revoke them" in capsys.readouterr().err, (
        "the enclave moved, its key is on both"
    )
    renew(ca, ["/arm"], options=RenewOptions(new_keys=True, revoke_old=True, provisioning=options()))
    assert main(words) == 0
    assert "any more" not in capsys.readouterr().err


def test_copies_for_containers_stand_alone_belong_to_their_user_and_are_checked(
    ca: Path, tmp_path: Path
) -> None:
    """Run as root, so that keys can be given away; else they are given to who imports."""
    user = ContainerUser(10001, 10001) if os.geteuid() == 0 else ContainerUser(os.geteuid(), os.getegid())
    bundle = exported(ca, tmp_path / "one")
    pins = ImportOptions(host="base", authorities=pinned(bundle.manifest), owner=user)
    place = tmp_path / "ks"
    import_bundle(place, bundle.path, options=pins)
    camera = place / "containers/e.base.camera"
    assert sorted(os.listdir(camera)) == sorted(layout.RUNTIME_FILES)
    assert not any(path.is_symlink() for path in camera.iterdir())
    info = (camera / "key.pem").stat()
    assert ((info.st_uid, info.st_gid), mode(camera / "key.pem")) == (user, 0o600)
    assert (camera / "cert.pem").stat().st_uid == os.geteuid(), (
        "nothing but the key can be changed by containers"
    )
    assert verify(place).is_good

    remove(ca, ["/arm"], options=RemoveOptions(durable=False))
    import_bundle(place, exported(ca, tmp_path / "two").path)
    assert (camera / "crl.pem").is_file() and (camera / "key.pem").stat().st_uid == user.uid, "remembered"
    assert len(list((tmp_path / "ks.d").glob("[0-9]*"))) == 2, (
        "containers may still have mounted the version before"
    )

    (camera / "cert.pem").write_bytes((place / "enclaves/base/cert.pem").read_bytes())
    assert "container-copy" in {finding.code for finding in verify(place).findings}
    report = import_bundle(place, tmp_path / "two/base.bundle")
    assert "restored: containers/e.base.camera/cert.pem" in report.notes
    assert verify(place).is_good
