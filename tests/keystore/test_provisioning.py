"""Enclaves brought to exactly the wanted state, again and again."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
from datetime import timedelta
from pathlib import Path

import pytest

from keystore import (
    Domains,
    EnclavePolicy,
    InvalidEnclaveNameError,
    InvalidInputError,
    NotAKeystoreError,
    Policy,
    RenewOptions,
    SubjectScheme,
    UnsafeKeystoreError,
    apply_policy,
    create_enclave,
    list_enclaves,
    provision,
    renew,
)
from keystore.disk import layout
from keystore.disk.signed_documents import own_document
from keystore.disk.view import KeystoreView
from keystore.formats.permissions_document import parse_permissions
from keystore.formats.validity import iso
from tests.keystore.kit import (
    ARTICLE,
    DAY,
    NOW,
    actions,
    certificate_of,
    codes,
    contents,
    created,
    filled,
    granted,
    mode,
    openssl,
    options,
    policy,
    snapshot,
)


def test_a_keystore_from_nothing(tmp_path: Path) -> None:
    report = provision(tmp_path / "ks", [policy("/front/camera"), policy("/")], options=options())
    assert actions(report) == {"/": ("created",), "/front/camera": ("created",)}
    assert list_enclaves(tmp_path / "ks") == ["/", "/front/camera"]
    assert codes(tmp_path / "ks") == set()


def test_the_layout_is_sros2s(tmp_path: Path) -> None:
    """Names, links and their relative targets as `ros2 security create_enclave` makes them."""
    found = contents(filled(tmp_path / "ks", ["/", "/front/camera"]))
    assert {name: target for name, target in found.items() if isinstance(target, str)} == {
        "enclaves/identity_ca.cert.pem": "../public/identity_ca.cert.pem",
        "enclaves/permissions_ca.cert.pem": "../public/permissions_ca.cert.pem",
        "enclaves/front/camera/identity_ca.cert.pem": "../../../public/identity_ca.cert.pem",
        "enclaves/front/camera/permissions_ca.cert.pem": "../../../public/permissions_ca.cert.pem",
        "enclaves/front/camera/governance.p7s": "../../governance.p7s",
    }
    assert {name for name, target in found.items() if isinstance(target, bytes)} == {
        "secure-keystore.json",
        "public/identity_ca.cert.pem", "public/permissions_ca.cert.pem",
        "private/identity_ca.key.pem", "private/permissions_ca.key.pem", "private/register.json",
        "enclaves/governance.xml", "enclaves/governance.p7s",
        *(f"enclaves/{where}{name}" for where in ("", "front/camera/")
          for name in ("cert.pem", "key.pem", "permissions.xml", "permissions.p7s")),
    }  # fmt: skip


def test_openssl_accepts_every_certificate_and_document(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ARTICLE)
    assert codes(root) == set()
    for name in ARTICLE:
        directory = root / layout.enclave_directory(name)
        openssl("verify", "-CAfile", directory / "identity_ca.cert.pem", directory / "cert.pem")
        for document in ("permissions", "governance"):
            shown = openssl(
                "smime", "-verify", "-text", "-CAfile", directory / "permissions_ca.cert.pem",
                "-in", directory / f"{document}.p7s",
            )  # fmt: skip
            assert shown.replace("\r\n", "\n").startswith('<?xml version="1.0" encoding="UTF-8"?>\n<dds ')


@pytest.mark.parametrize("umask", [0o000, 0o022, 0o077, 0o777])
def test_modes_do_not_depend_on_the_umask(tmp_path: Path, umask: int) -> None:
    before = os.umask(umask)
    try:
        root = filled(tmp_path / "ks", ["/a"])
    finally:
        os.umask(before)
    assert mode(root / "private") == 0o700
    for key in ("private/identity_ca.key.pem", "private/permissions_ca.key.pem", "enclaves/a/key.pem"):
        assert mode(root / key) == 0o600
    for public in ("enclaves/a/cert.pem", "enclaves/a/permissions.p7s", "public/identity_ca.cert.pem"):
        assert mode(root / public) == 0o644
    for directory in (".", "public", "enclaves", "enclaves/a"):
        assert mode(root / directory) == 0o755


def test_an_unchanged_keystore_can_be_read_only(tmp_path: Path) -> None:
    """The warm path takes no lock and writes nothing, so a launch works from a read-only volume."""
    root = filled(tmp_path / "ks", ["/a"])
    for path in (root, root / "enclaves", root / "enclaves/a"):
        path.chmod(0o555)
    (root / ".lock").unlink()
    assert not provision(root, [policy("/a")], options=options()).changed
    assert not (root / ".lock").exists()


def test_the_warm_path_imports_no_parser(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a", "/b"])
    program = (
        "import sys\n"
        "from tests.keystore.kit import policy\n"
        "from keystore.steps.expiry import expires_soon\n"
        "from keystore.steps.provisioning import provision\n"
        "from datetime import timedelta\n"
        f"report = provision({str(root)!r}, [policy('/a'), policy('/b')])\n"
        f"assert not expires_soon({str(root)!r}, timedelta(days=30))\n"
        "assert not report.changed\n"
        "heavy = {'pydantic', 'lxml', 'yaml', 'asyncio'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=Path(__file__).parents[2], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_only_what_differs_is_signed_again(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a", "/b"])
    before = contents(root)
    report = provision(root, [policy("/a"), policy("/b", "/chatter", "/more")], options=options())
    after = contents(root)
    assert actions(report) == {"/b": ("permissions",)}
    changed = {name for name in after if after[name] != before.get(name)}
    assert changed == {
        "enclaves/b/permissions.xml", "enclaves/b/permissions.p7s", "private/register.json",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("lost", "repaired"),
    [
        ("cert.pem", ("certificate", "permissions")),
        ("permissions.p7s", ("permissions",)),
        ("governance.p7s", ("links",)),
        ("identity_ca.cert.pem", ("links",)),
        ("key.pem", ("key and certificate", "permissions")),
    ],
)
def test_what_is_lost_is_made_again_and_nothing_else(
    tmp_path: Path, lost: str, repaired: tuple[str, ...]
) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    key = (root / "enclaves/a/key.pem").read_bytes()
    (root / "enclaves/a" / lost).unlink()
    assert actions(provision(root, [policy("/a")], options=options())) == {"/a": repaired}
    assert codes(root) == set()
    assert ((root / "enclaves/a/key.pem").read_bytes() == key) is (lost != "key.pem"), "keys stay unless lost"


def test_a_dangling_link_in_a_targets_place_is_replaced(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    (root / "public/identity_ca.cert.pem").rename(root / "public/aside")
    (root / "enclaves/a/governance.p7s").unlink()
    (root / "enclaves/a/governance.p7s").symlink_to("../nowhere.p7s")
    (root / "public/aside").rename(root / "public/identity_ca.cert.pem")
    assert actions(provision(root, [policy("/a")], options=options())) == {"/a": ("links",)}


def test_a_key_that_was_not_issued_for_the_enclave_is_not_certified(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a", "/b"])
    shutil.copy(root / "enclaves/b/key.pem", root / "enclaves/a/key.pem")
    assert "key-mismatch" in codes(root)
    assert actions(provision(root, [policy("/a")], options=options())) == {
        "/a": ("key and certificate", "permissions", "old certificate revoked")
    }
    assert (root / "enclaves/a/key.pem").read_bytes() != (root / "enclaves/b/key.pem").read_bytes()
    assert codes(root) == set()


def test_another_enclaves_certificate_is_not_taken_for_ones_own(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a", "/b"])
    for name in ("key.pem", "cert.pem"):
        shutil.copy(root / "enclaves/b" / name, root / "enclaves/a" / name)
    assert "wrong-subject" in codes(root)
    provision(root, [policy("/a")], options=options())
    assert codes(root) == set()


def test_expired_certificates_are_renewed_with_their_permissions(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"], now=NOW, lifetime=90 * DAY)
    key = (root / "enclaves/a/key.pem").read_bytes()
    later = options(now=NOW + 91 * DAY, lifetime=90 * DAY)
    assert "expired" in codes(root, now=NOW + 91 * DAY)
    assert actions(provision(root, [policy("/a")], options=later)) == {"/a": ("certificate", "permissions")}
    assert codes(root, now=NOW + 91 * DAY) == set()
    assert (root / "enclaves/a/key.pem").read_bytes() == key


def test_what_ends_soon_is_renewed_only_when_asked(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"], now=NOW, lifetime=90 * DAY)
    later = options(now=NOW + 80 * DAY, lifetime=90 * DAY)
    assert not provision(root, [policy("/a")], options=later).changed
    asked = later._replace(renew_within=timedelta(days=30))
    assert provision(root, [policy("/a")], options=asked).changed


def test_the_permissions_end_with_the_certificate(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"], now=NOW, lifetime=90 * DAY)
    document = own_document(KeystoreView(root), "enclaves/a/permissions.p7s")
    permissions = parse_permissions(document)
    assert tuple(map(iso, permissions.validity)) == ("2031-04-30T12:00:00Z", "2031-07-30T12:00:00Z")
    assert permissions.subject == "CN=ros.a"


def test_a_new_domain_extends_the_governance(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    report = provision(root, [policy("/a")], options=options(domains=Domains.single(42)))
    assert report.created == ("governance signed for domains 42",)
    assert b"<id>0</id><id>42</id>" in (root / "enclaves/governance.xml").read_bytes()
    assert codes(root) == set()


@pytest.mark.parametrize("name", ["/../escape", "/a/../../b", "relative", "/a/", ""])
def test_bad_names_write_nothing(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidEnclaveNameError):
        provision(tmp_path / "ks", [EnclavePolicy(name, ())], options=options())
    assert list(tmp_path.iterdir()) == []


def test_one_enclave_given_twice(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="given twice"):
        provision(tmp_path / "ks", [policy("/a"), policy("/a")], options=options())


def test_a_name_that_differs_only_in_case_from_an_existing_one(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/robot/a"])
    with pytest.raises(InvalidEnclaveNameError, match="only in case"):
        provision(root, [policy("/Robot/b")], options=options())


def test_create_enclave_grants_nothing_unless_asked(tmp_path: Path) -> None:
    root = created(tmp_path / "ks")
    create_enclave(root, "/a", options=options())
    create_enclave(root, "/b", allow_all=True, options=options())
    assert granted(root, "/a") == {"ros_discovery_info"}
    assert "rt/*" in granted(root, "/b")


def test_repeating_create_enclave_never_widens_permissions(tmp_path: Path) -> None:
    """sros2 rewrites them with its allow-all default."""
    root = filled(tmp_path / "ks", ["/a"])
    before = snapshot(root)
    assert not create_enclave(root, "/a", options=options()).changed
    assert snapshot(root) == before


def test_apply_policy_needs_a_keystore(tmp_path: Path) -> None:
    with pytest.raises(NotAKeystoreError):
        apply_policy(tmp_path / "ks", Policy((policy("/a"),)), options=options())
    root = created(tmp_path / "ks")
    apply_policy(root, Policy((policy("/a"), policy("/b"))), options=options())
    assert granted(root, "/b") == {"ros_discovery_info", "rt/chatter"}


def test_compatible_subjects_refuse_names_that_cyclone_confuses(tmp_path: Path) -> None:
    wanted = options(subjects=SubjectScheme.COMPATIBLE)
    root = created(tmp_path / "ks", subjects=SubjectScheme.COMPATIBLE)
    create_enclave(root, "/robot/talker", options=wanted)
    with pytest.raises(InvalidInputError, match="/talker could use the permissions of /robot/talker"):
        create_enclave(root, "/talker", options=wanted)
    assert list_enclaves(root) == ["/robot/talker"]
    create_enclave(root, "/talker", options=wanted._replace(allow_subject_overlap=True))
    assert "borrowed-permissions" in codes(root)


def test_an_enclave_behind_a_link_is_refused(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    (tmp_path / "elsewhere").mkdir()
    (root / "enclaves/b").symlink_to(tmp_path / "elsewhere")
    for name in ("/b", "/b/c"):
        with pytest.raises(UnsafeKeystoreError, match="must be a real directory"):
            provision(root, [policy(name)], options=options())
    assert list((tmp_path / "elsewhere").iterdir()) == []


def test_a_planted_link_at_a_target_is_replaced_not_followed(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    victim = tmp_path / "victim"
    victim.write_text("mine")
    (root / "enclaves/a/permissions.xml").unlink()
    (root / "enclaves/a/permissions.xml").symlink_to(victim)
    assert "strange-link" in codes(root)
    provision(root, [policy("/a", "/new")], options=options())
    assert victim.read_text() == "mine"
    assert not (root / "enclaves/a/permissions.xml").is_symlink()
    assert codes(root) == set()


@pytest.mark.parametrize("name", ["cert.pem", "key.pem"])
def test_a_link_in_place_of_an_identity_is_refused(tmp_path: Path, name: str) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    (root / "enclaves/a" / name).rename(tmp_path / name)
    (root / "enclaves/a" / name).symlink_to(tmp_path / name)
    with pytest.raises(UnsafeKeystoreError):
        provision(root, [policy("/a")], options=options())


@pytest.mark.parametrize("name", ["private/identity_ca.key.pem", "public/permissions_ca.cert.pem"])
def test_a_ca_file_that_links_out_of_the_keystore_is_refused(tmp_path: Path, name: str) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    (root / name).rename(tmp_path / "out.pem")
    (root / name).symlink_to(tmp_path / "out.pem")
    with pytest.raises(UnsafeKeystoreError, match="rm "):
        provision(root, [policy("/b")], options=options())
    assert "strange-link" in codes(root)


@pytest.mark.parametrize("private", ["private", "private/identity_ca.key.pem", "enclaves/a/key.pem"])
def test_private_parts_that_others_can_write_are_refused_with_the_repair(
    tmp_path: Path, private: str
) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    path = root / private
    path.chmod(stat.S_IMODE(path.stat().st_mode) | 0o020)
    with pytest.raises(UnsafeKeystoreError, match=r"chmod (-R go-w|go-rwx)"):
        provision(root, [policy("/a", "/new"), policy("/b")], options=options())


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("private", ["private", "private/permissions_ca.key.pem", "enclaves/a/key.pem"])
def test_foreign_private_parts_are_refused_with_the_repair(tmp_path: Path, private: str) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    os.chown(root / private, 12345, -1)
    with pytest.raises(UnsafeKeystoreError, match="chown -R 0"):
        provision(root, [policy("/a", "/new")], options=options())


def test_world_writable_places_are_refused(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    (root / "enclaves").chmod(0o777)
    with pytest.raises(UnsafeKeystoreError, match="chmod o-w"):
        provision(root, [policy("/b")], options=options())
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    with pytest.raises(UnsafeKeystoreError, match="everybody can rename"):
        provision(tmp_path / "open/ks", [policy("/a")], options=options())


def test_a_key_that_others_could_read_is_replaced_and_its_certificate_revoked(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    key = root / "enclaves/a/key.pem"
    exposed = key.read_bytes()
    key.chmod(0o644)
    assert actions(provision(root, [policy("/a")], options=options())) == {
        "/a": ("key and certificate", "permissions", "old certificate revoked")
    }
    assert mode(key) == 0o600 and key.read_bytes() != exposed
    assert codes(root) == set()


def test_no_symlinks_on_this_file_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """FAT and some network shares: copies, which follow their source."""

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "symlink", refuse)
    root = filled(tmp_path / "ks", ["/a", "/a/b"])
    assert not any(path.is_symlink() for path in root.rglob("*"))
    assert codes(root) == set()
    assert not provision(root, [policy("/a"), policy("/a/b")], options=options()).changed
    report = provision(root, [policy("/a"), policy("/a/b")], options=options(domains=Domains.single(7)))
    assert {"/a", "/a/b"} == set(actions(report)), "the copies of the governance are refreshed"
    assert codes(root) == set()
    (root / "enclaves/a/governance.p7s").write_bytes(b"old")
    assert "copy-differs" in codes(root)


URI = b"pkcs11:token=robot;object=a;type=private"


def with_token(tmp_path: Path, uri: bytes) -> Path:
    root = filled(tmp_path / "ks", ["/a"])
    (root / "enclaves/a/key.pem").unlink()
    (root / "enclaves/a/key.p11").write_bytes(uri)
    return root


def test_a_key_in_a_token_is_certified_again_and_never_replaced(tmp_path: Path) -> None:
    root = with_token(tmp_path, URI)
    key = certificate_of(root, "/a").public_key
    assert codes(root) == set()
    report = provision(root, [policy("/a", "/other")], options=options())
    assert "key and certificate" not in actions(report)["/a"]
    assert certificate_of(root, "/a").public_key == key and not (root / "enclaves/a/key.pem").exists()
    with pytest.raises(InvalidInputError, match="in a token"):
        renew(root, ["/a"], options=RenewOptions(new_keys=True, provisioning=options()))
    (root / "enclaves/a/cert.pem").write_bytes(
        (filled(tmp_path / "other", ["/a"]) / "enclaves/a/cert.pem").read_bytes()
    )
    with pytest.raises(InvalidInputError, match="in a token"):
        provision(root, [policy("/a", "/other")], options=options())


@pytest.mark.parametrize(
    "uri", [b"garbage", b"", b"pkcs11:", b"pkcs11:token=robot", URI + b"\nmore", b"file:///object=a"]
)
def test_what_names_no_key_in_a_token_is_not_good(tmp_path: Path, uri: bytes) -> None:
    assert "key" in codes(with_token(tmp_path, uri))
