"""verify: damage is found where it is, with a repair; a good keystore is silent. More of it: ``test_repairs``."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from keystore import (
    CaAccess,
    Domains,
    Finding,
    NotAKeystoreError,
    RenewOptions,
    Role,
    Severity,
    Validity,
    provision,
    renew,
    verification,
    verify,
)
from keystore.disk.view import KeystoreView
from keystore.formats.permissions import permissions_document
from keystore.signing import smime
from keystore.verification import enclaves
from tests.dds import sros2_style
from tests.keystore.kit import DAY, NOW, filled, options, policy

Damage = Callable[[Path], object]


def sign(root: Path, document: bytes) -> bytes:
    ca = KeystoreView(root).authority(Role.PERMISSIONS, CaAccess())
    return smime.sign_document(document, ca)


def resign(root: Path, old: bytes, new: bytes) -> None:
    """A document that the CA really signed, but should not have."""
    twin = root / "enclaves/a/permissions.xml"
    changed = twin.read_bytes().replace(old, new)
    assert changed != twin.read_bytes()
    twin.write_bytes(changed)
    (root / "enclaves/a/permissions.p7s").write_bytes(sign(root, changed))


def by_an_enclave(root: Path) -> None:
    """The attack of CVE-2023-24010 as it lies on disk."""
    credential = sros2_style.Credential.read(root / "enclaves/b")
    document = (root / "enclaves/a/permissions.xml").read_text()
    (root / "enclaves/a/permissions.p7s").write_bytes(credential.sign(document))


def swap_certificates(root: Path) -> None:
    shutil.copy(root / "enclaves/b/cert.pem", root / "enclaves/a/cert.pem")


def foreign_certificate(root: Path) -> None:
    other = sros2_style.issue("ros.a", sros2_style.issue("sros2CA", is_ca=True))
    (root / "enclaves/a/cert.pem").write_bytes(other.certificate_pem)
    (root / "enclaves/a/key.pem").write_bytes(other.key_pem)


def twice_the_same_serial(root: Path) -> None:
    for name in ("cert.pem", "key.pem"):
        shutil.copy(root / "enclaves/b" / name, root / "enclaves/a" / name)


def permissions_of_the_past(root: Path) -> None:
    past = Validity(NOW - 9000 * DAY, NOW - 8000 * DAY)
    document = permissions_document("CN=ros.a", policy("/a"), validity=past, domains=Domains.single(0))
    (root / "enclaves/a/permissions.xml").write_bytes(document)
    (root / "enclaves/a/permissions.p7s").write_bytes(sign(root, document))


def many_topics(root: Path) -> None:
    provision(root, [policy("/a", *(f"/{'x' * 60}{n}" for n in range(1200)))], options=options())


DAMAGES: list[tuple[str, str, Damage]] = [
    ("key-mismatch", "enclaves/a/key.pem", swap_certificates),
    ("other-form", "enclaves/a/permissions.p7s", lambda root: resign(root, b"<allow_rule>", b"<permit_rule>")),
    ("wrong-grant", "enclaves/a/permissions.p7s", lambda root: resign(root, b"CN=ros.a<", b"CN=ros.b<")),
    (
        "other-form", "enclaves/governance.p7s",
        lambda root: (root / "enclaves/governance.p7s").write_bytes(sign(root, b"<dds/>")),
    ),
    ("too-large", "enclaves/a/permissions.p7s", many_topics),
    ("ca-key", "private/identity_ca.key.pem",
     lambda root: shutil.copy(root / "private/permissions_ca.key.pem", root / "private/identity_ca.key.pem")),
    ("strange-link", "enclaves/a/extra", lambda root: (root / "enclaves/a/extra").symlink_to("/etc/passwd")),
    ("stray-key", "public/backup.pem",
     lambda root: shutil.copy(root / "enclaves/a/key.pem", root / "public/backup.pem")),
]  # fmt: skip


@pytest.mark.parametrize(
    ("code", "place", "damage"), DAMAGES, ids=[f"{row[0]}-{n}" for n, row in enumerate(DAMAGES)]
)
def test_damage_is_found_with_its_place_and_repair(
    tmp_path: Path, code: str, place: str, damage: Damage
) -> None:
    root = filled(tmp_path / "ks", ["/a", "/b"])
    assert verify(root).findings == ()
    damage(root)
    report = verify(root)
    assert not report.is_good
    found = [finding for finding in report.findings if (finding.code, finding.place) == (code, place)]
    assert found, report.findings
    assert found[0].severity is Severity.ERROR
    assert found[0].repair


WARNINGS: list[tuple[str, Damage]] = [
    ("stray", lambda root: (root / "enclaves/a/notes.txt").write_text("x")),
    ("stray", lambda root: (root / "enclaves/a/cert.p11").write_text("pkcs11:object=x")),
    ("stray", lambda root: os.mkfifo(root / "enclaves/a/pipe")),
    ("validity-differs", lambda root: resign(root, b"<not_after>2036-", b"<not_after>2030-")),
]


def second_grant() -> bytes:
    document = permissions_document(
        "CN=ros.b", policy("/b"), validity=Validity.starting(NOW, DAY), domains=Domains.single(0)
    )
    return document[document.index(b"<grant") : document.index(b"</permissions>")]


@pytest.mark.parametrize(
    ("code", "damage"), WARNINGS, ids=[f"{row[0]}-{n}" for n, row in enumerate(WARNINGS)]
)
def test_what_will_matter_is_a_warning(tmp_path: Path, code: str, damage: Damage) -> None:
    root = filled(tmp_path / "ks", ["/a", "/b"])
    damage(root)
    report = verify(root)
    assert code in {finding.code for finding in report.findings if finding.severity is Severity.WARNING}


def test_wildcards_are_noted(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", [])
    provision(root, [policy("/a", "/camera/*")], options=options())
    (finding,) = verify(root).findings
    assert (finding.severity, finding.code) == (
        Severity.NOTE,
        "wildcard",
    ) and "rt/camera/*" in finding.message


def test_names_of_strays_cannot_speak_to_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from keystore.verb import main

    root = filled(tmp_path / "ks", ["/a"])
    (root / "enclaves/\x1b[2Jgone").write_text("x")
    assert main(["verify", str(root)]) == 0
    assert "\x1b" not in capsys.readouterr().out


def test_nothing_to_check(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(NotAKeystoreError):
            verify(path)


def test_what_a_command_writes_meanwhile_is_no_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    written: list[object] = []

    def while_another_command_writes(*arguments: Any) -> Iterator[Finding]:
        if not written:
            written.append(renew(root, ["/a"], options=RenewOptions(new_keys=True, provisioning=options())))
        return enclaves.check_enclaves(*arguments)

    monkeypatch.setattr(verification, "check_enclaves", while_another_command_writes)
    assert verify(root).findings == () and written
