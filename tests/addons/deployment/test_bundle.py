"""What goes to a host: exactly the files its processes read."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from enclave_addons.deployment import PublicFiles, export
from keystore import DamagedKeystoreError, InvalidInputError, RemoveOptions, Role, remove, verify
from keystore.disk import layout
from keystore.verb import main
from tests.keystore.kit import DAY, NOW, contents, filled, mode, openssl

NAMES = ("/", "/robot1", "/robot1/arm", "/robot1/camera", "/robot2/arm")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return filled(tmp_path / "ks", NAMES)


def files(*enclaves: str) -> set[str]:
    return {f"enclaves{enclave}/{name}" for enclave in enclaves for name in layout.RUNTIME_FILES}


PUBLIC = {"public/identity_ca.cert.pem", "public/permissions_ca.cert.pem", "enclaves/governance.p7s"}


def test_one_enclave_takes_nothing_of_those_below_it(root: Path, tmp_path: Path) -> None:
    assert export(root, tmp_path / "out", ["/robot1"]) == ("/robot1",)
    assert set(contents(tmp_path / "out")) == files("/robot1") | PUBLIC


def test_the_root_enclave_takes_nothing_of_anyone(root: Path, tmp_path: Path) -> None:
    export(root, tmp_path / "out", ["/"])
    assert set(contents(tmp_path / "out")) == files("") | PUBLIC


def test_a_pattern(root: Path, tmp_path: Path) -> None:
    assert export(root, tmp_path / "out", ["/robot1/*"]) == ("/robot1/arm", "/robot1/camera")
    assert set(contents(tmp_path / "out")) == files("/robot1/arm", "/robot1/camera") | PUBLIC


def test_no_ca_key_ever(root: Path, tmp_path: Path) -> None:
    export(root, tmp_path / "out", ["*"])
    ca_keys = {path.read_bytes() for path in (root / "private").iterdir()}
    exported = contents(tmp_path / "out")
    assert not ca_keys & {content for content in exported.values() if isinstance(content, bytes)}
    assert "private" not in {name.split("/")[0] for name in exported}


def test_a_bundle_is_a_good_keystore(root: Path, tmp_path: Path) -> None:
    export(root, tmp_path / "out", ["/robot1*"])
    assert {finding.code for finding in verify(tmp_path / "out").findings} == {"no-ca-key"}
    assert mode(tmp_path / "out/enclaves/robot1/key.pem") == 0o600


@pytest.mark.parametrize("enclave", ["/", "/robot1/arm"])
def test_copies_stand_alone(root: Path, tmp_path: Path, enclave: str) -> None:
    export(root, tmp_path / "out", [enclave], public=PublicFiles.COPY)
    assert not any(path.is_symlink() for path in (tmp_path / "out").rglob("*"))
    assert set(contents(tmp_path / "out")) == files(enclave.rstrip("/")) | PUBLIC
    assert verify(tmp_path / "out").is_good
    directory = tmp_path / "out/enclaves" / enclave.lstrip("/")
    openssl("verify", "-CAfile", directory / "identity_ca.cert.pem", directory / "cert.pem")


@pytest.mark.parametrize("name", ["out.tar", "out.tar.gz"])
def test_an_archive_has_the_same_bytes_every_time(root: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    for place in ("one", "two"):
        export(root, tmp_path / place / name, ["*"])
    assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    assert mode(tmp_path / "one" / name) == 0o600, "it holds keys"
    with tarfile.open(tmp_path / "one" / name) as archive:
        # Older point releases of Python 3.10 and 3.11 have no filters yet; newer ones warn without.
        archive.extraction_filter = getattr(tarfile, "tar_filter", None)
        archive.extractall(tmp_path / "unpacked")
    export(root, tmp_path / "plain", ["*"])
    assert contents(tmp_path / "unpacked") == contents(tmp_path / "plain")
    assert mode(tmp_path / "unpacked/enclaves/key.pem") == 0o600


def test_the_crl_goes_along(root: Path, tmp_path: Path) -> None:
    remove(root, ["/robot2/arm"], options=RemoveOptions(durable=False))
    export(root, tmp_path / "out", ["/robot1"])
    assert {"public/crl.pem", "enclaves/robot1/crl.pem"} <= set(contents(tmp_path / "out"))
    export(root, tmp_path / "copies", ["/robot1"], public=PublicFiles.COPY)
    assert (tmp_path / "copies/enclaves/robot1/crl.pem").read_bytes() == (
        root / "public/crl.pem"
    ).read_bytes()


def test_strays_stay_at_home(root: Path, tmp_path: Path) -> None:
    (root / "enclaves/robot1/notes.txt").write_text("secret")
    (root / "public/ca.srl").write_text("01")
    export(root, tmp_path / "out", ["/robot1"])
    assert set(contents(tmp_path / "out")) == files("/robot1") | PUBLIC


def test_nothing_matches(root: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="no enclave matches '/robot9"):
        export(root, tmp_path / "out", ["/robot1", "/robot9*"])
    assert not (tmp_path / "out").exists()


def test_what_exists_is_not_overwritten(root: Path, tmp_path: Path) -> None:
    (tmp_path / "out.tar").write_text("mine")
    with pytest.raises(InvalidInputError, match="exists already"):
        export(root, tmp_path / "out.tar", ["*"])
    assert (tmp_path / "out.tar").read_text() == "mine"


def test_incomplete_and_expired_enclaves_are_not_deployed(root: Path, tmp_path: Path) -> None:
    with pytest.raises(DamagedKeystoreError, match="not valid now"):
        export(root, tmp_path / "out", ["/robot1"], now=NOW + 9000 * DAY)
    (root / "enclaves/robot1/permissions.p7s").unlink()
    with pytest.raises(DamagedKeystoreError, match="incomplete"):
        export(root, tmp_path / "out", ["/robot1"])


def test_a_failed_export_leaves_nothing(root: Path, tmp_path: Path) -> None:
    place = tmp_path / "place"
    place.mkdir()
    program = (
        "import resource, signal\n"
        "from enclave_addons.deployment.public_files import export\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (600, 600))\n"
        f"export({str(root)!r}, {str(place / 'out')!r}, ['*'])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert "StorageError" in done.stderr
    assert os.listdir(place) == []


def test_the_command_says_how_to_pin_the_cas(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root, bundle = filled(tmp_path / "ks", ["/a"]), tmp_path / "bundle"
    assert main(["export", str(root), "-o", str(bundle), "--enclave", "/a"]) == 0
    words = capsys.readouterr().err.rpartition(": ")[2].split()
    assert main(["verify", str(bundle), *words[3:]]) == 0
    other = filled(tmp_path / "other", ["/a"])
    for role in Role:
        name = f"public/{role.value}.cert.pem"
        (bundle / name).write_bytes((bundle / name).read_bytes() + (other / name).read_bytes())
    assert main(["verify", str(bundle), *words[3:]]) == 1
