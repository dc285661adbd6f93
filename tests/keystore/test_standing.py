"""What a launch remembers of a keystore: it may spare a comparison, and must never hide a change."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import timedelta
from pathlib import Path

import pytest

from keystore.errors import InvalidInput, KeystoreError, UnsafeKeystore
from keystore.formats.domains import Domains
from keystore.formats.policy import EnclavePolicy, Operation, Profile, Qualifier, Rule
from keystore.formats.validity import utc_now
from keystore.steps import provisioning_check
from keystore.steps.provisioning import ProvisionOptions, ProvisionReport, provision
from keystore.steps.revocation import RemoveOptions, remove
from keystore.steps.standing import Question, recall
from tests.keystore.kit import DAY, NOW, options, policy, snapshot

A, B = policy("/robot/a", "/chatter", "/orders"), policy("/b")


@pytest.fixture
def compared(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """An entry for each provisioning that compared everything."""
    found: list[str] = []
    real = provisioning_check.provision_policies

    def counted(*words: object) -> ProvisionReport:
        found.append("compared")
        return real(*words)  # type: ignore[arg-type]

    monkeypatch.setattr(provisioning_check, "provision_policies", counted)
    return found


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache/enclave-launch"


WANTED: ProvisionOptions = options(domains=Domains.single(0))


@pytest.fixture
def root(tmp_path: Path, cache: Path, compared: list[str]) -> Path:
    """A keystore with two enclaves that was seen to stand."""
    root = tmp_path / "ks"
    assert provision(root, [A, B], options=WANTED).changed
    assert not provision(root, [A, B], options=WANTED).changed
    compared.clear()
    return root


def test_an_unchanged_keystore_is_compared_once(root: Path, compared: list[str]) -> None:
    before = snapshot(root)
    report = provision(root, [A, B], options=WANTED)
    assert not compared and not report.changed
    assert [one.enclave for one in report.enclaves] == ["/b", "/robot/a"]
    assert report.stamps.keys() == {"/b", "/robot/a"} and report.ends is not None
    provision(root, [B], options=WANTED)
    assert not compared, "one of those that are known"
    assert snapshot(root) == before


def edited(name: str) -> Callable[[Path], None]:
    def change(root: Path) -> None:
        file = root / name
        file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n", 1))

    return change


def same_bytes_again(root: Path) -> None:
    file = root / "enclaves/robot/a/cert.pem"
    file.write_bytes(file.read_bytes())


def old_times(root: Path) -> None:
    """Who tampers sets the times back; the change time is not his to set."""
    file = root / "enclaves/robot/a/permissions.p7s"
    before = file.stat()
    content = bytearray(file.read_bytes())
    content[-100] ^= 1
    file.write_bytes(content)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def copy_for_link(root: Path) -> None:
    link = root / "enclaves/robot/a/permissions_ca.cert.pem"
    target = link.resolve()
    link.unlink()
    shutil.copy(target, link)


def link_on_the_way(root: Path) -> None:
    """The same files, found elsewhere: the full comparison refuses it."""
    (root / "enclaves/robot").rename(root / "enclaves/elsewhere")
    (root / "enclaves/robot").symlink_to("elsewhere")


def another_for_it(root: Path) -> None:
    shutil.rmtree(root / "enclaves/robot/a")
    shutil.copytree(root / "enclaves/b", root / "enclaves/robot/a", symlinks=True)


CHANGES: dict[str, Callable[[Path], object]] = {
    "certificate": edited("enclaves/robot/a/cert.pem"),
    "permissions": edited("enclaves/robot/a/permissions.p7s"),
    "their readable twin": edited("enclaves/robot/a/permissions.xml"),
    "governance": edited("enclaves/governance.p7s"),
    "identity CA": edited("public/identity_ca.cert.pem"),
    "permissions CA": edited("public/permissions_ca.cert.pem"),
    "the same bytes": same_bytes_again,
    "times set back": old_times,
    "a mode": lambda root: (root / "enclaves/robot/a/key.pem").chmod(0o640),
    "a copy for a link": copy_for_link,
    "no key": lambda root: (root / "enclaves/robot/a/key.pem").unlink(),
    "no enclave": lambda root: shutil.rmtree(root / "enclaves/robot"),
    "another one for it": another_for_it,
    "a revocation": lambda root: remove(root, ["/b"], options=RemoveOptions()),
    "a link on the way": link_on_the_way,
    "an interrupted roll-over": lambda root: (root / "private/incoming").mkdir(),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_whatever_was_touched_is_compared_again(
    change: Callable[[Path], object], root: Path, compared: list[str]
) -> None:
    time.sleep(0.02)  # longer than a tick of the file system's clock
    change(root)
    with suppress(UnsafeKeystore):  # a full comparison may refuse it
        provision(root, [A], options=WANTED)
    assert compared == ["compared"]


OTHERS: dict[str, tuple[list[EnclavePolicy], ProvisionOptions]] = {
    "another enclave": ([A, B, policy("/c")], WANTED),
    "more permissions": ([policy("/robot/a", "/chatter", "/news", "/orders")], WANTED),
    "fewer permissions": ([policy("/robot/a")], WANTED),
    "a denial": (
        [A._replace(profiles=(Profile("/", "n", (Rule(Operation.PUBLISH, Qualifier.DENY, "/chatter"),)),))],
        WANTED,
    ),
    "another node name": ([A._replace(profiles=tuple(p._replace(node="m") for p in A.profiles))], WANTED),
    "another domain": ([A], WANTED._replace(domains=Domains.single(7))),
    "another rmw": ([A], WANTED._replace(rmw="rmw_zenoh_cpp")),
    "certificates that are about to end": ([A], WANTED._replace(renew_within=timedelta(days=36500))),
    "a date after their end": ([A], WANTED._replace(now=NOW + 36500 * DAY)),
    "a date before their begin": ([A], WANTED._replace(now=NOW - 36500 * DAY)),
}


@pytest.mark.parametrize("other", OTHERS.values(), ids=OTHERS)
def test_another_question_is_compared_in_full(
    other: tuple[list[EnclavePolicy], ProvisionOptions], root: Path, compared: list[str]
) -> None:
    policies, chosen = other
    with suppress(KeystoreError):  # what comes of it is told elsewhere
        provision(root, policies, options=chosen)
    assert compared == ["compared"]


@pytest.mark.parametrize("name", ["public/permissions_ca.cert.pem", "enclaves/b/cert.pem"])
def test_what_changes_while_it_is_compared_is_not_taken_for_seen(
    name: str, tmp_path: Path, cache: Path, compared: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    root = tmp_path / "ks"
    provision(root, [B], options=WANTED)
    real = provisioning_check.bring_about

    def meanwhile(*words: object) -> ProvisionReport:
        report = real(*words)  # type: ignore[arg-type]
        (root / name).write_bytes((root / name).read_bytes())
        return report

    monkeypatch.setattr(provisioning_check, "bring_about", meanwhile)
    time.sleep(0.02)
    provision(root, [B], options=WANTED)
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert recalled(root) is None
    provision(root, [B], options=WANTED)
    assert recalled(root) is not None


def recalled(root: Path) -> object:
    question = Question(root, Domains.single(0), None)
    return recall(question, [B], utc_now(), utc_now())


def test_rules_that_read_alike_are_told_apart(root: Path, compared: list[str]) -> None:
    """The policy is remembered as text; free text in one field must not look like two."""
    rule = A.profiles[0].rules[0]
    joined = A._replace(
        profiles=(A.profiles[0]._replace(rules=(rule._replace(expression="/x', 'publish ALLOW /y"),)),)
    )
    with pytest.raises(InvalidInput, match="not a valid name"):
        provision(root, [joined], options=WANTED)
    assert compared == ["compared"]


def broken_note(note: Path) -> None:
    note.write_bytes(b"\xff\n\n\x00")


def linked_note(note: Path) -> None:
    note.rename(note.with_name("elsewhere"))
    note.symlink_to("elsewhere")


def directory_for_it(note: Path) -> None:
    note.unlink()
    note.mkdir()


def pipe_for_it(note: Path) -> None:
    note.unlink()
    os.mkfifo(note)


def rewrite(note: Path, change: Callable[[int, str], str]) -> None:
    note.write_text("\n".join(change(*numbered) for numbered in enumerate(note.read_text().split("\n"))))


NOTES: dict[str, Callable[[Path], object]] = {
    "gone": Path.unlink,
    "not text": broken_note,
    "empty": lambda note: note.write_text(""),
    "cut short": lambda note: note.write_text(note.read_text()[:200]),
    "a link": linked_note,
    "a directory": directory_for_it,
    "a pipe": pipe_for_it,
    "writable by others": lambda note: note.chmod(0o666),
    "in a directory that others can write": lambda note: note.parent.chmod(0o777),
    "no dates": lambda note: rewrite(note, lambda number, line: "x" if number == 1 else line),
    "fields missing": lambda note: rewrite(note, lambda number, line: line[:30] if number > 1 else line),
    "of another version": lambda note: note.write_text(note.read_text().replace("\t", "\t0", 1)),
}


@pytest.mark.parametrize("damage", NOTES.values(), ids=NOTES)
def test_a_note_that_cannot_be_trusted_is_not_believed(
    damage: Callable[[Path], object], root: Path, cache: Path, compared: list[str]
) -> None:
    (note,) = cache.iterdir()
    damage(note)
    assert not provision(root, [A, B], options=WANTED).changed
    assert compared == ["compared"]


def test_without_a_cache_directory_nothing_is_remembered_and_nothing_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compared: list[str]
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    for _ in range(3):
        provision(tmp_path / "ks", [A], options=WANTED)
    assert len(compared) == 3


def test_a_user_without_home_leaves_nothing_in_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compared: list[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setattr("os.path.expanduser", lambda path: path)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    for _ in range(3):
        provision(tmp_path / "ks", [A], options=WANTED)
    assert len(compared) == 3 and not list((tmp_path / "here").iterdir())


def test_a_bundle_with_a_ca_that_has_ended_is_no_obstacle(
    tmp_path: Path, cache: Path, compared: list[str]
) -> None:
    """After a roll-over the old CA stays in the bundle until it is finished; the two need not overlap."""
    old, new = tmp_path / "old", tmp_path / "new"
    provision(old, [B], options=options(domains=Domains.single(0), now=NOW - 4000 * DAY))
    later_on = options(domains=Domains.single(0), now=NOW + 4000 * DAY)
    provision(new, [B], options=later_on)
    bundle = new / "public/identity_ca.cert.pem"
    bundle.write_bytes(bundle.read_bytes() + (old / "public/identity_ca.cert.pem").read_bytes())
    for _ in range(2):
        assert not provision(new, [B], options=later_on).changed
    assert len(compared) == 4, "never taken for known"


def test_the_note_is_for_the_user_alone_and_holds_no_secret(root: Path, cache: Path) -> None:
    (note,) = cache.iterdir()
    assert (cache.stat().st_mode & 0o777, note.stat().st_mode & 0o777) == (0o700, 0o600)
    assert "PRIVATE" not in note.read_text() and "/chatter" in note.read_text()


def test_notes_of_keystores_that_are_gone_do_not_pile_up(root: Path, cache: Path) -> None:
    (note,) = cache.iterdir()
    old, young = cache / "standing-00000000", cache / "standing-00000001"
    for one, days in ((old, 91), (young, 89)):
        one.touch()
        os.utime(one, (time.time() - days * 86400,) * 2)
    note.unlink()
    provision(root, [A], options=WANTED)
    assert set(cache.iterdir()) == {note, young}


def test_two_launches_on_one_keystore_remember_both(tmp_path: Path, cache: Path, compared: list[str]) -> None:
    root = tmp_path / "ks"
    provision(root, [A, B], options=WANTED)
    for one in (A, B):
        provision(root, [one], options=WANTED)
    compared.clear()
    provision(root, [A, B], options=WANTED)
    assert not compared
