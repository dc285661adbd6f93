"""verify finds what is planted, and its repair, typed as it stands, repairs it."""

from __future__ import annotations

import base64
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from keystore import Finding, KeystoreError, RemoveOptions, Severity, SubjectScheme, remove, verify
from keystore.disk.view import KeystoreSettings
from keystore.verb import main
from tests.dds import sros2_style
from tests.keystore import test_verification as damages
from tests.keystore.kit import filled

Plant = Callable[[Path], object]
ENCLAVES = ["/a", "/a/c", "/b"]


def write(name: str, content: bytes = b"x") -> Plant:
    return lambda root: (root / name).write_bytes(content)


def lose(*names: str) -> Plant:
    def plant(root: Path) -> None:
        for name in names:
            (root / name).unlink()

    return plant


def mode(name: str, bits: int) -> Plant:
    return lambda root: (root / name).chmod(bits)


def copy(source: str, target: str) -> Plant:
    return lambda root: shutil.copy(root / source, root / target)


def link(name: str, target: str) -> Plant:
    def plant(root: Path) -> None:
        (root / name).unlink()
        (root / name).symlink_to(target)

    return plant


def stale_copy(name: str) -> Plant:
    def plant(root: Path) -> None:
        content = (root / name).read_bytes()
        (root / name).unlink()
        (root / name).write_bytes(content + b"\n")

    return plant


def instead(name: str, make: Callable[[Path], object]) -> Plant:
    def plant(root: Path) -> None:
        (root / name).unlink()
        make(root / name)

    return plant


def moved_away(root: Path) -> None:
    (root / "enclaves/b").rename(root.parent / "elsewhere")
    (root / "enclaves/b").symlink_to(root.parent / "elsewhere")


def governance_by_an_enclave(root: Path) -> None:
    credential = sros2_style.Credential.read(root / "enclaves/b")
    (root / "enclaves/governance.p7s").write_bytes(
        credential.sign((root / "enclaves/governance.xml").read_text())
    )


def junk_among_retired(root: Path) -> None:
    (root / "private/retired").mkdir(0o700)
    (root / "private/retired/x.key.pem").write_bytes(b"-----BEGIN PRIVATE KEY-----")


CURVE = bytes.fromhex("06082a8648ce3d030107")
"""The object identifier of P-256, as it stands in keys and certificates."""


def der_changed(name: str, old: bytes, new: bytes) -> Plant:
    def plant(root: Path) -> None:
        begin, body, end = re.split(rb"\n(?=-----END)|(?<=-----)\n", (root / name).read_bytes().strip())
        der = base64.b64decode(body)
        assert old in der
        (root / name).write_bytes(b"\n".join((begin, base64.b64encode(der.replace(old, new)), end, b"")))

    return plant


def private_half(root: Path) -> None:
    """The public half beside it stays, which is all a quick look compares."""
    der = base64.b64decode(b"".join((root / "enclaves/a/key.pem").read_bytes().splitlines()[1:-1]))
    start = der.index(b"\x04\x20") + 2
    der_changed("enclaves/a/key.pem", der[start : start + 32], bytes(reversed(der[start : start + 32])))(root)


def stray_characters(root: Path) -> None:
    """Python's base64 skips them, OpenSSL refuses the file."""
    document = root / "enclaves/a/permissions.p7s"
    head, _, tail = document.read_bytes().rpartition(b"base64\r\n")
    document.write_bytes(head + b"base64\r\n" + tail.replace(b"A", b"A\x96", 1))


# The code of the finding, and the place of an error.
PLANTED: dict[str, tuple[str, Plant]] = {
    "lost key": ("missing enclaves/a/key.pem", lose("enclaves/a/key.pem")),
    "lost certificate": ("missing", lose("enclaves/a/cert.pem")),
    "lost permissions": ("missing enclaves/a/permissions.p7s", lose("enclaves/a/permissions.p7s")),
    "lost governance link": ("missing", lose("enclaves/a/governance.p7s")),
    "lost CA link": ("missing", lose("enclaves/a/identity_ca.cert.pem")),
    "lost key and certificate": ("incomplete", lose("enclaves/b/key.pem", "enclaves/b/cert.pem")),
    "certificate garbled": ("certificate enclaves/a/cert.pem", write("enclaves/a/cert.pem")),
    "key garbled": ("key", write("enclaves/a/key.pem")),
    "private half garbled": ("key", private_half),
    "certificate of no known curve": ("certificate", der_changed("enclaves/a/cert.pem", CURVE, b"\0" * len(CURVE))),
    "signature with stray characters": ("permissions", stray_characters),
    "permissions garbled": ("permissions enclaves/a/permissions.p7s", write("enclaves/a/permissions.p7s")),
    "permissions.xml garbled": ("twin-differs enclaves/a/permissions.xml", write("enclaves/a/permissions.xml")),
    "another's certificate": ("wrong-subject enclaves/a/cert.pem", damages.swap_certificates),
    "another CA's certificate": ("wrong-ca enclaves/a/cert.pem", damages.foreign_certificate),
    "the CA's certificate": ("wrong-subject", copy("public/identity_ca.cert.pem", "enclaves/a/cert.pem")),
    "another's key pair": ("serial-reused enclaves/b/cert.pem", damages.twice_the_same_serial),
    "another's permissions": (
        "wrong-grant enclaves/a/permissions.p7s", copy("enclaves/b/permissions.p7s", "enclaves/a/permissions.p7s"),
    ),
    "signed by an enclave": ("permissions enclaves/a/permissions.p7s", damages.by_an_enclave),
    "expired permissions": ("permissions-expired enclaves/a/permissions.p7s", damages.permissions_of_the_past),
    "impossible dates": (
        "other-form enclaves/a/permissions.p7s",
        lambda root: damages.resign(root, b"<not_after>20", b"<not_after>19"),
    ),
    "empty topic": (
        "other-form enclaves/a/permissions.p7s",
        lambda root: damages.resign(root, b"<topic>rt/chatter", b"<topic/><topic>x"),
    ),
    "two grants": (
        "other-form",
        lambda root: damages.resign(root, b"</grant>\n", b"</grant>\n" + damages.second_grant()),
    ),
    "governance garbled": ("governance", write("enclaves/governance.p7s")),
    "governance signed by an enclave": ("governance", governance_by_an_enclave),
    "governance.xml garbled": ("twin-differs", write("enclaves/governance.xml")),
    "settings garbled": ("settings-changed", write("secure-keystore.json")),
    "settings of compatible subjects": (
        "settings-changed secure-keystore.json",
        write("secure-keystore.json", KeystoreSettings(SubjectScheme.COMPATIBLE).to_json()),
    ),
    "lost settings": ("settings-changed", lose("secure-keystore.json")),
    "settings open": ("writable-by-others", mode("secure-keystore.json", 0o666)),
    "CA key open to the group": (
        "unsafe-owner private/identity_ca.key.pem", mode("private/identity_ca.key.pem", 0o660),
    ),
    "private open to the group": ("unsafe-owner", mode("private", 0o770)),
    "private readable": ("readable-by-others private", mode("private", 0o755)),
    "key readable": ("readable-by-others enclaves/a/key.pem", mode("enclaves/a/key.pem", 0o644)),
    "key open": ("unsafe-owner", mode("enclaves/a/key.pem", 0o666)),
    "certificate open": ("writable-by-others enclaves/a/cert.pem", mode("enclaves/a/cert.pem", 0o666)),
    "enclave open": ("writable-by-others", mode("enclaves/a", 0o777)),
    "enclaves open": ("writable-by-others", mode("enclaves", 0o777)),
    "public open": ("writable-by-others", mode("public", 0o777)),
    "keystore open": ("writable-by-others", mode(".", 0o777)),
    "keystore open to the group": ("writable-by-others", mode(".", 0o775)),
    "link out": ("strange-link", link("enclaves/a/governance.p7s", "/etc/passwd")),
    "link to the other CA": (
        "strange-link", link("enclaves/a/identity_ca.cert.pem", "../../public/permissions_ca.cert.pem"),
    ),
    "link to another's key": ("strange-link", link("enclaves/a/key.pem", "../b/key.pem")),
    "link for an enclave": ("strange-link", moved_away),
    "key is a pipe": ("not-a-file", instead("enclaves/a/key.pem", os.mkfifo)),
    "key is a directory": ("not-a-file", instead("enclaves/a/key.pem", os.mkdir)),
    "stale CA copy": ("copy-differs", stale_copy("enclaves/a/identity_ca.cert.pem")),
    "stale governance copy": ("copy-differs", stale_copy("enclaves/a/governance.p7s")),
    "stray": ("stray", write("enclaves/a/x y;rm -r $HOME")),
    "stray key": ("stray-key", copy("enclaves/a/key.pem", "enclaves/k e y.pem")),
    "stray token URI": ("stray", write("enclaves/a/key.p11", b"pkcs11:object=x")),
    "stray directory": ("stray", lambda root: (root / "public/x").mkdir()),
    "stray among the retired": ("stray-key", junk_among_retired),
    "no name of an enclave": ("stray", lambda root: (root / "enclaves/1a").mkdir()),
    "only the case differs": ("case-collision", lambda root: (root / "enclaves/B").mkdir()),
    "interrupted": ("interrupted", lambda root: (root / ".staging").mkdir()),
    "interrupted CA": ("interrupted", lambda root: (root / "private/incoming").mkdir()),
    "dangling CRL": (
        "dangling-link enclaves/a/crl.pem",
        lambda root: (root / "enclaves/a/crl.pem").symlink_to("../../public/crl.pem"),
    ),
    "lock is a directory": ("not-a-file", instead(".lock", os.mkdir)),
}  # fmt: skip
WITH_CRL: dict[str, tuple[str, Plant]] = {
    "lost CRL link": ("no-crl", lose("enclaves/a/crl.pem")),
    "stale CRL copy": ("copy-differs", stale_copy("enclaves/a/crl.pem")),
    "lost CRL": ("dangling-link", lose("public/crl.pem")),
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A path that needs quoting in a shell."""
    return filled(tmp_path_factory.mktemp("it's here") / "ks", ENCLAVES)


@pytest.fixture(scope="module")
def sound_with_crl(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = filled(tmp_path_factory.mktemp("it's here") / "ks", [*ENCLAVES, "/gone"])
    remove(root, ["/gone"], options=RemoveOptions(durable=False))
    return root


def type_in(line: str) -> None:
    """As a shell would run it; our own command without starting another interpreter."""
    for command in line.partition("  #")[0].split(" && "):
        words = shlex.split(command)
        if words[0] == "secure-keystore":
            assert main(words[1:]) == 0, command
        else:
            subprocess.run(command, shell=True, check=True)


def faults(root: Path) -> list[Finding]:
    return [
        finding
        for finding in verify(root).findings
        if finding.severity.value in ("error", "exposure", "warning")
    ]


def check(root: Path, expected: str, plant: Plant) -> None:
    plant(root)
    found = faults(root)
    code, _, place = expected.partition(" ")
    assert code in {finding.code for finding in found}, found
    assert not place or (code, place, Severity.ERROR) in [
        (one.code, one.place, one.severity) for one in found
    ]
    typed: set[str] = set()
    while found:
        line = next((finding.repair for finding in found if finding.repair not in typed), None)
        assert line is not None, found
        typed.add(line)
        type_in(line)
        found = faults(root)


@pytest.mark.parametrize("name", PLANTED)
def test_the_repair_works_as_it_stands(sound: Path, tmp_path: Path, name: str) -> None:
    root = tmp_path / "it's here"
    shutil.copytree(sound, root, symlinks=True)
    check(root, *PLANTED[name])


@pytest.mark.parametrize("name", WITH_CRL)
def test_the_repair_works_with_a_crl(sound_with_crl: Path, tmp_path: Path, name: str) -> None:
    root = tmp_path / "it's here"
    shutil.copytree(sound_with_crl, root, symlinks=True)
    check(root, *WITH_CRL[name])


@pytest.mark.parametrize("lost", ["enclaves/governance.p7s", "public/identity_ca.cert.pem"])
def test_an_incomplete_keystore_says_how_to_complete_it(sound: Path, tmp_path: Path, lost: str) -> None:
    root = tmp_path / "it's here"
    shutil.copytree(sound, root, symlinks=True)
    (root / lost).unlink()
    with pytest.raises(KeystoreError) as caught:
        verify(root)
    type_in(str(caught.value).rpartition(": ")[2])
    main(["renew", str(root)])
    assert faults(root) == []


def test_one_damaged_part_does_not_hide_the_others(sound: Path, tmp_path: Path) -> None:
    root = tmp_path / "ks"
    shutil.copytree(sound, root, symlinks=True)
    (root / "private/identity_ca.key.pem").chmod(0o660)
    write("enclaves/governance.p7s")(root)
    write("enclaves/a/permissions.p7s")(root)
    assert {"unsafe-owner", "governance", "permissions"} <= {finding.code for finding in faults(root)}


def test_a_revoked_enclave_is_not_certified_again_with_its_old_key(
    sound_with_crl: Path, tmp_path: Path
) -> None:
    root = tmp_path / "ks"
    shutil.copytree(sound_with_crl, root, symlinks=True)
    shutil.copytree(root / "enclaves/a", tmp_path / "backup", symlinks=True)
    remove(root, ["/a"], options=RemoveOptions(durable=False))
    shutil.rmtree(root / "enclaves/a", ignore_errors=True)
    shutil.copytree(tmp_path / "backup", root / "enclaves/a", symlinks=True)
    (finding,) = [finding for finding in faults(root) if finding.code == "revoked"]
    type_in(finding.repair)
    assert (root / "enclaves/a/key.pem").read_bytes() != (tmp_path / "backup/key.pem").read_bytes()
    assert faults(root) == []
