"""Time passes, SROS2 keystores are repaired, CAs are replaced."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from keystore import (
    DamagedKeystoreError,
    InvalidInputError,
    RemoveOptions,
    RenewOptions,
    Role,
    Severity,
    Step,
    create_enclave,
    expires_soon,
    list_enclaves,
    provision,
    remove,
    renew,
    roll_over,
    status,
    verify,
)
from keystore.disk import layout
from keystore.disk.view import KeystoreView
from keystore.formats.certificate import read_certificates
from tests.dds import sros2_style
from tests.keystore.kit import (
    ARTICLE,
    DAY,
    NOW,
    actions,
    codes,
    contents,
    filled,
    granted,
    mode,
    openssl,
    options,
    policy,
    snapshot,
)


def renewing(**changes: object) -> RenewOptions:
    own = {name: changes.pop(name) for name in ("within", "everything", "new_keys") if name in changes}
    return RenewOptions(provisioning=options(**changes), **own)  # type: ignore[arg-type]


@pytest.fixture
def sros2(tmp_path: Path) -> Path:
    """A keystore as SROS2 writes it: one CA, CN=/path, no key usage, keys readable by all."""
    grants = {name: sros2_style.Grant(publish=("/chatter",)) for name in ARTICLE}
    before = os.umask(0o022)  # SROS2 leaves keys to the umask: with this one all can read them
    try:
        sros2_style.create(tmp_path / "sros2", 0, grants)
    finally:
        os.umask(before)
    return tmp_path / "sros2"


def test_an_sros2_keystore_is_reported_as_exposed(sros2: Path) -> None:
    assert list_enclaves(sros2) == sorted(ARTICLE)
    found = verify(sros2).findings
    exposed = {finding.code for finding in found if finding.severity is Severity.EXPOSURE}
    assert exposed == {"shared-ca", "leaf-can-sign", "borrowed-permissions", "no-register"}
    assert all(finding.repair for finding in found if finding.severity.fails)
    assert not any(
        finding.repair.startswith("rm ") for finding in found
    )  # renew keeps what its documents grant


def test_an_sros2_keystore_is_extended_in_place(sros2: Path) -> None:
    before = contents(sros2)
    report = provision(sros2, [policy("/new")], options=options())
    assert [warning.split(";")[0] for warning in report.warnings] == [
        "this keystore has one CA for identities and permissions (CVE-2023-24010, CVE-2023-24011)",
        "the CA keys can be read by others",
    ]
    after = contents(sros2)
    assert {name for name in after if before.get(name) != after[name]} == {
        "private/register.json", "enclaves/governance.p7s", "enclaves/governance.xml",
        *(f"enclaves/new/{name}" for name in layout.ENCLAVE_FILES - {"crl.pem"}),
    }  # fmt: skip
    directory = sros2 / "enclaves/new"
    openssl("verify", "-CAfile", directory / "identity_ca.cert.pem", directory / "cert.pem")
    assert "leaf-can-sign" not in {f.code for f in verify(sros2).findings if "enclaves/new" in f.place}


def test_renew_repairs_an_sros2_keystore(sros2: Path) -> None:
    keys = {name: (sros2 / layout.enclave_directory(name) / "key.pem").read_bytes() for name in ARTICLE}
    grants = {name: granted(sros2, name) for name in ARTICLE}
    renew(sros2, options=renewing())
    assert codes(sros2) == set()
    assert not KeystoreView(sros2).shares_one_ca
    assert mode(sros2 / "private") == 0o700
    for name in ARTICLE:
        key = sros2 / layout.enclave_directory(name) / "key.pem"
        assert key.read_bytes() != keys[name] and mode(key) == 0o600, "SROS2 had left them readable"
        assert granted(sros2, name) == grants[name]
    before = snapshot(sros2)
    assert not renew(sros2, options=renewing()).changed
    assert snapshot(sros2) == before


def test_the_take_over_names_what_it_could_not_carry_over(sros2: Path) -> None:
    ca = sros2_style.Credential.of_ca(sros2)
    document = (sros2 / "enclaves/a/permissions.xml").read_text()
    changed = document.replace("<default>DENY", "<default>ALLOW").replace("rt/chatter", "rt/[^c]*")
    (sros2 / "enclaves/a/permissions.p7s").write_bytes(ca.sign(changed))
    governance = (
        (sros2 / "enclaves/governance.xml").read_text().replace("<id>0</id>", "<id>0</id><id>300</id>")
    )
    (sros2 / "enclaves/governance.p7s").write_bytes(ca.sign(governance))
    done = " ".join(renew(sros2, options=renewing()).created)
    for named in (
        "of the governance: domain ids from 300",
        "of /a: default ALLOW",
        r"of /a: publish 'rt/[^c]*'",
    ):
        assert f"not taken over: {named}" in done.replace("of the permissions of", "of"), done
    assert codes(sros2) == set() and granted(sros2, "/a") == {"ros_discovery_info"}
    assert granted(sros2, "/b/a") == {"ros_discovery_info", "rt/chatter"}


def test_what_an_enclave_of_the_old_keystore_signed_is_not_taken_over(sros2: Path) -> None:
    """Before the repair anybody with an enclave's key could sign; renew signs only what the CA had signed."""
    attacker = sros2_style.Credential.read(sros2 / "enclaves/a")
    document = (sros2 / "enclaves/a/permissions.xml").read_text().replace("rt/chatter", "*")
    (sros2 / "enclaves/a/permissions.p7s").write_bytes(attacker.sign(document))
    (sros2 / "enclaves/a/permissions.xml").write_text(document)
    with pytest.raises(DamagedKeystoreError, match="not the permissions CA"):
        renew(sros2, options=renewing())


def test_only_what_is_due_is_renewed(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/soon"], now=NOW, lifetime=20 * DAY)
    filled(root, ["/late"], now=NOW, lifetime=300 * DAY)
    report = renew(root, options=renewing(now=NOW, lifetime=100 * DAY))
    assert actions(report) == {"/soon": ("certificate", "permissions")}
    assert not expires_soon(root, 30 * DAY, now=NOW)


def test_what_provisioning_saw_need_not_be_read_again(tmp_path: Path) -> None:
    """The validities of a report stand for files: the same answer, without a look at them."""
    root = filled(tmp_path / "ks", ["/a", "/b"], now=NOW, lifetime=20 * DAY)
    known = provision(root, [policy("/a"), policy("/b")], options=options(now=NOW)).validities
    assert known.keys() == {"/a", "/b"}
    soon = expires_soon(root, 30 * DAY, enclaves=known, now=NOW)
    assert [one.subject for one in soon] == [
        f"{what} of {name}" for what in ("certificate", "permissions") for name in known
    ]
    (root / "enclaves/a/cert.pem").unlink()
    assert expires_soon(root, 30 * DAY, enclaves=known, known=known, now=NOW) == soon
    assert not expires_soon(root, 10 * DAY, enclaves=known, known=known, now=NOW)
    assert provision(root, [policy("/a")], options=options(now=NOW)).validities == {"/a": known["/a"]}


def test_named_enclaves_are_renewed_in_any_case(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a", "/b"])
    key = (root / "enclaves/a/key.pem").read_bytes()
    report = renew(root, ["/a"], options=renewing())
    assert actions(report) == {"/a": ("certificate", "permissions")}
    assert (root / "enclaves/a/key.pem").read_bytes() == key
    report = renew(root, ["/a"], options=renewing(new_keys=True))
    assert actions(report) == {"/a": ("key and certificate", "permissions")}
    assert (root / "enclaves/a/key.pem").read_bytes() != key
    assert granted(root, "/a") == {"rt/chatter", "ros_discovery_info"}
    assert codes(root) == set()
    with pytest.raises(InvalidInputError, match="no enclave /c"):
        renew(root, ["/c"], options=renewing())


def test_renewed_permissions_are_those_a_launch_expects(tmp_path: Path) -> None:
    """Re-dated documents are byte for byte what provision would sign: the next launch changes nothing."""
    root = filled(tmp_path / "ks", ["/a"])
    renew(root, ["/a"], options=renewing())
    assert not provision(root, [policy("/a")], options=options()).changed


def test_status_lists_the_earliest_first(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"], now=NOW, lifetime=50 * DAY, ca_lifetime=200 * DAY)
    report = status(root, now=NOW)
    assert [(one.subject, (one.not_after - NOW).days) for one in report.expiries] == [
        ("certificate of /a", 50), ("permissions of /a", 50), ("identity CA", 200), ("permissions CA", 200),
    ]  # fmt: skip
    assert [one.subject for one in report.due(60 * DAY)] == ["certificate of /a", "permissions of /a"]
    assert status(root, now=NOW + 60 * DAY).due(0 * DAY)[0].is_valid(NOW + 60 * DAY) is False


def test_an_expired_ca_is_said_and_rolled_over(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"], now=NOW, ca_lifetime=50 * DAY)
    late = NOW + 60 * DAY
    with pytest.raises(DamagedKeystoreError, match=r"renew \S+ --ca start"):
        renew(root, options=renewing(now=late))
    for step in Step:
        roll_over(root, step, options=options(now=late))
    assert codes(root, now=late) == set()


def bundle(root: Path, role: Role) -> list[bytes]:
    return [facts.der for facts in read_certificates((root / layout.ca_cert(role)).read_bytes(), "")]


@pytest.mark.parametrize("roles", [tuple(Role), (Role.IDENTITY,), (Role.PERMISSIONS,)])
def test_roll_over_step_by_step(tmp_path: Path, roles: tuple[Role, ...]) -> None:
    root = filled(tmp_path / "ks", ARTICLE)
    keys = {name: (root / layout.enclave_directory(name) / "key.pem").read_bytes() for name in ARTICLE}
    old = {role: bundle(root, role)[0] for role in Role}

    roll_over(root, Step.START, roles, options=options())
    for role in roles:
        first, second = bundle(root, role)
        assert first == old[role] != second, "Cyclone DDS, which reads one certificate, sees no change yet"
    assert codes(root) == set()

    roll_over(root, Step.SWITCH, roles, options=options())
    for role in roles:
        first, second = bundle(root, role)
        assert first != old[role] == second
    assert codes(root) == set()

    roll_over(root, Step.FINISH, roles, options=options())
    for role in Role:
        (only,) = bundle(root, role)
        assert (only != old[role]) is (role in roles)
    assert codes(root) == set()
    for name in ARTICLE:
        assert (root / layout.enclave_directory(name) / "key.pem").read_bytes() == keys[name]
        assert granted(root, name) == {"rt/chatter", "ros_discovery_info"}


@pytest.mark.parametrize("step", Step)
def test_each_step_can_be_repeated(tmp_path: Path, step: Step) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    for earlier in list(Step)[: list(Step).index(step) + 1]:
        roll_over(root, earlier, options=options())
    before = snapshot(root)
    roll_over(root, step, options=options())
    assert snapshot(root) == before


@pytest.mark.parametrize("left", [["cert.pem"], []])
def test_a_switch_interrupted_while_it_forgets_is_completed(tmp_path: Path, left: list[str]) -> None:
    """The last steps of ``switch`` remove what waited in private/next, the key first."""
    root = filled(tmp_path / "ks", ["/a"])
    for step in (Step.START, Step.SWITCH):
        roll_over(root, step, options=options())
    waiting = root / "private/next/identity_ca"
    waiting.mkdir(parents=True, mode=0o700)
    (root / "private/next").chmod(0o700)
    for name in left:
        (waiting / name).write_bytes((root / "public/identity_ca.cert.pem").read_bytes())
    roll_over(root, Step.SWITCH, options=options())
    assert not (root / "private/next").exists()
    assert codes(root) == set()


def test_steps_out_of_order_are_refused(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    with pytest.raises(InvalidInputError, match="first --ca start"):
        roll_over(root, Step.SWITCH, options=options())
    roll_over(root, Step.START, options=options())
    with pytest.raises(InvalidInputError, match="first --ca switch"):
        roll_over(root, Step.FINISH, options=options())


def test_revocations_skip_the_overlap(tmp_path: Path) -> None:
    """A CRL names one CA: with two trusted the old one's revocations would be forgotten."""
    root = filled(tmp_path / "ks", ["/a", "/b"])
    remove(root, ["/b"], options=RemoveOptions(durable=False))
    roll_over(root, Step.START, options=options())
    roll_over(root, Step.SWITCH, options=options())
    assert len(bundle(root, Role.IDENTITY)) == 1
    assert not (root / "public/crl.pem").exists() and not (root / "enclaves/a/crl.pem").is_symlink()
    assert codes(root) == set()


def test_a_repaired_keystore_keeps_working_with_new_enclaves(sros2: Path) -> None:
    renew(sros2, options=renewing())
    create_enclave(sros2, "/z", options=options())
    assert codes(sros2) == set()
