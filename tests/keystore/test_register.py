"""What a keystore remembers: whatever is put back, copied in or taken away is told from what was issued last."""

from __future__ import annotations

import shutil
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest
from cryptography import x509
from hypothesis import given
from hypothesis import strategies as st

from keystore import (
    ChangeOptions,
    DamagedKeystoreError,
    DomainRule,
    Domains,
    Governance,
    InvalidInputError,
    Protection,
    RemoveOptions,
    RenewOptions,
    Role,
    Step,
    SubjectScheme,
    UnsafeKeystoreError,
    create_enclaves,
    provision,
    remove,
    renew,
    roll_over,
    set_governance,
)
from keystore.disk import layout
from keystore.disk.register_file import read_register
from keystore.formats.certificate import read_certificate
from keystore.formats.register import (
    AuthorityState,
    IssuedCertificate,
    Register,
    SignedPermissions,
    parse_register,
    register_json,
)
from keystore.formats.subject import common_name, generation_of, names_enclave
from tests.keystore.kit import (
    DAY,
    NOW,
    actions,
    certificate_of,
    codes,
    crl_of,
    filled,
    granted,
    options,
    policy,
    snapshot,
)

QUICK = RemoveOptions(durable=False)


def register(root: Path) -> Register:
    found = read_register(root)
    assert found is not None
    return found


def number(root: Path) -> int:
    found: int = crl_of(root).extensions.get_extension_for_class(x509.CRLNumber).value.crl_number
    return found


def common_name_of(root: Path, name: str) -> str | None:
    return certificate_of(root, name).common_name


def is_revoked(root: Path, number: int) -> bool:
    return crl_of(root).get_revoked_certificate_by_serial_number(number) is not None


class TestTheRecord:
    def test_holds_every_certificate_and_document(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks")
        found = register(root)
        assert {one.enclave: one.serial for one in found.certificates.values()} == {
            name: certificate_of(root, name).serial for name in ("/a", "/b")
        }
        assert {one.enclave for one in found.documents} == {"/a", "/b"}
        assert {(role, state) for (role, _), state in found.authorities.items()} == {
            (role, AuthorityState.IN_USE) for role in Role
        }
        assert found.governance == (root / "enclaves/governance.xml").read_bytes()

    def test_is_private(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks")
        assert (root / layout.REGISTER).stat().st_mode & 0o777 == 0o600
        (root / layout.REGISTER).chmod(0o666)
        with pytest.raises(UnsafeKeystoreError, match="can be written by others"):
            provision(root, [policy("/a")], options=options())

    @pytest.mark.parametrize("text", ["", "{}", "[]", '{"version": 1}', "\xff", "[" * 100_000])
    def test_that_cannot_be_read_is_not_guessed(self, tmp_path: Path, text: str) -> None:
        root = filled(tmp_path / "ks")
        (root / layout.REGISTER).write_bytes(text.encode("latin-1"))
        with pytest.raises(DamagedKeystoreError, match=r"register\.json.* restore it from a backup"):
            provision(root, [policy("/a")], options=options())

    def test_forgets_what_has_ended(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks", ["/a"], now=NOW, lifetime=10 * DAY)
        provision(root, [policy("/a")], options=options(now=NOW + 11 * DAY, lifetime=10 * DAY))
        assert len(register(root).certificates) == 1
        provision(root, [policy("/a")], options=options(now=NOW + 12 * DAY, renew_within=10 * DAY))
        assert len(register(root).certificates) == 2, "the one before can still be used"

    @given(
        st.lists(
            st.builds(
                IssuedCertificate,
                st.integers(1, 2**159),
                st.sampled_from(["/", "/a", "/a/b", ""]),
                st.text(max_size=20),
                st.text("0123456789abcdef", max_size=64),
                st.text("0123456789abcdef", max_size=64),
                st.datetimes().map(lambda moment: NOW),
                st.integers(1, 10**6).map(lambda hours: NOW + timedelta(hours=hours)),
                st.booleans(),
                st.none() | st.just(NOW),
            ),
            unique_by=lambda one: one.serial,
        ),
        st.binary(min_size=1, max_size=40),
        st.integers(0, 2**40),
    )
    def test_is_read_as_it_was_written(
        self, issued: list[IssuedCertificate], ca: bytes, crl_number: int
    ) -> None:
        written = Register(
            {(Role.IDENTITY, ca): AuthorityState.WAITING, (Role.PERMISSIONS, ca): AuthorityState.RETIRED},
            {one.serial: one for one in issued},
            (SignedPermissions("/a", "ros.a", "00", "11", NOW),),
            b"<dds/>\n",
            crl_number,
            bool(issued),
        )
        assert parse_register(register_json(written), "register.json") == written


class TestRevocations:
    def removed(self, tmp_path: Path) -> tuple[Path, Path]:
        """A keystore from which two enclaves were removed, and the CRL from between."""
        root = filled(tmp_path / "ks", ["/a", "/b", "/c"])
        remove(root, ["/b"], options=QUICK)
        shutil.copy(root / "public/crl.pem", tmp_path / "old-crl.pem")
        remove(root, ["/c"], options=QUICK)
        return root, tmp_path / "old-crl.pem"

    def test_an_older_crl_that_is_put_back_is_replaced(self, tmp_path: Path) -> None:
        root, old = self.removed(tmp_path)
        last = number(root)
        shutil.copy(old, root / "public/crl.pem")
        report = provision(root, [policy("/a")], options=options())
        assert report.created == ("CRL published again: the CRL is not the one published last",)
        assert len(crl_of(root)) == 2 and number(root) > last

    def test_a_lost_crl_is_published_again(self, tmp_path: Path) -> None:
        root, _ = self.removed(tmp_path)
        for path in root.rglob("crl.pem"):
            path.unlink()
        assert provision(root, [policy("/a")], options=options()).created == (
            "CRL published again: the CRL is missing",
        )
        assert len(crl_of(root)) == 2 and (root / "enclaves/a/crl.pem").is_symlink()

    def test_the_next_removal_does_not_lose_the_earlier_ones(self, tmp_path: Path) -> None:
        root, old = self.removed(tmp_path)
        shutil.copy(old, root / "public/crl.pem")
        assert remove(root, ["/a"], options=QUICK).revoked == 3
        assert len(crl_of(root)) == 3

    def test_a_register_from_a_backup_does_not_bring_anybody_back(self, tmp_path: Path) -> None:
        """private/ restored, public/ not: the CRL, signed here, knows more than the register."""
        root = filled(tmp_path / "ks", ["/a", "/b", "/c"])
        shutil.copytree(root / "private", tmp_path / "backup")
        gone = certificate_of(root, "/b").serial
        remove(root, ["/b"], options=QUICK)
        shutil.rmtree(root / "private")
        shutil.copytree(tmp_path / "backup", root / "private")
        report = provision(root, [policy("/a")], options=options())
        assert report.created == (
            f"public/crl.pem lists revoked serial numbers that were not on record: {gone:X}",
            "CRL published again: the CRL is not the one published last",
        )
        remove(root, ["/c"], options=QUICK)
        assert is_revoked(root, gone) and len(crl_of(root)) == 2

    def test_a_crl_that_nobody_published_is_left_for_a_person(self, tmp_path: Path) -> None:
        _, old = self.removed(tmp_path)
        other = filled(tmp_path / "other", ["/a"])
        shutil.copy(old, other / "public/crl.pem")
        with pytest.raises(DamagedKeystoreError, match="was not published by this keystore"):
            provision(other, [policy("/a")], options=options())

    def test_an_enclave_whose_files_are_lost_is_revoked_all_the_same(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks")
        lost = certificate_of(root, "/b").serial
        shutil.rmtree(root / "enclaves/b")
        assert remove(root, ["/b"], options=QUICK).revoked == 1
        assert is_revoked(root, lost) and codes(root) == set()
        assert remove(root, ["/b"], options=QUICK).gone == ("/b",)


class TestRightsThatAreTakenAway:
    def reduced(self, tmp_path: Path) -> Path:
        """/a had /secret and has it no more; what it had before is in ``before``."""
        root = tmp_path / "ks"
        provision(root, [policy("/a", "/chatter", "/secret"), policy("/b")], options=options())
        shutil.copytree(root / "enclaves/a", tmp_path / "before", symlinks=True)
        provision(root, [policy("/a", "/chatter"), policy("/b")], options=options())
        return root

    def test_a_new_subject_and_the_old_certificate_revoked(self, tmp_path: Path) -> None:
        root = self.reduced(tmp_path)
        assert common_name_of(root, "/a") == "ros.a-2"
        assert is_revoked(root, read_certificate((tmp_path / "before/cert.pem").read_bytes()).serial)
        assert (root / "enclaves/a/key.pem").read_bytes() == (tmp_path / "before/key.pem").read_bytes()
        assert common_name_of(root, "/b") == "ros.b" and codes(root) == set()

    def test_it_is_said_what_is_left_to_do(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks", ["/a"])
        report = provision(root, [policy("/a", "/other")], options=options())
        assert actions(report) == {"/a": ("certificate", "permissions", "old certificate revoked")}
        assert any("deploy crl.pem to every host" in warning for warning in report.warnings)

    def test_a_second_run_changes_nothing(self, tmp_path: Path) -> None:
        root = self.reduced(tmp_path)
        before = snapshot(root)
        assert not provision(root, [policy("/a"), policy("/b")], options=options()).changed
        assert snapshot(root) == before

    def test_old_permissions_put_back_are_not_signed_again(self, tmp_path: Path) -> None:
        root = self.reduced(tmp_path)
        for name in ("permissions.p7s", "permissions.xml"):
            shutil.copy(tmp_path / "before" / name, root / "enclaves/a" / name)
        with pytest.raises(DamagedKeystoreError, match=r"not what was signed last for /a.* apply-policy"):
            renew(root, ["/a"], options=RenewOptions(provisioning=options()))
        provision(root, [policy("/a")], options=options())
        assert granted(root, "/a") == {"ros_discovery_info", "rt/chatter"}

    def test_an_old_enclave_put_back_as_a_whole_is_replaced(self, tmp_path: Path) -> None:
        root = self.reduced(tmp_path)
        shutil.rmtree(root / "enclaves/a")
        shutil.copytree(tmp_path / "before", root / "enclaves/a", symlinks=True)
        old = certificate_of(root, "/a").serial
        report = provision(root, [policy("/a")], options=options())
        assert "the certificate is revoked" in str(report.enclaves[0].reasons)
        assert certificate_of(root, "/a").serial != old and is_revoked(root, old) and codes(root) == set()

    def test_a_removed_enclave_that_comes_back_is_not_what_it_was(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks")
        remove(root, ["/a"], options=QUICK)
        create_enclaves(root, ["/a"], options=options())
        assert common_name_of(root, "/a") == "ros.a-2"
        remove(root, ["/b"], options=QUICK)
        provision(root, [policy("/b")], options=options())
        assert common_name_of(root, "/b") == "ros.b", "it may do what it could before"

    def test_a_domain_less_is_a_right_less(self, tmp_path: Path) -> None:
        root = tmp_path / "ks"
        provision(root, [policy("/a")], options=options(domains=Domains.parse("0-5")))
        report = provision(root, [policy("/a")], options=options(domains=Domains.parse("0")))
        assert "old certificate revoked" in actions(report)["/a"]

    def test_compatible_subjects_stay_and_the_gap_is_told(self, tmp_path: Path) -> None:
        root = tmp_path / "ks"
        chosen = options(subjects=SubjectScheme.COMPATIBLE)
        provision(root, [policy("/a", "/chatter", "/secret")], options=chosen)
        report = provision(root, [policy("/a")], options=chosen)
        assert common_name_of(root, "/a") == "/a"
        assert any("may no longer publish rt/secret, but" in warning for warning in report.warnings)

    def test_revoking_can_be_declined_and_is_then_told(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks", ["/a"])
        report = provision(root, [policy("/a", "/other")], options=options(revoke=False))
        assert common_name_of(root, "/a") == "ros.a-2" and not (root / "public/crl.pem").exists()
        assert any("was not revoked" in warning for warning in report.warnings)

    def test_a_shorter_life_ends_the_longer_certificate(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks", ["/a"])
        long = certificate_of(root, "/a").serial
        renew(root, ["/a"], options=RenewOptions(provisioning=options(lifetime=30 * DAY)))
        assert is_revoked(root, long)


class TestIncidents:
    def test_a_foreign_key_is_never_certified(self, tmp_path: Path) -> None:
        root, other = filled(tmp_path / "ks", ["/a"]), filled(tmp_path / "other", ["/a"])
        old = certificate_of(root, "/a").serial
        shutil.copy(other / "enclaves/a/key.pem", root / "enclaves/a/key.pem")
        report = provision(root, [policy("/a")], options=options())
        assert "was not issued here" in report.enclaves[0].reasons[0]
        assert (root / "enclaves/a/key.pem").read_bytes() != (other / "enclaves/a/key.pem").read_bytes()
        assert is_revoked(root, old)

    @pytest.mark.parametrize("gone", [["cert.pem"], ["cert.pem", "permissions.p7s"]])
    def test_a_foreign_key_without_certificate_is_none_either(self, tmp_path: Path, gone: list[str]) -> None:
        root, other = filled(tmp_path / "ks", ["/a"]), filled(tmp_path / "other", ["/a"])
        shutil.copy(other / "enclaves/a/key.pem", root / "enclaves/a/key.pem")
        for name in gone:
            (root / "enclaves/a" / name).unlink()
        provision(root, [policy("/a")], options=options())
        assert (root / "enclaves/a/key.pem").read_bytes() != (other / "enclaves/a/key.pem").read_bytes()

    def test_a_foreign_key_is_not_certified_because_the_certificate_ended(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks", ["/a"], now=NOW, lifetime=10 * DAY)
        other = filled(tmp_path / "other", ["/a"])
        shutil.copy(other / "enclaves/a/key.pem", root / "enclaves/a/key.pem")
        provision(root, [policy("/a")], options=options(now=NOW + 11 * DAY))
        assert (root / "enclaves/a/key.pem").read_bytes() != (other / "enclaves/a/key.pem").read_bytes()

    def test_renewal_revokes_what_others_could_read(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks", ["/a"])
        old = certificate_of(root, "/a").serial
        (root / "enclaves/a/key.pem").chmod(0o640)
        renew(root, ["/a"], options=RenewOptions(new_keys=True, provisioning=options()))
        assert is_revoked(root, old) and codes(root) == set()

    def test_a_key_that_others_could_read_does_not_come_back_after_a_roll_over(self, tmp_path: Path) -> None:
        """Its certificate by the old CA was never revoked, and need not be: nobody trusts it."""
        root = filled(tmp_path / "ks", ["/a"])
        for step in Step:
            roll_over(root, step, options=options())
        shutil.copytree(root / "enclaves/a", tmp_path / "exposed", symlinks=True)
        (root / "enclaves/a/key.pem").chmod(0o644)
        provision(root, [policy("/a")], options=options())
        for name in ("key.pem", "cert.pem"):
            shutil.copy(tmp_path / "exposed" / name, root / "enclaves/a" / name)
        provision(root, [policy("/a")], options=options())
        assert (root / "enclaves/a/key.pem").read_bytes() != (tmp_path / "exposed/key.pem").read_bytes()

    def test_an_earlier_governance_put_back_is_signed_anew(self, tmp_path: Path) -> None:
        root = tmp_path / "ks"
        lax = Governance((DomainRule(domains=Domains.single(0), rtps_protection_kind=Protection.NONE),))
        filled(root, ["/a"])
        strict = (root / "enclaves/governance.xml").read_bytes()
        set_governance(root, lax, options=ChangeOptions(durable=False))
        for name in ("governance.p7s", "governance.xml"):
            shutil.copy(root / "enclaves" / name, tmp_path / name)
        set_governance(root, Governance.for_domains(Domains.single(0)), options=ChangeOptions(durable=False))
        for name in ("governance.p7s", "governance.xml"):
            shutil.copy(tmp_path / name, root / "enclaves" / name)
        assert "governance signed" in provision(root, [policy("/a")], options=options()).created[0]
        assert (root / "enclaves/governance.xml").read_bytes() == strict


class TestAuthorities:
    @pytest.mark.parametrize("role", Role)
    def test_a_foreign_one_beside_ours_is_refused_and_removed(self, tmp_path: Path, role: Role) -> None:
        root, other = filled(tmp_path / "ks", ["/a"]), filled(tmp_path / "other", ["/a"])
        trusted = root / layout.ca_cert(role)
        ours = trusted.read_bytes()
        trusted.write_bytes(ours + (other / layout.ca_cert(role)).read_bytes())
        with pytest.raises(UnsafeKeystoreError, match=r"a CA that this keystore did not make.*: .*SHA-256 "):
            provision(root, [policy("/a")], options=options())
        report = renew(root, options=RenewOptions(provisioning=options()))
        assert f"removed from {layout.ca_cert(role)}" in report.created[0]
        assert trusted.read_bytes() == ours

    def test_one_in_place_of_ours_is_refused(self, tmp_path: Path) -> None:
        root, other = filled(tmp_path / "ks", ["/a"]), filled(tmp_path / "other", ["/a"])
        shutil.copy(other / "public/identity_ca.cert.pem", root / "public/identity_ca.cert.pem")
        with pytest.raises(UnsafeKeystoreError, match="did not make"):
            provision(root, [policy("/a")], options=options())

    def test_a_roll_over_of_our_own_is_known(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks", ["/a"])
        for step in Step:
            roll_over(root, step, options=options())
            assert not provision(root, [policy("/a")], options=options()).changed

    @pytest.mark.parametrize("role", Role)
    def test_one_that_was_retired_does_not_come_back(self, tmp_path: Path, role: Role) -> None:
        """It may have been replaced because its key was stolen."""
        root = filled(tmp_path / "ks", ["/a"])
        old = (root / layout.ca_cert(role)).read_bytes()
        for step in Step:
            roll_over(root, step, options=options())
        trusted = root / layout.ca_cert(role)
        trusted.write_bytes(trusted.read_bytes() + old)
        with pytest.raises(UnsafeKeystoreError, match="or has retired"):
            provision(root, [policy("/a")], options=options())

    def test_with_revocations_the_old_one_goes_at_the_switch(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks")
        old = (root / "public/identity_ca.cert.pem").read_bytes()
        remove(root, ["/b"], options=QUICK)
        for step in (Step.START, Step.SWITCH):
            roll_over(root, step, options=options())
        trusted = root / "public/identity_ca.cert.pem"
        trusted.write_bytes(trusted.read_bytes() + old)
        with pytest.raises(UnsafeKeystoreError, match="or has retired"):
            provision(root, [policy("/a")], options=options())

    def test_finishing_does_not_strand_what_an_interrupted_switch_left(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks", ["/a", "/b", "/c"])
        roll_over(root, Step.START, options=options())
        shutil.copytree(root / "enclaves/b", tmp_path / "b", symlinks=True)
        roll_over(root, Step.SWITCH, options=options())
        shutil.rmtree(root / "enclaves/b")
        shutil.copytree(tmp_path / "b", root / "enclaves/b", symlinks=True)
        with pytest.raises(
            InvalidInputError, match=r"1 of 3 enclaves \(/b\) still belong to the old CA.*--ca switch"
        ):
            roll_over(root, Step.FINISH, options=options())
        roll_over(root, Step.SWITCH, options=options())
        roll_over(root, Step.FINISH, options=options())
        assert codes(root) == set()


class TestTakingOver:
    def without_register(self, root: Path) -> Path:
        """The keystore as SROS2 would have made it, or after its register was lost."""
        (root / layout.REGISTER).unlink()
        return root

    def test_everything_that_stands_is_recorded_and_nothing_changes(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks")
        before = register(root)
        report = provision(self.without_register(root), [policy("/a"), policy("/b")], options=options())
        assert actions(report) == {}
        assert report.created == ("register made from the files in this keystore: 2 certificates",)
        bare = {serial: one._replace(lifetime=None) for serial, one in before.certificates.items()}
        assert replace(register(root), written=before.written) == replace(before, certificates=bare)

    def test_revocations_are_kept(self, tmp_path: Path) -> None:
        root = filled(tmp_path / "ks", ["/a", "/c"])
        gone = certificate_of(root, "/c").serial
        remove(root, ["/c"], options=QUICK)
        last = number(root)
        self.without_register(root)
        remove(root, ["/a"], options=QUICK)
        assert is_revoked(root, gone) and number(root) > last

    def test_a_foreign_ca_is_not_taken_over(self, tmp_path: Path) -> None:
        root, other = filled(tmp_path / "ks", ["/a"]), filled(tmp_path / "other", ["/a"])
        trusted = root / "public/identity_ca.cert.pem"
        trusted.write_bytes(trusted.read_bytes() + (other / "public/identity_ca.cert.pem").read_bytes())
        with pytest.raises(UnsafeKeystoreError, match="did not make"):
            provision(self.without_register(root), [policy("/a")], options=options())

    @pytest.mark.parametrize("step", [Step.START, Step.SWITCH])
    def test_a_roll_over_under_way_is_taken_over(self, tmp_path: Path, step: Step) -> None:
        root = filled(tmp_path / "ks", ["/a"])
        for one in list(Step)[: list(Step).index(step) + 1]:
            roll_over(root, one, options=options())
        self.without_register(root)
        for one in list(Step)[list(Step).index(step) + 1 :]:
            roll_over(root, one, options=options())
        assert codes(root) == set()

    def test_a_forged_certificate_is_not_recorded(self, tmp_path: Path) -> None:
        root, other = filled(tmp_path / "ks", ["/a"]), filled(tmp_path / "other", ["/a"])
        for name in ("key.pem", "cert.pem"):
            shutil.copy(other / "enclaves/a" / name, root / "enclaves/a" / name)
        provision(self.without_register(root), [policy("/a")], options=options())
        assert (root / "enclaves/a/key.pem").read_bytes() != (other / "enclaves/a/key.pem").read_bytes()
        assert codes(root) == set()


class TestGenerations:
    NAMES = st.sampled_from(
        ["/", "/a", "/a/b", "/" + "x" * 70, "/" + "/".join(["part"] * 15), "/a" + "1" * 62]
    )

    @given(NAMES, st.sampled_from(SubjectScheme), st.integers(1, 999))
    def test_a_subject_tells_its_generation(
        self, enclave: str, scheme: SubjectScheme, generation: int
    ) -> None:
        cn = common_name(enclave, scheme, generation)
        assert len(cn) <= 64 and names_enclave(cn, enclave) and generation_of(cn) == generation

    @given(st.lists(st.tuples(NAMES, st.integers(1, 50)), unique=True, min_size=2, max_size=2))
    def test_no_two_are_the_same(self, two: list[tuple[str, int]]) -> None:
        first, second = ((common_name(name, generation=one), name) for name, one in two)
        assert first[0] != second[0]
        assert first[1] == second[1] or not names_enclave(first[0], second[1])
