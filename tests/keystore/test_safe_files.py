"""Reading a keystore without being led out of it: each refusal beside the neighbour that is read."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from keystore import DamagedKeystoreError, NotAKeystoreError, Role, StorageError, UnsafeKeystoreError
from keystore.disk import layout, safe_files

FILE = "enclaves/a/cert.pem"
KEY = "enclaves/a/key.pem"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for folder in ("public", "enclaves/a", *layout.PRIVATE_FOLDERS):
        (tmp_path / folder).mkdir(parents=True, mode=0o700)
    (tmp_path / "private").chmod(0o700)
    (tmp_path / FILE).write_bytes(b"cert")
    (tmp_path / KEY).write_bytes(b"key")
    (tmp_path / KEY).chmod(0o600)
    (tmp_path / "enclaves/a").chmod(0o755)
    (tmp_path / "public/crl.pem").write_bytes(b"crl")
    (tmp_path / "public/ca.cert.pem").write_bytes(b"ca")
    return tmp_path


@pytest.fixture
def somebody_else(monkeypatch: pytest.MonkeyPatch) -> int:
    """From now on we are another user than the owner of the files."""
    owner = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
    return owner


class TestReading:
    def test_gives_what_is_there(self, root: Path) -> None:
        assert safe_files.read(root, FILE) == safe_files.read_if_there(root, FILE) == b"cert"
        (root / FILE).write_bytes(b"")
        assert safe_files.read(root, FILE) == b""

    def test_of_what_is_missing(self, root: Path) -> None:
        (root / "enclaves/a/crl.pem").symlink_to("../../public/none.pem")
        assert safe_files.read_if_there(root, "enclaves/none/cert.pem") is None
        assert safe_files.read_if_there(root, f"{FILE}/below") is None
        with pytest.raises(DamagedKeystoreError, match=r"enclaves/none/cert\.pem.* is missing"):
            safe_files.read(root, "enclaves/none/cert.pem")
        with pytest.raises(StorageError, match="reading the keystore"):
            safe_files.read(root, f"{FILE}/below")
        with pytest.raises(StorageError, match="reading the keystore"):
            safe_files.read_if_there(root, "enclaves/" + "a" * 300)

    @pytest.mark.parametrize("kind", ["directory", "fifo"])
    def test_takes_regular_files_only_and_never_waits(self, root: Path, kind: str) -> None:
        (root / FILE).unlink()
        os.mkdir(root / FILE) if kind == "directory" else os.mkfifo(root / FILE)
        with pytest.raises(UnsafeKeystoreError, match="is not a regular file; remove it"):
            safe_files.read(root, FILE)

    @pytest.mark.parametrize(
        ("name", "size", "refused"),
        [
            (FILE, 8_000_000, False),
            (FILE, 8_000_001, True),
            (layout.REGISTER, 8_000_001, False),
            (layout.ZENOH_ROUTER, 8_000_001, False),
            (layout.REGISTER, 200_000_001, True),
        ],
    )
    def test_is_bounded(self, root: Path, name: str, size: int, refused: bool) -> None:
        (root / name).parent.mkdir(exist_ok=True)
        (root / name).touch()
        os.truncate(root / name, size)
        if refused:
            with pytest.raises(DamagedKeystoreError, match=f"is larger than {size - 1} bytes"):
                safe_files.read(root, name)
        else:
            assert len(safe_files.read(root, name)) == size

    @pytest.mark.parametrize("found", [b"cer", b"certi"])
    def test_notices_a_file_that_changes_meanwhile(
        self, root: Path, found: bytes, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(os, "read", lambda descriptor, length: found[:length])
        with pytest.raises(DamagedKeystoreError, match="changed while it was read"):
            safe_files.read(root, FILE)

    def test_leaves_no_descriptor_open(self, root: Path) -> None:
        before = len(os.listdir("/proc/self/fd"))
        safe_files.read(root, FILE)
        with pytest.raises(UnsafeKeystoreError):
            safe_files.read(root, "public")
        assert len(os.listdir("/proc/self/fd")) == before


class TestLinks:
    @pytest.mark.parametrize(
        ("name", "target", "read"),
        [
            ("public/identity_ca.cert.pem", "ca.cert.pem", True),
            ("public/identity_ca.cert.pem", "crl.pem", False),
            ("public/other.pem", "ca.cert.pem", False),
            ("enclaves/a/crl.pem", "../../public/crl.pem", True),
            ("enclaves/a/crl.pem", "../../public/ca.cert.pem", False),
            ("enclaves/a/crl.pem", "../../../public/crl.pem", False),
            ("enclaves/crl.pem", "../public/crl.pem", True),
            ("enclaves/a/stranger.pem", "../../public/crl.pem", False),
            ("elsewhere/a/crl.pem", "../../public/crl.pem", False),
            ("elsewhere/a/crl.pem", "../../../public/crl.pem", False),
            ("enclaves/a/permissions.p7s", "../../public/crl.pem", False),
        ],
    )
    def test_are_followed_where_sros2_has_them_and_nowhere_else(
        self, root: Path, name: str, target: str, read: bool
    ) -> None:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).symlink_to(target)
        assert safe_files.link_target(root, name) == target
        if read:
            assert safe_files.read(root, name) in (b"ca", b"crl")
        else:
            with pytest.raises(UnsafeKeystoreError, match="which no keystore has there") as caught:
                safe_files.read(root, name)
            assert str(caught.value).endswith(f"rm {root / name}")

    def test_what_is_not_a_link_has_no_target(self, root: Path) -> None:
        assert safe_files.link_target(root, FILE) is None
        assert safe_files.link_target(root, "enclaves/none") is None


class TestPrivateFiles:
    @pytest.mark.parametrize(
        ("mode", "refused"),
        [(0o600, False), (0o400, False), (0o640, False), (0o604, False), (0o620, True), (0o602, True)],
    )
    def test_are_read_only_where_nobody_else_can_write(self, root: Path, mode: int, refused: bool) -> None:
        """Who can read them is told elsewhere: reading does not make another key of it."""
        (root / KEY).chmod(mode)
        if refused:
            with pytest.raises(
                UnsafeKeystoreError, match=f"can be written by others \\(mode {mode:04o}\\): chmod go-rwx"
            ):
                safe_files.read_private(root, KEY)
        else:
            assert safe_files.read_private(root, KEY) == b"key"

    @pytest.mark.parametrize(("mode", "refused"), [(0o755, False), (0o775, True), (0o757, True)])
    def test_nor_in_a_directory_in_which_others_can_write(self, root: Path, mode: int, refused: bool) -> None:
        (root / "enclaves/a").chmod(mode)
        if refused:
            with pytest.raises(UnsafeKeystoreError, match=r"enclaves/a.* can be written by others"):
                safe_files.read_private(root, KEY)
        else:
            assert safe_files.read_private(root, KEY) == b"key"

    def test_are_not_read_from_somebody_else(self, root: Path, somebody_else: int) -> None:
        assert safe_files.read(root, KEY) == b"key", "which says nothing of whose it is"
        with pytest.raises(UnsafeKeystoreError) as caught:
            safe_files.read_private(root, KEY)
        assert f"belongs to user {somebody_else}, not to you ({somebody_else + 1})" in str(caught.value)
        assert str(caught.value).endswith(f"chown -R {somebody_else + 1} {root / 'enclaves/a'}")

    def test_may_be_a_link_to_the_one_key_of_sros2(self, root: Path) -> None:
        (root / layout.SHARED_CA_KEY).write_bytes(b"ca key")
        (root / layout.SHARED_CA_KEY).chmod(0o600)
        (root / layout.ca_key(Role.IDENTITY)).symlink_to("ca.key.pem")
        assert safe_files.read_private(root, layout.ca_key(Role.IDENTITY)) == b"ca key"
        (root / layout.SHARED_CA_KEY).chmod(0o620)
        with pytest.raises(UnsafeKeystoreError, match="can be written by others"):
            safe_files.read_private(root, layout.ca_key(Role.IDENTITY))

    def test_are_not_read_through_a_directory_that_is_a_link(self, root: Path) -> None:
        (root / "enclaves/b").symlink_to("a")
        with pytest.raises(UnsafeKeystoreError, match=r"enclaves/b"):
            safe_files.read_private(root, "enclaves/b/key.pem")

    def test_that_are_missing_are_told_as_missing(self, root: Path) -> None:
        with pytest.raises(DamagedKeystoreError, match="is missing"):
            safe_files.read_private(root, "private/none.pem")

    def test_what_is_wrong_with_one_is_told_with_its_repair(self, root: Path) -> None:
        assert safe_files.private_problem(root / KEY, os.stat(root / KEY)) is None
        (root / KEY).chmod(0o666)
        info = os.stat(root / KEY)
        assert safe_files.private_repair(root / KEY, info) == f"chmod go-rwx {root / KEY}"
        assert safe_files.mode_text(info) == "0666"
        assert safe_files.close_to_others(root) == f"chmod -R go-w {root}"


class TestDirectories:
    @pytest.mark.parametrize("name", [layout.PRIVATE, *layout.PRIVATE_FOLDERS])
    @pytest.mark.parametrize(
        ("mode", "refused"), [(0o700, False), (0o755, False), (0o720, True), (0o702, True)]
    )
    def test_of_private_files_let_nobody_add_to_them(
        self, root: Path, name: str, mode: int, refused: bool
    ) -> None:
        (root / name).chmod(mode)
        if refused:
            with pytest.raises(UnsafeKeystoreError, match="chmod"):
                safe_files.refuse_unsafe_private_directories(root)
        else:
            safe_files.refuse_unsafe_private_directories(root)

    def test_of_private_files_are_no_links(self, root: Path) -> None:
        (root / "private/next").rmdir()
        (root / "private/next").symlink_to(root / "enclaves/a")
        with pytest.raises(UnsafeKeystoreError, match="is not a directory"):
            safe_files.refuse_unsafe_private_directories(root)

    def test_of_private_files_may_be_missing(self, tmp_path: Path) -> None:
        safe_files.refuse_unsafe_private_directories(tmp_path)

    @pytest.mark.parametrize(("mode", "refused"), [(0o755, False), (0o775, False), (0o757, True)])
    def test_to_be_written_in_are_not_open_to_everybody(self, root: Path, mode: int, refused: bool) -> None:
        (root / "public").chmod(mode)
        if refused:
            with pytest.raises(UnsafeKeystoreError, match=r"everybody can write in .*: chmod o-w"):
                safe_files.refuse_unsafe_directory(root / "public")
        else:
            safe_files.refuse_unsafe_directory(root / "public")

    def test_to_be_written_in_are_real_and_ours(self, root: Path, tmp_path: Path) -> None:
        (root / "link").symlink_to(root / "public")
        for name in ("link", FILE):
            with pytest.raises(UnsafeKeystoreError, match=r"is not a directory \(a link\?\); remove it: rm"):
                safe_files.refuse_unsafe_directory(root / name)
        with pytest.raises(StorageError, match="looking at the directory"):
            safe_files.refuse_unsafe_directory(root / "none")

    def test_of_somebody_else_are_not_written_in(self, root: Path, somebody_else: int) -> None:
        with pytest.raises(UnsafeKeystoreError, match=f"belongs to user {somebody_else}, not to you"):
            safe_files.refuse_unsafe_directory(root / "public")

    @pytest.mark.parametrize(
        ("mode", "refused"), [(0o755, False), (0o775, False), (0o777, True), (0o1777, False)]
    )
    def test_above_a_keystore_let_nobody_rename_it(self, root: Path, mode: int, refused: bool) -> None:
        (root / "public").chmod(mode)
        if refused:
            with pytest.raises(UnsafeKeystoreError, match="everybody can rename what is in"):
                safe_files.refuse_unsafe_parent(root / "public/ks")
        else:
            safe_files.refuse_unsafe_parent(root / "public/ks")


def test_a_path_that_cannot_be_is_no_keystore(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path)
    assert safe_files.resolve_root(tmp_path / "link/ks") == tmp_path.resolve() / "ks"
    with pytest.raises(NotAKeystoreError, match="is not a path"):
        safe_files.resolve_root("a\0b")
