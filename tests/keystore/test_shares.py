"""Several launches on one keystore: each owns its share, the enclave has all of them, and nobody loses silently."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from keystore import (
    DamagedKeystoreError,
    Domains,
    EnclavePolicy,
    InvalidInputError,
    LaunchHold,
    Operation,
    Profile,
    ProvisionReport,
    Qualifier,
    RemoveOptions,
    Rule,
    UnsafeKeystoreError,
    drop_shares,
    list_shares,
    provision,
    remove,
    verify,
)
from keystore.disk import layout
from keystore.disk.share_files import is_running, read_shares
from keystore.formats.permissions_document import parse_permissions
from keystore.steps.comparison import differences
from keystore.steps.sharing import shared_enclaves
from keystore.verb import main
from tests.keystore.kit import actions, certificate_of, codes, filled, options, policy, snapshot

BRINGUP, NAVIGATION = "/ws/bringup.launch.xml", "/ws/navigation.launch.py"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "ks"


def start(root: Path, owner: str, *policies: EnclavePolicy, **changes: object) -> ProvisionReport:
    """A launch that has ended again."""
    hold = LaunchHold(root, owner)
    try:
        return provision(root, policies, options=options(launch=hold, **changes))
    finally:
        hold.close()


@pytest.fixture
def running(root: Path) -> Iterator[LaunchHold]:
    """The bring-up, still running in ``/`` with /chatter and /odom."""
    hold = LaunchHold(root, BRINGUP)
    provision(root, [policy("/", "/chatter", "/odom")], options=options(launch=hold))
    yield hold
    hold.close()


def granted(root: Path, name: str = "/") -> set[str]:
    directory = root / layout.enclave_directory(name)
    permissions = parse_permissions((directory / "permissions.xml").read_bytes())
    return set(permissions.rules.allow.publish) - {"ros_discovery_info"}


def test_another_launch_adds_its_share(root: Path) -> None:
    start(root, BRINGUP, policy("/", "/odom"))
    report = start(root, NAVIGATION, policy("/", "/plan"))
    assert actions(report) == {"/": ("permissions",)}
    assert granted(root) == {"rt/odom", "rt/plan"} and codes(root) == set()


def test_the_same_launch_again_changes_nothing(root: Path) -> None:
    start(root, BRINGUP, policy("/", "/odom"))
    start(root, NAVIGATION, policy("/", "/plan"))
    before = snapshot(root)
    for owner, topic in ((BRINGUP, "/odom"), (NAVIGATION, "/plan")):
        assert not start(root, owner, policy("/", topic)).changed
    assert {name: one for name, one in snapshot(root).items() if ".lock" not in name} == {
        name: one for name, one in before.items() if ".lock" not in name
    }


def test_the_same_launch_with_less_replaces_its_own_share_only(root: Path) -> None:
    start(root, BRINGUP, policy("/", "/odom", "/secret"))
    start(root, NAVIGATION, policy("/", "/plan"))
    old = certificate_of(root, "/").serial
    report = start(root, BRINGUP, policy("/", "/odom"))
    assert granted(root) == {"rt/odom", "rt/plan"}
    assert "old certificate revoked" in actions(report)["/"] and certificate_of(root, "/").serial != old


def test_enclaves_of_ones_own_stay_apart(root: Path) -> None:
    start(root, BRINGUP, policy("/odometry", "/odom"))
    start(root, NAVIGATION, policy("/planner", "/plan"))
    assert granted(root, "/odometry") == {"rt/odom"} and granted(root, "/planner") == {"rt/plan"}
    assert not list(shared_enclaves(root, NAVIGATION, [policy("/planner", "/plan")]))


def test_a_start_tells_which_enclaves_are_shared_and_what_that_adds(root: Path) -> None:
    start(root, BRINGUP, policy("/", "/odom", "/common"))
    (told,) = shared_enclaves(root, NAVIGATION, [policy("/", "/plan", "/common"), policy("/own")])
    assert told == ("/", (BRINGUP,), ("publish /odom",))


class TestWhileAnotherRuns:
    def test_it_keeps_its_grants_when_a_second_launch_comes(self, root: Path, running: LaunchHold) -> None:
        start(root, NAVIGATION, policy("/", "/plan"))
        assert granted(root) == {"rt/chatter", "rt/odom", "rt/plan"}
        wanted = policy("/", "/chatter", "/odom")
        assert differences(root, wanted, options=options(launch=running)) == (), "its next process starts"

    def test_nothing_is_revoked_that_it_uses(self, root: Path, running: LaunchHold) -> None:
        start(root, NAVIGATION, policy("/", "/plan", "/goal"))
        report = start(root, NAVIGATION, policy("/", "/plan"))
        assert "keeps what this launch no longer needs (publish /goal)" in str(report.warnings)
        assert not (root / "public/crl.pem").exists() and "rt/goal" in granted(root)
        running.close()
        start(root, NAVIGATION, policy("/", "/plan"))
        assert "rt/goal" not in granted(root) and (root / "public/crl.pem").exists()

    def test_another_run_of_the_same_launch_takes_nothing_from_it(
        self, root: Path, running: LaunchHold
    ) -> None:
        """Started a second time with other arguments, or after the file was edited."""
        start(root, BRINGUP, policy("/", "/chatter", "/more"))
        assert granted(root) == {"rt/chatter", "rt/odom", "rt/more"}
        running.close()
        start(root, BRINGUP, policy("/", "/chatter"))
        assert granted(root) == {"rt/chatter"}

    def test_what_comes_late_is_added_to_what_it_has(self, root: Path, running: LaunchHold) -> None:
        provision(root, [policy("/", "/late")], options=options(launch=running))
        assert granted(root) == {"rt/chatter", "rt/odom", "rt/late"}

    def test_giving_the_enclave_something_else_is_refused(self, root: Path, running: LaunchHold) -> None:
        before = snapshot(root)
        with pytest.raises(
            InvalidInputError, match=f"{BRINGUP}' is running and uses enclave /; stop it first"
        ):
            provision(root, [policy("/", "/else")], options=options())
        assert snapshot(root) == before
        running.close()
        provision(root, [policy("/", "/else")], options=options())
        assert granted(root) == {"rt/else"} and list_shares(root) == ()

    def test_a_launch_that_was_killed_runs_no_more(self, root: Path) -> None:
        program = (
            "import os, sys\n"
            "from pathlib import Path\n"
            "from keystore.disk.share_files import LaunchHold\n"
            "from keystore.steps.provisioning import provision\n"
            "from tests.keystore.kit import options, policy\n"
            "hold = LaunchHold(Path(sys.argv[1]), sys.argv[2])\n"
            "provision(sys.argv[1], [policy('/')], options=options(launch=hold))\n"
            "print('ready', flush=True)\n"
            "sys.stdin.read()\n"
        )
        with subprocess.Popen(
            [sys.executable, "-c", program, str(root), BRINGUP],
            cwd=Path(__file__).parents[2],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        ) as process:
            assert process.stdout is not None and process.stdout.readline() == b"ready\n"
            assert is_running(root, BRINGUP)
            process.kill()
            process.wait()
        assert not is_running(root, BRINGUP)


class TestDropping:
    def test_what_nobody_else_asks_for_ends_for_good(self, root: Path) -> None:
        start(root, BRINGUP, policy("/", "/odom", "/common"))
        start(root, NAVIGATION, policy("/", "/plan", "/common"))
        report = drop_shares(root, BRINGUP, options=options())
        assert granted(root) == {"rt/plan", "rt/common"}
        assert "old certificate revoked" in actions(report)["/"]
        assert [one.owner for one in list_shares(root)] == [NAVIGATION] and codes(root) == set()

    def test_the_last_share_leaves_an_enclave_that_may_do_nothing(self, root: Path) -> None:
        start(root, BRINGUP, policy("/", "/odom"))
        drop_shares(root, BRINGUP, options=options())
        assert granted(root) == set() and list_shares(root) == ()

    def test_of_a_running_launch_is_refused(self, root: Path, running: LaunchHold) -> None:
        with pytest.raises(InvalidInputError, match="is running"):
            drop_shares(root, BRINGUP, options=options())

    def test_beside_a_running_launch_is_refused(self, root: Path, running: LaunchHold) -> None:
        """What it takes away would revoke the certificate that the running one uses."""
        start(root, NAVIGATION, policy("/", "/plan"))
        with pytest.raises(InvalidInputError, match=f"{BRINGUP}' is running"):
            drop_shares(root, NAVIGATION, options=options())

    def test_of_an_unknown_launch_is_refused(self, root: Path) -> None:
        filled(root, ["/a"])
        with pytest.raises(InvalidInputError, match="no launch '/nowhere' has a share"):
            drop_shares(root, "/nowhere", options=options())

    def test_as_a_command(self, root: Path, capsys: pytest.CaptureFixture[str]) -> None:
        start(root, BRINGUP, policy("/", "/odom"), policy("/own"))
        start(root, NAVIGATION, policy("/", "/plan"))
        assert main(["shares", str(root)]) == 0
        assert capsys.readouterr().out == f"'{BRINGUP}': / /own\n'{NAVIGATION}': /\n"
        assert main(["shares", str(root), "--drop", BRINGUP]) == 0
        assert "/own: certificate, permissions, old certificate revoked" in capsys.readouterr().out
        assert granted(root) == {"rt/plan"}

    @pytest.mark.skipif(os.geteuid() == 0, reason="root may read anywhere")
    def test_not_for_who_cannot_see_them(self, root: Path, capsys: pytest.CaptureFixture[str]) -> None:
        start(root, BRINGUP, policy("/"))
        (root / layout.PRIVATE).chmod(0)
        assert main(["shares", str(root)]) == 1
        told = capsys.readouterr()
        assert told.out == "" and "private/shares" in told.err and "Permission denied" in told.err
        (root / layout.PRIVATE).chmod(0o700)
        assert main(["shares", str(root)]) == 0
        assert capsys.readouterr().out == f"'{BRINGUP}': /\n"

    def test_with_the_enclave(self, root: Path) -> None:
        start(root, BRINGUP, policy("/a"), policy("/b"))
        remove(root, ["/a"], options=RemoveOptions(durable=False))
        assert list_shares(root) == ((BRINGUP, False, ("/b",)),)


def test_domains_are_united_as_those_of_one_launch_are(root: Path) -> None:
    start(root, BRINGUP, policy("/", "/odom"), domains=Domains.single(0))
    start(root, NAVIGATION, policy("/", "/plan"), domains=Domains.single(7))
    permissions = parse_permissions((root / "enclaves/permissions.xml").read_bytes())
    assert str(permissions.domains) == "0,7" and codes(root) == set()
    (told,) = shared_enclaves(root, "/third.launch.py", [policy("/")])
    assert "do all of it in each of the domains 0,7" in told.added


def test_the_same_launch_in_another_domain_keeps_the_first(root: Path) -> None:
    """Two robots run one launch file in domains 1 and 2: the second start revokes nothing of the first."""
    start(root, BRINGUP, policy("/", "/odom"), domains=Domains.single(1))
    first = (root / "enclaves/cert.pem").read_bytes()
    start(root, BRINGUP, policy("/", "/odom"), domains=Domains.single(2))
    permissions = parse_permissions((root / "enclaves/permissions.xml").read_bytes())
    assert str(permissions.domains) == "1-2" and not (root / "public/crl.pem").exists()
    assert (root / "enclaves/cert.pem").read_bytes() == first
    drop_shares(root, BRINGUP, options=options())
    assert codes(root) == set()


class TestWhatCannotBeUnited:
    def test_a_denial_of_what_the_other_needs(self, root: Path) -> None:
        def ruled(*rules: Rule) -> EnclavePolicy:
            return EnclavePolicy("/", (Profile("/", "node", rules),))

        everything = Rule(Operation.PUBLISH, Qualifier.ALLOW, "/*")
        no_secret = Rule(Operation.PUBLISH, Qualifier.DENY, "/secret")
        start(root, BRINGUP, ruled(everything, no_secret))
        start(root, NAVIGATION, policy("/", "/plan"))
        with pytest.raises(InvalidInputError, match=r"one of them denies the other needs \(rt/secret\)"):
            start(root, NAVIGATION, policy("/", "/secret"))


class TestTheFiles:
    def test_are_private(self, root: Path) -> None:
        start(root, BRINGUP, policy("/a/b"))
        (file,) = (root / layout.SHARES).glob("*.json")
        assert file.name == "e.a.b.json" and file.stat().st_mode & 0o777 == 0o600
        assert (root / layout.SHARES).stat().st_mode & 0o777 == 0o700
        assert verify(root).findings == ()

    def test_that_others_could_write_are_not_believed(self, root: Path) -> None:
        """What they ask for would be signed."""
        start(root, BRINGUP, policy("/"))
        (root / layout.shares("/")).chmod(0o666)
        with pytest.raises(UnsafeKeystoreError, match="can be written by others"):
            start(root, NAVIGATION, policy("/"))

    @pytest.mark.parametrize("text", ["", "{}", "[]", '{"version": 1, "shares": [{}]}', "[" * 100_000])
    def test_that_cannot_be_read_are_not_guessed(self, root: Path, text: str) -> None:
        start(root, BRINGUP, policy("/"))
        (root / layout.shares("/")).write_text(text)
        with pytest.raises(DamagedKeystoreError, match="does not hold the shares"):
            start(root, NAVIGATION, policy("/"))

    def test_hold_every_rule_as_it_was_given(self, root: Path) -> None:
        start(root, BRINGUP, policy("/", "/odom", "~/private", "relative"))
        (share,) = read_shares(root, "/")
        assert {rule.expression for rule in share.profiles[0].rules} == {"/odom", "~/private", "relative"}


def test_a_keystore_of_today_has_no_shares_and_the_first_start_makes_one(root: Path) -> None:
    filled(root, ["/"])
    assert list_shares(root) == ()
    report = start(root, BRINGUP, policy("/"))
    assert actions(report) == {} and [one.owner for one in list_shares(root)] == [BRINGUP]


def test_a_hold_counts_for_its_own_launch(root: Path) -> None:
    hold = LaunchHold(filled(root, ["/a"]), BRINGUP)
    hold.take()
    assert is_running(root, BRINGUP) and not is_running(root, NAVIGATION)
    assert os.listdir(root / layout.SHARES)
    hold.close()
