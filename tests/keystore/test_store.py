"""The only writer by itself: private from the first byte, on the disk before it is seen, nothing left behind.

``watched`` looks after each call that makes or changes a file, so that a mode is seen as it was at that moment, before
the next call mends it.
"""

from __future__ import annotations

import errno
import os
import shutil
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from enclave_addons.deployment import RequestOptions, request
from keystore import CaAccess, ImportedCa, Role, Secret, Step, StorageError, UnsafeKeystoreError, roll_over
from keystore.disk import layout, store
from keystore.disk.store import Content, Link, Store, write_new
from keystore.disk.versions import Versions, make_directories
from keystore.formats.register import Register
from tests.keystore import kit

UMASKS = (0o000, 0o002, 0o022, 0o027, 0o077)


@pytest.fixture
def umask() -> Iterator[Callable[[int], int]]:
    before = os.umask(0o022)
    yield os.umask
    os.umask(before)


def watched(monkeypatch: pytest.MonkeyPatch, look: Callable[[], None]) -> None:
    """``look`` is called after each call that makes, fills or renames a file."""
    for name in ("open", "mkdir", "write", "chmod", "fchmod", "rename", "symlink", "replace"):
        real = getattr(os, name)

        def looking(*arguments: Any, _real: Callable[..., Any] = real, **named: Any) -> Any:
            result = _real(*arguments, **named)
            look()
            return result

        monkeypatch.setattr(os, name, looking)


def born(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Of each file and directory the mode at the moment it was made, by its path at that moment."""
    modes: dict[str, int] = {}
    real_open, real_mkdir = os.open, os.mkdir

    def opening(path: Any, flags: int, mode: int = 0o777, **named: Any) -> int:
        is_new = bool(flags & os.O_CREAT) and not os.path.lexists(path)
        descriptor = real_open(path, flags, mode, **named)
        if is_new:
            modes[str(path)] = stat.S_IMODE(os.fstat(descriptor).st_mode)
        return descriptor

    def making(path: Any, mode: int = 0o777, **named: Any) -> None:
        real_mkdir(path, mode, **named)
        modes[str(path)] = stat.S_IMODE(os.lstat(path).st_mode)

    monkeypatch.setattr(os, "open", opening)
    monkeypatch.setattr(os, "mkdir", making)
    return modes


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "ks"
    store.create_root(root)
    return root


def opened(root: Path, **options: Any) -> Any:
    return store.opened(root, timeout=5, **{"durable": False, **options})


def written(root: Path, **options: Any) -> None:
    """One batch of each kind of entry."""
    with opened(root, **options) as opened_store:
        opened_store.ensure_directory(layout.PRIVATE)
        with opened_store.batch() as batch:
            batch.record(Register())
            batch.file("public/anchor.pem", b"public")
            batch.file("private/ca.pem", b"secret", store.PRIVATE_MODE)
            batch.directory("enclaves/a", {"key.pem": Content(b"k", 0o600), "cert.pem": Content(b"c")})
            batch.directory("private/next", {"key.pem": Content(b"k", 0o600), "cert.pem": Content(b"c")})
            batch.link("enclaves/link", Link("../public/anchor.pem", "public/anchor.pem"))


class TestModes:
    @pytest.mark.parametrize("mask", UMASKS)
    def test_are_the_same_under_every_umask(self, root: Path, mask: int, umask: Callable[[int], int]) -> None:
        umask(mask)
        written(root)
        modes = {path.relative_to(root).as_posix(): kit.mode(path) for path in root.rglob("*")}
        assert {name: mode for name, mode in modes.items() if name not in (".lock", "enclaves/link")} == {
            "public": 0o755,
            "public/anchor.pem": 0o644,
            "private": 0o700,
            "private/ca.pem": 0o600,
            "private/register.json": 0o600,
            "private/next": 0o700,
            "private/next/key.pem": 0o600,
            "private/next/cert.pem": 0o644,
            "enclaves": 0o755,
            "enclaves/a": 0o755,
            "enclaves/a/key.pem": 0o600,
            "enclaves/a/cert.pem": 0o644,
        }
        assert modes[".lock"] & 0o077 == 0

    @pytest.mark.parametrize("mask", UMASKS)
    def test_nothing_staged_is_ever_open_to_others(
        self, root: Path, mask: int, umask: Callable[[int], int], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        umask(mask)
        modes = born(monkeypatch)
        written(root)
        staging = str(root / layout.STAGING)
        assert modes[staging] == 0o700
        private = {path: mode for path, mode in modes.items() if path.endswith(("key.pem", "/0", "/2", "/4"))}
        assert len([path for path in private if path.startswith(staging)]) == 5, (
            "the register, the CA, the directory of the next CA, and both keys"
        )
        assert not any(mode & 0o077 for mode in private.values()), private
        public = [path for path in modes if path.endswith("cert.pem")]
        assert len(public) == 2 and all(modes[path] == 0o644 & ~mask for path in public)

    @pytest.mark.parametrize("mask", UMASKS)
    @pytest.mark.parametrize(
        "work", ["create", "locked", "imported", "start", "switch", "provision", "request"]
    )
    def test_a_private_key_is_its_owners_alone_at_every_moment(
        self,
        tmp_path: Path,
        work: str,
        mask: int,
        umask: Callable[[int], int],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        """The temporary file, the staged one, the one in force: whoever opens it in between has the key."""
        root = tmp_path / "work" / "ks"
        prepared(work, root, tmp_path)
        umask(mask)
        seen = set()

        def look() -> None:
            for path in root.parent.rglob("*"):
                if b"PRIVATE KEY" in content(path):
                    seen.add(path)
                    assert kit.mode(path) == 0o600, f"{path} is {kit.mode(path):04o}"

        with monkeypatch.context() as patched:
            watched(patched, look)
            done(work, root, tmp_path)
        assert len(seen) >= 2, "staged, and in its place"
        everything = {path for path in root.parent.rglob("*") if b"PRIVATE KEY" in content(path)}
        assert everything and all(kit.mode(path.parent) & 0o022 == 0 for path in everything)
        public = [path for path in root.rglob("*cert.pem") if not path.is_symlink()]
        assert all(kit.mode(path) == 0o644 for path in public), "neighbours that everybody may read"

    @pytest.mark.parametrize("mask", UMASKS)
    def test_of_a_new_root_and_what_is_written_for_hosts(
        self, tmp_path: Path, mask: int, umask: Callable[[int], int], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        umask(mask)
        modes = born(monkeypatch)
        store.create_root(tmp_path / "new")
        make_directories(tmp_path, "a/b/key.pem")
        write_new(tmp_path / "a/b/key.pem", b"k", 0o600)
        write_new(tmp_path / "a/b/cert.pem", b"c", 0o644, durable=True)
        assert kit.mode(tmp_path / "new") == 0o755
        assert [kit.mode(tmp_path / name) for name in ("a", "a/b")] == [0o755, 0o755]
        assert [kit.mode(tmp_path / "a/b" / name) for name in ("key.pem", "cert.pem")] == [0o600, 0o644]
        assert modes[str(tmp_path / "a/b/key.pem")] & 0o077 == 0
        made = [str(tmp_path / name) for name in ("new", "a", "a/b")]
        assert not any(modes[path] & 0o022 for path in made), "nor for a moment open to others"

    @pytest.mark.parametrize("mask", UMASKS)
    def test_of_a_version_that_is_imported(
        self, tmp_path: Path, mask: int, umask: Callable[[int], int], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        umask(mask)
        modes = born(monkeypatch)
        versions = Versions(tmp_path / "ks")
        with versions.opened(5):
            staged = versions.stage({"enclaves/a/key.pem": Content(b"k", 0o600), "a.pem": Content(b"c")})
            assert modes[str(staged)] == 0o700 & ~mask and kit.mode(staged) == 0o755
            assert modes[str(staged / "enclaves/a/key.pem")] & 0o077 == 0
            versions.switch(1)
        found = [kit.mode(tmp_path / "ks" / name) for name in ("enclaves", "enclaves/a/key.pem", "a.pem")]
        assert found == [0o755, 0o600, 0o644]

    def test_a_root_is_made_with_those_above_it(self, tmp_path: Path) -> None:
        store.create_root(tmp_path / "robots/one/ks")
        assert kit.mode(tmp_path / "robots/one/ks") == 0o755

    def test_an_existing_root_keeps_its_mode(self, tmp_path: Path) -> None:
        (tmp_path / "ks").mkdir(mode=0o700)
        store.create_root(tmp_path / "ks")
        assert kit.mode(tmp_path / "ks") == 0o700

    def test_are_repaired_on_the_file_and_never_through_a_link(self, root: Path, tmp_path: Path) -> None:
        (tmp_path / "elsewhere").write_text("")
        (tmp_path / "elsewhere").chmod(0o644)
        (root / "mine").write_text("")
        (root / "link").symlink_to(tmp_path / "elsewhere")
        with opened(root) as opened_store:
            opened_store.set_mode("mine", 0o600)
            assert kit.mode(root / "mine") == 0o600
            with pytest.raises(StorageError, match="changing the mode of"):
                opened_store.set_mode("link", 0o600)
        assert kit.mode(tmp_path / "elsewhere") == 0o644


def content(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() and not path.is_symlink() else b""


def prepared(work: str, root: Path, tmp_path: Path) -> None:
    root.parent.mkdir()
    (tmp_path / "passphrase").write_text("open sesame")
    if work == "imported":
        kit.created(tmp_path / "given")
    if work in ("start", "switch", "provision"):
        kit.filled(root, ["/a"])
    if work == "switch":
        roll_over(root, Step.START, tuple(Role), options=kit.options())


def done(work: str, root: Path, tmp_path: Path) -> None:
    if work == "create":
        kit.created(root)
    elif work == "locked":
        access = CaAccess(passphrase=Secret(tmp_path / "passphrase"))
        kit.created(root, access=access, encrypt_ca_keys=True)
    elif work == "imported":
        given = tmp_path / "given"
        cas = {role: ImportedCa(given / layout.ca_cert(role), given / layout.ca_key(role)) for role in Role}
        kit.created(root, imported=cas)
    elif work == "provision":
        kit.filled(root, ["/a", "/b"])
    elif work == "request":
        request(root, ["/a"], options=RequestOptions(lock_timeout=5))
    else:
        roll_over(root, Step(work), tuple(Role), options=kit.options())


class Disk:
    """What a run asked of the disk, in order: ``fsync NAME``, ``syncfs NAME``, ``rename NAME``."""

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch):
        self.steps: list[str] = []
        real_fsync, real_rename, real_syncfs = os.fsync, os.rename, store._sync_file_system

        def name(path: str) -> str:
            return os.path.relpath(path, root)

        def fsync(descriptor: int) -> None:
            self.steps.append(f"fsync {name(os.readlink(f'/proc/self/fd/{descriptor}'))}")
            real_fsync(descriptor)

        def rename(source: str, target: str) -> None:
            self.steps.append(f"rename {name(target)}")
            real_rename(source, target)

        def syncfs(path: Path) -> bool:
            self.steps.append(f"syncfs {name(str(path))}")
            return real_syncfs(path)

        monkeypatch.setattr(os, "fsync", fsync)
        monkeypatch.setattr(os, "rename", rename)
        monkeypatch.setattr(store, "_sync_file_system", syncfs)


def many(opened_store: Store, count: int) -> None:
    with opened_store.batch() as batch:
        for number in range(count):
            batch.file(f"enclaves/e{number}/cert.pem", b"c")


class TestDurability:
    def test_a_few_files_are_on_the_disk_before_they_are_seen_and_their_names_after(
        self, root: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        disk = Disk(root, monkeypatch)
        with opened(root, durable=True) as opened_store, opened_store.batch() as batch:
            batch.file("public/a.pem", b"a")
            batch.directory("enclaves/a", {"cert.pem": Content(b"c")})
        assert disk.steps == [
            "fsync .staging/0", "fsync .staging/1/cert.pem", "fsync .staging/1",
            "rename public/a.pem", "rename enclaves/a",
            "fsync enclaves", "fsync public",
        ]  # fmt: skip

    def test_twelve_are_asked_for_one_by_one_and_thirteen_all_at_once(
        self, root: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        disk = Disk(root, monkeypatch)
        with opened(root, durable=True) as opened_store:
            many(opened_store, 12)
            assert [step for step in disk.steps if step.startswith("syncfs")] == []
            assert len([step for step in disk.steps if step.startswith("fsync")]) == 24
            disk.steps.clear()
            many(opened_store, 13)
        assert [disk.steps[0], disk.steps[-1], len(disk.steps)] == ["syncfs .staging", "syncfs .", 15]

    def test_without_syncfs_each_of_many_is_asked_for(
        self, root: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        disk = Disk(root, monkeypatch)
        monkeypatch.setattr(store, "_sync_file_system", lambda path: False)
        with opened(root, durable=True) as opened_store:
            many(opened_store, 13)
        assert len([step for step in disk.steps if step.startswith("fsync .staging")]) == 13
        assert len([step for step in disk.steps if step.startswith("fsync enclaves")]) == 13

    def test_what_can_be_thrown_away_is_not_waited_for(
        self, root: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        disk = Disk(root, monkeypatch)
        with opened(root, durable=False) as opened_store:
            many(opened_store, 13)
        assert all(step.startswith("rename") for step in disk.steps) and len(disk.steps) == 13

    @pytest.mark.parametrize(("code", "passes"), [(errno.EINVAL, True), (errno.EIO, False)])
    def test_only_a_file_system_that_cannot_sync_is_forgiven(
        self, root: Path, code: int, passes: bool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def failing(descriptor: int) -> None:
            raise OSError(code, os.strerror(code))

        monkeypatch.setattr(os, "fsync", failing)
        with opened(root, durable=True) as opened_store:
            if passes:
                many(opened_store, 1)
            else:
                with pytest.raises(StorageError, match=os.strerror(code)):
                    many(opened_store, 1)
        assert (root / "enclaves/e0/cert.pem").exists() is passes

    def test_syncfs_that_fails_is_reported(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """The real call, on a descriptor that it must refuse."""
        assert store._sync_file_system(root)
        monkeypatch.setattr(os, "open", lambda path, flags: 987_654)
        monkeypatch.setattr(os, "close", lambda descriptor: None)
        with pytest.raises(OSError, match=os.strerror(errno.EBADF)):
            store._sync_file_system(root)

    def test_no_descriptor_stays_open(self, root: Path) -> None:
        before = len(os.listdir("/proc/self/fd"))
        written(root, durable=True)
        with opened(root, durable=True) as opened_store:
            many(opened_store, 13)
        assert len(os.listdir("/proc/self/fd")) == before


class TestBatches:
    def test_the_register_takes_its_place_first(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        disk = Disk(root, monkeypatch)
        with opened(root) as opened_store:
            with opened_store.batch() as batch:
                batch.file("public/a.pem", b"a")
                batch.record(Register(crl_number=7))
            assert opened_store.register.crl_number == 7 and opened_store.has_register
        assert disk.steps == ["rename private/register.json", "rename public/a.pem"]

    def test_one_that_raises_leaves_nothing_and_its_register_does_not_count(self, root: Path) -> None:
        with opened(root) as opened_store:
            before = kit.snapshot(root)
            with pytest.raises(StorageError, match="writing the keystore"), opened_store.batch() as batch:
                batch.record(Register(crl_number=7))
                batch.file("public/a.pem", b"a")
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            assert kit.snapshot(root).keys() == before.keys()
            assert (opened_store.register.crl_number, opened_store.has_register) == (0, False)

    def test_an_empty_one_changes_nothing(self, root: Path) -> None:
        with opened(root) as opened_store:
            before = kit.snapshot(root)
            with opened_store.batch():
                pass
            assert kit.snapshot(root) == before

    def test_a_new_directory_appears_whole_and_files_of_an_old_one_stay(self, root: Path) -> None:
        with opened(root) as opened_store:
            for entries in ({"a": Content(b"1"), "b": Content(b"1")}, {"b": Content(b"2")}):
                with opened_store.batch() as batch:
                    batch.directory("enclaves/e", entries)
        assert [(root / "enclaves/e" / name).read_bytes() for name in "ab"] == [b"1", b"2"]
        assert not (root / layout.STAGING).exists()

    def test_a_planted_link_is_not_taken_for_a_directory(self, root: Path, tmp_path: Path) -> None:
        (tmp_path / "elsewhere").mkdir()
        (root / "public").symlink_to(tmp_path / "elsewhere")
        with pytest.raises(UnsafeKeystoreError, match="not a directory"), opened(root):
            pass
        (root / "public").unlink()
        with opened(root) as opened_store:
            (root / "enclaves").symlink_to(tmp_path / "elsewhere")
            assert not opened_store.is_directory("enclaves") and not opened_store.is_directory("none")
            with pytest.raises(UnsafeKeystoreError, match="not a directory"), opened_store.batch() as batch:
                batch.file("enclaves/cert.pem", b"c")
        assert os.listdir(tmp_path / "elsewhere") == []

    @pytest.mark.parametrize(
        ("code", "copies"), [(errno.EPERM, True), (errno.ENOTSUP, True), (errno.EIO, False)]
    )
    def test_where_there_are_no_links_a_copy_takes_their_place(
        self, root: Path, code: int, copies: bool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def refusing(target: str, place: str) -> None:
            raise OSError(code, os.strerror(code))

        with opened(root) as opened_store:
            with opened_store.batch() as batch:
                batch.file("public/anchor.pem", b"anchor")
            monkeypatch.setattr(os, "symlink", refusing)
            link = Link("../public/anchor.pem", "public/anchor.pem")
            if copies:
                with opened_store.batch() as batch:
                    batch.link("enclaves/link", link)
                assert (root / "enclaves/link").read_bytes() == b"anchor"
            else:
                with pytest.raises(StorageError, match=os.strerror(code)), opened_store.batch() as batch:
                    batch.link("enclaves/link", link)

    def test_a_link_is_a_link_where_it_can_be(self, root: Path) -> None:
        written(root)
        assert os.readlink(root / "enclaves/link") == "../public/anchor.pem"


class TestRemoval:
    def test_of_a_file_that_is_there_and_of_one_that_is_not(self, root: Path) -> None:
        written(root)
        with opened(root) as opened_store:
            opened_store.remove("public/anchor.pem")
            opened_store.remove("public/anchor.pem")
            with pytest.raises(StorageError, match="removing"):
                opened_store.remove("public")
        assert not (root / "public/anchor.pem").exists()

    def test_of_directories_only_when_empty(self, root: Path) -> None:
        written(root)
        with opened(root) as opened_store:
            assert not opened_store.remove_empty_directory("public")
            opened_store.remove("public/anchor.pem")
            assert opened_store.remove_empty_directory("public")
            assert not opened_store.remove_empty_directory("public"), "gone already"
            opened_store.ensure_directory("public")
            assert (root / "public").is_dir(), "it is known to be gone, and made again"
            with pytest.raises(StorageError, match="removing"):
                opened_store.remove_empty_directory(".lock")


class TestOpening:
    def test_clears_what_a_dead_run_left(self, root: Path) -> None:
        (root / layout.STAGING / "3").mkdir(parents=True)
        with opened(root):
            assert not (root / layout.STAGING).exists()

    def test_clears_a_planted_link_and_not_what_it_points_to(self, root: Path, tmp_path: Path) -> None:
        (tmp_path / "mine").mkdir()
        (tmp_path / "mine/file").write_text("kept")
        (root / layout.STAGING).symlink_to(tmp_path / "mine")
        with opened(root):
            assert not os.path.lexists(root / layout.STAGING)
        assert (tmp_path / "mine/file").read_text() == "kept"

    def test_says_what_it_could_not_clear(self, root: Path) -> None:
        (root / layout.STAGING).write_text("a file")
        with pytest.raises(StorageError, match="clearing what an interrupted run left in"), opened(root):
            pass

    @pytest.mark.parametrize(
        ("name", "mode", "refused"),
        [
            ("..", 0o777, True),
            ("..", 0o1777, False),
            (".", 0o757, True),
            (".", 0o775, False),
            *((name, 0o757, True) for name in ("public", "private", "enclaves")),
            *((name, 0o775, False) for name in ("public", "enclaves")),
            *((f"private{below}", 0o770, True) for below in ("", "/next", "/incoming", "/retired")),
            *((f"private{below}", 0o750, False) for below in ("", "/next", "/incoming", "/retired")),
        ],
    )
    def test_refuses_folders_in_which_others_can_write(
        self, root: Path, name: str, mode: int, refused: bool
    ) -> None:
        for folder in ("public", "enclaves", "private/next", "private/incoming", "private/retired"):
            (root / folder).mkdir(parents=True)
        (root / name).chmod(mode)
        if refused:
            with pytest.raises(UnsafeKeystoreError), opened(root):
                pass
        else:
            with opened(root):
                pass
        (root / name).chmod(0o755)

    def test_a_keystore_that_is_gone_is_reported(self, root: Path) -> None:
        shutil.rmtree(root)
        with pytest.raises(StorageError, match="looking at the directory"), opened(root):
            pass
        with pytest.raises(StorageError, match="opening the keystore"), opened(root / "below"):
            pass

    def test_a_root_is_made_in_a_safe_place_only(self, tmp_path: Path) -> None:
        tmp_path.chmod(0o777)
        with pytest.raises(UnsafeKeystoreError, match="everybody can rename"):
            store.create_root(tmp_path / "ks")
        assert not (tmp_path / "ks").exists()
        tmp_path.chmod(0o1777)
        store.create_root(tmp_path / "ks")
        assert (tmp_path / "ks").is_dir()
        tmp_path.chmod(0o700)
        (tmp_path / "file").write_text("")
        with pytest.raises(StorageError, match="creating the keystore"):
            store.create_root(tmp_path / "file/below/ks")


def test_a_version_is_on_the_disk_before_it_is_in_force(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    versions = Versions(tmp_path / "ks")
    with versions.opened(5):
        versions.stage({"enclaves/a.pem": Content(b"c"), "link": Link("enclaves/a.pem", "enclaves/a.pem")})
        disk = Disk(tmp_path, monkeypatch)
        versions.switch(1)
    staging = "ks.d/.staging"
    assert sorted(disk.steps[:3]) == [
        f"fsync {staging}", f"fsync {staging}/enclaves", f"fsync {staging}/enclaves/a.pem",
    ]  # fmt: skip
    assert disk.steps[3:] == ["rename ks.d/1", "fsync ks.d", "rename ks", "fsync ."]


def test_a_bundle_is_on_the_disk_when_it_is_asked_to_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Disk(tmp_path, monkeypatch)
    write_new(tmp_path / "quick", b"c", 0o644)
    assert disk.steps == []
    write_new(tmp_path / "safe", b"c", 0o644, durable=True)
    assert disk.steps == ["fsync safe"]
    (tmp_path / "link").symlink_to(tmp_path / "none")
    for taken in ("safe", "link"):
        with pytest.raises(FileExistsError):
            write_new(tmp_path / taken, b"d", 0o644)
    assert not (tmp_path / "none").exists()


def test_a_host_sees_the_version_of_before_or_the_new_one(tmp_path: Path) -> None:
    versions = Versions(tmp_path / "ks")
    for number in (1, 2):
        with versions.opened(5):
            versions.stage({"enclaves/a/key.pem": Content(b"%d" % number, 0o600)})
            assert versions.current == (None if number == 1 else versions.folder / "1")
            versions.switch(number)
        assert (tmp_path / "ks/enclaves/a/key.pem").read_bytes() == b"%d" % number
    assert sorted(os.listdir(versions.folder)) == [".lock", "2"], "keys of before are gone"
