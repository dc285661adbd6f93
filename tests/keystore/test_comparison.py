"""A keystore held against what is wanted: each thing that makes a difference, beside what makes none.

``differences`` answers before each process; ``provision`` asks the same (``compare``) and repairs, so that a report in
which nothing was done says that the comparison saw nothing.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest

from enclave_addons.deployment import export
from keystore import (
    CreateOptions,
    DamagedKeystoreError,
    Domains,
    EnclavePolicy,
    LaunchHold,
    NotAKeystoreError,
    Policy,
    ProvisionOptions,
    ProvisionReport,
    RemoveOptions,
    Role,
    SigningUnavailableError,
    Step,
    UnsafeKeystoreError,
    apply_policy,
    create_enclaves,
    create_keystore,
    provision,
    remove,
    roll_over,
)
from keystore.disk import layout
from keystore.errors import WrongClockError
from keystore.formats.validity import later, utc_now
from keystore.steps.comparison import differences
from tests.dds import sros2_style
from tests.keystore import kit

HOUR, DAY = timedelta(hours=1), timedelta(days=1)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """/a and /b as wanted, and /gone revoked, so that there is a CRL."""
    root = kit.filled(tmp_path_factory.mktemp("made") / "ks", ["/a", "/b", "/gone"])
    remove(root, ["/gone"], options=RemoveOptions(durable=False))
    return root


@pytest.fixture
def root(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "ks", symlinks=True))


def told(root: Path, policy: EnclavePolicy | None = None, **options: object) -> tuple[str, ...]:
    return differences(root, policy or kit.policy("/a"), options=kit.options(**options))


def again(root: Path, *policies: EnclavePolicy, **options: object) -> ProvisionReport:
    return provision(root, policies or [kit.policy("/a"), kit.policy("/b")], options=kit.options(**options))


def replaced(root: Path, name: str, old: bytes, new: bytes) -> None:
    content = (root / name).read_bytes()
    assert old in content
    (root / name).write_bytes(content.replace(old, new))


DAMAGE: dict[str, tuple[Callable[[Path], object], str]] = {
    "the CRL is gone": (lambda root: (root / layout.CRL).unlink(), "the CRL is missing"),
    "no key": (lambda root: (root / "enclaves/a/key.pem").unlink(), "no private key"),
    "an open key": (
        lambda root: (root / "enclaves/a/key.pem").chmod(0o640),
        "others could read its private key (mode 0640)",
    ),
    "no certificate": (lambda root: (root / "enclaves/a/cert.pem").unlink(), "no certificate"),
    "another's certificate": (
        lambda root: shutil.copy(root / "enclaves/b/cert.pem", root / "enclaves/a/cert.pem"),
        "the certificate names another subject",
    ),
    "no permissions": (lambda root: (root / "enclaves/a/permissions.p7s").unlink(), "no permissions"),
    "another's permissions": (
        lambda root: shutil.copy(root / "enclaves/b/permissions.p7s", root / "enclaves/a/permissions.p7s"),
        "other permissions",
    ),
    "permissions cut off": (
        lambda root: (root / "enclaves/a/permissions.p7s").write_bytes(b"MIME-Version: 1.0\n"),
        "the signed permissions cannot be read",
    ),
    "an edited twin": (
        lambda root: replaced(root, "enclaves/a/permissions.xml", b"rt/chatter", b"rt/other"),
        "permissions.xml differs from what is signed",
    ),
    "a link elsewhere": (
        lambda root: relinked(root / "enclaves/a/governance.p7s", "../../public/crl.pem"),
        "governance.p7s missing or out of step",
    ),
    "no directory": (lambda root: shutil.rmtree(root / "enclaves/a"), "new enclave"),
}


def relinked(path: Path, target: str) -> None:
    path.unlink()
    path.symlink_to(target)


class TestDifferences:
    def test_are_none_where_all_is_as_it_was_left(self, root: Path) -> None:
        assert told(root) == ()
        assert told(root, kit.policy("/b")) == ()

    @pytest.mark.parametrize("name", DAMAGE)
    def test_are_told_of_the_enclave_and_mended_by_the_next_start(self, root: Path, name: str) -> None:
        damage, reason = DAMAGE[name]
        damage(root)
        assert any(text.startswith(reason) for text in told(root)), told(root)
        neighbour = told(root, kit.policy("/b"))
        assert (neighbour == ()) is (name != "the CRL is gone"), "whose files were not touched"
        assert again(root).changed
        assert told(root) == () and not again(root).changed

    def test_are_told_of_a_governance_that_lacks_a_domain(self, root: Path) -> None:
        assert told(root, domains=Domains.single(0)) == ()
        found = told(root, domains=Domains.single(7))
        assert "the governance is not what it was" in found and "other permissions" in found

    def test_are_told_of_a_governance_that_was_put_back(self, root: Path, tmp_path: Path) -> None:
        shutil.copy(root / layout.GOVERNANCE, tmp_path / "old.p7s")
        again(root, domains=Domains(((0, 3),)))
        assert told(root) == ()
        shutil.copy(tmp_path / "old.p7s", root / layout.GOVERNANCE)
        assert "the governance is not what it was" in told(root)
        report = again(root, domains=Domains(((0, 3),)))
        assert report.created == ("governance signed for domains 0-3",) and kit.actions(report) == {}
        assert told(root) == ()

    def test_are_told_of_a_policy_that_grants_something_else(self, root: Path) -> None:
        assert told(root, kit.policy("/a", "/chatter")) == ()
        assert told(root, kit.policy("/a", "/other")) == ("other permissions",)

    def test_are_none_for_what_a_start_would_only_renew(self, root: Path) -> None:
        """What ends soon is good until then."""
        margin = timedelta(days=20 * 365)
        assert told(root, renew_within=margin) == ()
        assert told(root, now=later(utc_now(), timedelta(days=11 * 365))) != ()

    def test_cannot_be_told_of_what_is_not_a_keystore(self, root: Path, tmp_path: Path) -> None:
        (root / layout.GOVERNANCE).unlink()
        with pytest.raises(NotAKeystoreError, match="is not a complete keystore"):
            told(root)
        with pytest.raises(NotAKeystoreError, match="there is no keystore at"):
            told(tmp_path / "none")

    def test_a_ca_that_somebody_put_in_is_refused_by_both(self, root: Path) -> None:
        trusted = root / layout.ca_cert(Role.IDENTITY)
        trusted.write_bytes(trusted.read_bytes() + sros2_style.issue("sros2CA", is_ca=True).certificate_pem)
        for look in (told, again):
            with pytest.raises(UnsafeKeystoreError, match="holds a CA that this keystore did not make"):
                look(root)


class TestWhatAStartFinds:
    def test_nothing_is_done_where_all_is_as_wanted(self, root: Path) -> None:
        before = kit.snapshot(root)
        report = again(root)
        assert not report.changed and [one.enclave for one in report.enclaves] == ["/a", "/b"]
        assert kit.snapshot(root) == before

    @pytest.mark.parametrize("name", ["private/incoming", "private/crl-unlinked"])
    def test_an_interrupted_run_is_completed(self, root: Path, name: str) -> None:
        if name == "private/incoming":
            (root / name).mkdir(mode=0o700)
        else:
            (root / name).touch(mode=0o600)
            (root / "enclaves/a/crl.pem").unlink()
        again(root, kit.policy("/b"))
        assert not (root / name).exists()
        assert (root / "enclaves/a/crl.pem").exists(), (
            "the CRL is given to those that were not asked for, too"
        )

    def test_a_keystore_without_register_gets_one(self, root: Path) -> None:
        (root / layout.REGISTER).unlink()
        report = again(root)
        assert any("register made from" in text for text in report.created)
        assert not again(root).changed

    def test_a_keystore_is_made_only_where_that_was_allowed(self, tmp_path: Path) -> None:
        with pytest.raises(NotAKeystoreError, match="there is no keystore at"):
            again(tmp_path / "ks", create=False)
        assert not (tmp_path / "ks").exists()
        assert again(tmp_path / "ks").changed

    def test_a_directory_of_somebody_else_is_left_alone(self, tmp_path: Path) -> None:
        (tmp_path / "photos").mkdir()
        (tmp_path / "photos/me.jpg").write_text("")
        with pytest.raises(NotAKeystoreError, match="is not a keystore, and other files are in it"):
            again(tmp_path / "photos")
        assert [path.name for path in (tmp_path / "photos").iterdir()] == ["me.jpg"]

    def test_a_ca_that_is_not_valid_cannot_issue(self, root: Path, tmp_path: Path) -> None:
        """With revoked certificates (``root``) the CRL would be signed first."""
        kit.filled(tmp_path / "other", ["/a"])
        for keystore in (root, tmp_path / "other"):
            with pytest.raises(WrongClockError, match="the CAs of this keystore begin at"):
                again(keystore, now=utc_now() - timedelta(days=365))
            with pytest.raises(DamagedKeystoreError, match="a CA of this keystore is expired"):
                again(keystore, now=utc_now() + timedelta(days=11 * 365))
        with pytest.raises(DamagedKeystoreError, match=r"renew .* --ca start"):
            remove(
                root, ["/b"], options=RemoveOptions(durable=False, now=utc_now() + timedelta(days=11 * 365))
            )
        assert not again(root).changed, "nothing was done"

    def test_what_is_said_of_it_helps(self, root: Path) -> None:
        moment = utc_now() + timedelta(days=11 * 365)
        for step in Step:
            roll_over(root, step, tuple(Role), options=kit.options(now=moment))
        assert not again(root, now=moment).changed and told(root, now=moment) == ()


class TestTheFirstEnd:
    """``ends``: when the first of what a launch needs ends."""

    def test_is_that_of_the_crl(self, tmp_path: Path) -> None:
        """Certificates that were renewed after the CRL was signed can last longer than it."""
        root = kit.filled(tmp_path / "ks", ["/a", "/b"], lifetime=30 * DAY)
        remove(root, ["/b"], options=RemoveOptions(durable=False))
        again(root, lifetime=900 * DAY, renew_within=60 * DAY)
        ends = again(root).ends
        assert ends is not None and 364 * DAY < ends - utc_now() < 366 * DAY

    @pytest.mark.parametrize(("days", "first"), [(20, "enclave"), (200, "CA")])
    def test_is_that_of_a_certificate_or_of_a_ca(self, tmp_path: Path, days: int, first: str) -> None:
        options = kit.options(ca_lifetime=100 * DAY, lifetime=min(days, 99) * DAY, revoke=False)
        provision(tmp_path / "ks", [kit.policy("/a")], options=options)
        if first == "CA":
            shutil.rmtree(tmp_path / "ks/enclaves/a")
            report = provision(tmp_path / "ks", [], options=options)
        else:
            report = provision(tmp_path / "ks", [kit.policy("/a")], options=options)
        expected = {"enclave": 20 * DAY, "CA": 100 * DAY}[first]
        assert report.ends is not None and abs(report.ends - utc_now() - expected) < HOUR


class TestDomains:
    def test_of_the_governance_hold_where_none_are_given(self, root: Path) -> None:
        again(root, domains=Domains(((0, 3),)))
        assert told(root) == (), "the enclave was given all four"
        assert b"<min>0</min><max>3</max>" in (root / "enclaves/a/permissions.xml").read_bytes()

    def test_of_one_enclave_may_be_fewer(self, root: Path) -> None:
        wide = Domains(((0, 3),))
        again(root, domains=wide, enclave_domains={"/a": Domains.single(2)})
        assert b"<domains><id>2</id></domains>" in (root / "enclaves/a/permissions.xml").read_bytes()
        assert b"<max>3</max>" in (root / "enclaves/b/permissions.xml").read_bytes()
        assert told(root, domains=wide, enclave_domains={"/a": Domains.single(2)}) == ()
        assert told(root, domains=wide) == ("other permissions",)

    def test_of_a_new_keystore_are_0(self, tmp_path: Path) -> None:
        again(tmp_path / "ks")
        assert b"<domains><id>0</id></domains>" in (tmp_path / "ks/enclaves/a/permissions.xml").read_bytes()


class TestALifeThatWasAskedFor:
    @pytest.mark.parametrize("form", ["lifetime", "valid_until", "both, of which the date counts"])
    def test_is_given_to_existing_enclaves_too(self, root: Path, form: str) -> None:
        def asked(days: int) -> ProvisionOptions:
            lifetime, end = days * DAY, utc_now() + days * DAY
            if form == "both, of which the date counts":
                return kit.options(lifetime=2 * lifetime, valid_until=end)
            return kit.options(**{form: lifetime if form == "lifetime" else end})

        report = create_enclaves(root, ["/a"], options=asked(10))
        assert kit.actions(report) == {"/a": ("certificate", "permissions", "old certificate revoked")}
        assert "longer than requested" in report.enclaves[0].reasons[0]
        assert kit.actions(create_enclaves(root, ["/a"], options=asked(10))) == {}, "seconds do not count"
        longer = create_enclaves(root, ["/a"], options=asked(12))
        assert longer.enclaves[0].reasons == ("the certificate expires soon",)


def test_a_bundle_that_grants_more_than_ours_is_taken_as_a_union_and_one_that_lacks_something_is_not(
    root: Path, tmp_path: Path
) -> None:
    """Other launches may share the enclave; a host without keys cannot know whose share is whose."""
    apply_policy(root, Policy((kit.policy("/a", "/chatter", "/other"),)), options=kit.options())
    export(root, tmp_path / "bundle", ["/a"])
    hold = LaunchHold(tmp_path / "bundle", "/mine.launch.xml")
    report = again(tmp_path / "bundle", kit.policy("/a"), launch=hold)
    assert not report.changed
    told_of = "may do more in this bundle than this launch needs (publish rt/other)"
    assert any(told_of in text for text in report.warnings)
    assert told(tmp_path / "bundle", launch=hold) == (), "its next process starts"
    same = again(tmp_path / "bundle", kit.policy("/a", "/chatter", "/other"), launch=hold)
    assert same.warnings == report.warnings[1:]
    with pytest.raises(SigningUnavailableError, match="lacks publish rt/third"):
        again(tmp_path / "bundle", kit.policy("/a", "/third"), launch=hold)
    with pytest.raises(SigningUnavailableError, match="has beyond it publish rt/other"):
        again(tmp_path / "bundle", kit.policy("/a"))


@pytest.mark.parametrize("governed", ["0", "0-5"])
def test_a_host_that_starts_in_another_domain_is_told_the_domain_and_both_cures(
    tmp_path: Path, governed: str
) -> None:
    root, host = tmp_path / "ks", tmp_path / "host"
    create_keystore(root, CreateOptions(domains=Domains.parse(governed), durable=False))
    provision(root, [kit.policy("/a")], options=kit.options(domains=Domains.single(0)))
    shutil.copytree(root, host, symlinks=True)
    shutil.rmtree(host / "private")
    with pytest.raises(SigningUnavailableError) as caught:
        provision(host, [kit.policy("/a")], options=kit.options(domains=Domains.single(3)))
    told = str(caught.value)
    assert "domain 3 is asked for" in told and "ROS_DOMAIN_ID=0" in told
    assert "in domain 3 where the CA keys are" in told and "lacks" not in told
    assert not provision(host, [kit.policy("/a")], options=kit.options(domains=Domains.single(0))).changed
